// Against SciPy: tests/data/math/rotations.py writes the table read here.
#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <sstream>

#include "tests/math/nasty.hpp"

namespace mocap {
namespace {

template <int N>
Eigen::Matrix<double, N, 1> numbers(std::istream& in) {
  Eigen::Matrix<double, N, 1> v;
  for (int i = 0; i < N; ++i) in >> v[i];
  return v;
}

Quaternion wxyz(std::istream& in) {
  const auto v = numbers<4>(in);
  return Quaternion(v[0], v[1], v[2], v[3]);
}

TEST(SciPy, AgreesOnEveryConversion) {
  std::ifstream file(TEST_DATA "/math/rotations.tsv");
  std::map<std::string, int> seen;
  std::string line, kind;
  while (std::getline(file, line)) {
    std::istringstream in(line);
    in >> kind;
    SCOPED_TRACE(line);
    if (kind == "rotvec") {
      const Vector3 v = numbers<3>(in);
      const Quaternion q = wxyz(in);
      const auto rows = numbers<9>(in);
      const RotationMatrix m = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(rows.data());
      EXPECT_LT(geodesic_distance(exp_map(v), q), 1e-15);
      EXPECT_LT((log_map(q) - v).norm(), 1e-14 * v.norm() + 1e-30);
      EXPECT_LT((to_matrix(q) - m).cwiseAbs().maxCoeff(), 1e-15);
      EXPECT_LT(geodesic_distance(to_quaternion(m), q), 3e-15);
      SixD columns;
      columns << m.col(0), m.col(1);
      EXPECT_LT((to_six_d(q) - columns).norm(), 1e-15);
      EXPECT_LT(geodesic_distance(from_six_d(columns), q), 3e-15);
    } else if (kind == "euler") {
      std::string text;
      in >> text;
      const EulerOrder order = EulerOrder::parse(text);
      const Vector3 angles = numbers<3>(in);
      const Quaternion q = wxyz(in);
      EXPECT_LT(geodesic_distance(from_euler(angles, order), q), 2e-15);
      if (text[0] != text[2]) {
        EXPECT_LT((to_euler(q, order, &angles) - angles).norm(), 1e-14);
      }
    } else if (kind == "slerp") {
      const Vector3 a = numbers<3>(in), b = numbers<3>(in);
      const double t = numbers<1>(in)[0];
      EXPECT_LT(geodesic_distance(slerp(exp_map(a), exp_map(b), t), wxyz(in)), 3e-15);
    } else if (kind == "distance") {
      const Vector3 a = numbers<3>(in), b = numbers<3>(in);
      const double d = numbers<1>(in)[0];
      EXPECT_NEAR(geodesic_distance(exp_map(a), exp_map(b)), d, 2e-15);
      EXPECT_NEAR(geodesic_distance(to_matrix(exp_map(a)), to_matrix(exp_map(b))), d, 3e-15);
    } else {
      FAIL() << kind;
    }
    ASSERT_FALSE(in.fail());
    ++seen[kind];
  }
  EXPECT_EQ(seen["rotvec"], 28);
  EXPECT_EQ(seen["euler"], 72);
  EXPECT_EQ(seen["slerp"], 50);
  EXPECT_EQ(seen["distance"], 10);
}

}  // namespace
}  // namespace mocap
