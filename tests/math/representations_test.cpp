// One property suite for every representation of a rotation.
#include <gtest/gtest.h>

#include "libmocap/base/error.hpp"
#include "tests/math/nasty.hpp"

namespace mocap {
namespace {

using testing::kPi;
using testing::nasty_rotations;
using testing::negated;

struct AsQuaternion {
  static Quaternion from(const Quaternion& q) { return q; }
  static Quaternion back(const Quaternion& q) { return q; }
};
struct AsExpMap {
  static Vector3 from(const Quaternion& q) { return log_map(q); }
  static Quaternion back(const Vector3& v) { return exp_map(v); }
};
struct AsMatrix {
  static RotationMatrix from(const Quaternion& q) { return to_matrix(q); }
  static Quaternion back(const RotationMatrix& m) { return to_quaternion(m); }
};
struct AsSixD {
  static SixD from(const Quaternion& q) { return to_six_d(q); }
  static Quaternion back(const SixD& v) { return from_six_d(v); }
};
template <int A, int B, int C>
struct AsEuler {
  static constexpr EulerOrder order() { return {{A, B, C}, 3}; }
  static Vector3 from(const Quaternion& q) { return to_euler(q, order()); }
  static Quaternion back(const Vector3& v) { return from_euler(v, order()); }
};

template <class R>
class Representation : public ::testing::Test {};
using All = ::testing::Types<AsQuaternion, AsExpMap, AsMatrix, AsSixD, AsEuler<0, 1, 2>, AsEuler<0, 2, 1>, AsEuler<1, 0, 2>,
                             AsEuler<1, 2, 0>, AsEuler<2, 0, 1>, AsEuler<2, 1, 0>>;
TYPED_TEST_SUITE(Representation, All);

constexpr double kExact = 4e-15;   // a few units in the last place of an angle up to pi
constexpr double kLocked = 2e-12;  // at gimbal lock cos b is taken for 0 below 1e-12

TYPED_TEST(Representation, RoundTripKeepsTheRotation) {
  for (const Quaternion& q : nasty_rotations()) {
    const Quaternion back = TypeParam::back(TypeParam::from(q));
    ASSERT_NEAR(back.norm(), 1, 1e-14);
    ASSERT_LT(geodesic_distance(back, q), kLocked) << q.coeffs().transpose();
  }
}

TYPED_TEST(Representation, RoundTripIsExactAwayFromGimbalLock) {
  for (const Vector3& axis : testing::nasty_axes())
    for (const double angle : testing::nasty_angles()) {
      const Quaternion q = testing::turn(axis, angle);
      ASSERT_LT(geodesic_distance(TypeParam::back(TypeParam::from(q)), q), kExact) << axis.transpose() << " by " << angle;
    }
}

TYPED_TEST(Representation, BothSignsAreTheSameRotation) {
  for (const Quaternion& q : nasty_rotations())
    ASSERT_LT(geodesic_distance(TypeParam::back(TypeParam::from(q)), TypeParam::back(TypeParam::from(negated(q)))), kLocked);
}

TYPED_TEST(Representation, TurnsVectorsAlike) {
  const Vector3 v(0.3, -0.5, 0.8);
  for (const Quaternion& q : nasty_rotations()) {
    // v' = v + 2 w (u x v) + 2 u x (u x v), written out: independent of Eigen's product.
    const Vector3 u = q.vec(), expected = v + 2 * q.w() * u.cross(v) + 2 * u.cross(u.cross(v));
    ASSERT_LT((TypeParam::back(TypeParam::from(q)) * v - expected).norm(), kLocked);
  }
}

TYPED_TEST(Representation, KeepsProductsAndInverses) {
  const auto list = nasty_rotations();
  for (std::size_t i = 0; i < list.size(); i += 3) {
    const Quaternion& a = list[i];
    for (std::size_t j = 0; j < list.size(); j += 7) {
      const Quaternion& b = list[j];
      const Quaternion product = TypeParam::back(TypeParam::from(a)) * TypeParam::back(TypeParam::from(b));
      ASSERT_LT(geodesic_distance(TypeParam::back(TypeParam::from(a * b)), product), 3 * kLocked);
    }
    const Quaternion undone = TypeParam::back(TypeParam::from(a)) * TypeParam::back(TypeParam::from(a.conjugate()));
    ASSERT_LT(geodesic_distance(undone, Quaternion::Identity()), 2 * kLocked);
  }
}

TEST(ExpMap, KeepsRelativePrecisionAtSmallAngles) {
  for (const Vector3& axis : testing::nasty_axes())
    for (const double angle : {1e-300, 1e-12, 1e-9, 1e-8, 1.0001e-8, 9.9999e-5, 1.0001e-4, 1e-2, 3.0}) {
      const Vector3 v = angle * axis;
      EXPECT_LT((log_map(exp_map(v)) - v).norm(), 1e-14 * angle) << angle;
      EXPECT_GE(exp_map(v).w(), 0);
    }
  EXPECT_EQ(log_map(Quaternion::Identity()), Vector3::Zero());
  EXPECT_EQ(log_map(Quaternion(-1, 0, 0, 0)), Vector3::Zero());
}

TEST(ExpMap, LogIsTheShortTurn) {
  for (const Quaternion& q : nasty_rotations()) EXPECT_LE(log_map(q).norm(), kPi + 1e-15);
  EXPECT_NEAR(log_map(exp_map(Vector3(0, 0, kPi + 0.1))).z(), -(kPi - 0.1), 1e-14);
  EXPECT_NEAR(log_map(exp_map(Vector3(20 * kPi + 0.25, 0, 0))).x(), 0.25, 1e-13);
}

TEST(Matrix, IsOrthonormalWithDeterminantOne) {
  for (const Quaternion& q : nasty_rotations()) {
    const RotationMatrix m = to_matrix(q);
    EXPECT_LT((m * m.transpose() - RotationMatrix::Identity()).norm(), 1e-14);
    EXPECT_NEAR(m.determinant(), 1, 1e-14);
  }
}

TEST(Matrix, RefusesWhatIsNoRotation) {
  const double nan = std::nan("");
  RotationMatrix m = RotationMatrix::Identity();
  EXPECT_NO_THROW(to_quaternion(m));
  EXPECT_THROW(to_quaternion(2 * m), Error);
  EXPECT_THROW(to_quaternion(-m), Error);
  EXPECT_THROW(to_quaternion(RotationMatrix::Zero()), Error);
  for (int i = 0; i < 9; ++i) {
    RotationMatrix bad = m;
    bad(i / 3, i % 3) = nan;
    EXPECT_THROW(to_quaternion(bad), Error) << i;
    bad(i / 3, i % 3) = std::numeric_limits<double>::infinity();
    EXPECT_THROW(to_quaternion(bad), Error) << i;
  }
}

TEST(SixDimensional, ScaleAndShearOfTheColumnsDoNotMatter) {
  for (const Quaternion& q : nasty_rotations())
    for (const double scale : {1e-9, 1e-3, 1.0, 1e6}) {
      SixD v = to_six_d(q);
      v.tail<3>() += 0.4 * v.head<3>();
      v *= scale;
      EXPECT_LT(geodesic_distance(from_six_d(v), q), 1e-14) << scale;
    }
}

TEST(SixDimensional, RefusesParallelZeroAndNotFinite) {
  SixD v;
  v << 1, 2, 3, -2, -4, -6;
  EXPECT_THROW(from_six_d(v), Error);
  v << 0, 0, 0, 1, 0, 0;
  EXPECT_THROW(from_six_d(v), Error);
  v << 1, 0, 0, 0, 0, 0;
  EXPECT_THROW(from_six_d(v), Error);
  v << 1, 0, 0, 0, std::nan(""), 0;
  EXPECT_THROW(from_six_d(v), Error);
  v << 1, 0, 0, 0, std::numeric_limits<double>::infinity(), 0;
  EXPECT_THROW(from_six_d(v), Error);
}

}  // namespace
}  // namespace mocap
