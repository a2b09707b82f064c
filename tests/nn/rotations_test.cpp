#include "libmodels/nn/rotations.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "libmocap/base/random.hpp"
#include "libmocap/math/rotation.hpp"
#include "libmocap/skeleton/canonical_body.hpp"
#include "libmocap/skeleton/forward_kinematics.hpp"
#include "libmodels/nn/losses.hpp"
#include "libmodels/nn/mlp.hpp"
#include "tests/nn/gradient_check.hpp"

namespace mocap::nn {
namespace {

using torch::Tensor;

Tensor noise(at::IntArrayRef sizes, std::uint64_t stream) {
  Random random(5, stream);
  return normal_tensor(sizes, random).to(torch::kDouble);
}
Quaternion quaternion(const Tensor& q) { return {q[0].item<double>(), q[1].item<double>(), q[2].item<double>(), q[3].item<double>()}; }
RotationMatrix matrix(const Tensor& m) {
  RotationMatrix r;
  for (int i = 0; i < 9; ++i) r(i / 3, i % 3) = m[i].item<double>();
  return r;
}
Tensor flat(const RotationMatrix& r) {
  Tensor m = torch::empty({9}, torch::kDouble);
  for (int i = 0; i < 9; ++i) m[i] = r(i / 3, i % 3);
  return m;
}

TEST(Rotations, ExponentialMapAtAnyLength) {
  for (const double length : {0.0, 1e-9, 1e-3, 0.0999, 0.1001, 1.0, 3.1, 4.0, 6.2}) {
    const Tensor v = normalize_quaternions(noise({4, 3}, 1)) * length, q = quaternions_of_vectors(v);
    for (int i = 0; i < 4; ++i) {
      Eigen::Vector4d expected = Eigen::Vector4d::Zero();
      expected[0] = std::cos(length / 2);
      for (int c = 0; c < 3 && length > 0; ++c) expected[c + 1] = std::sin(length / 2) * v[i][c].item<double>() / length;
      for (int c = 0; c < 4; ++c) EXPECT_NEAR(q[i][c].item<double>(), expected[c], 1e-12) << length;
    }
    const Tensor weight = noise({4, 4}, 2);
    expect_gradients([&](const auto& in) { return (quaternions_of_vectors(in[0]) * weight).sum(); }, {v}, 1e-7, 12);
  }
}

TEST(Rotations, GramSchmidtOfAnyMatrix) {
  const Tensor m = noise({40, 9}, 3), q = quaternions_of_matrices(m);
  for (int i = 0; i < 40; ++i) {
    const Quaternion expected = to_quaternion(orthonormalize(matrix(m[i])));
    EXPECT_LT(mocap::geodesic_distance(quaternion(q[i]), expected), 1e-7);
    EXPECT_NEAR(quaternion(q[i]).norm(), 1, 1e-14);
    EXPECT_GE(q[i][0].item<double>(), 0);
  }
  const Tensor goal = normalize_quaternions(noise({40, 4}, 4));
  const auto angle = [&](const std::vector<Tensor>& in) { return geodesic_distance(quaternions_of_matrices(in[0]), goal).sum(); };
  expect_gradients(angle, {m}, 1e-5, 360);
  // Every branch of Shepperd's method, half turns among them.
  for (const Vector3& axis : {Vector3(1, 0, 0), Vector3(0, 1, 0), Vector3(0, 0, 1), Vector3(1, 2, -3).normalized()})
    for (const double a : {0.0, 1.0, 3.0, std::numbers::pi}) {
      const Quaternion r = exp_map(a * axis);
      EXPECT_LT(mocap::geodesic_distance(quaternion(quaternions_of_matrices(flat(to_matrix(r)))), r), 1e-7) << a;
    }
}

TEST(Rotations, MatricesThatAreNoneBecomeTheIdentityWithoutGradient) {
  Tensor m = torch::zeros({3, 9}, torch::kDouble);
  m[1][0] = m[1][1] = 1;  // parallel columns
  m[2][3] = 1;            // second column 0
  m.set_requires_grad(true);
  const Tensor q = quaternions_of_matrices(m);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(q[i][0].item<double>(), 1);
  EXPECT_EQ(torch::autograd::grad({q.square().sum() + q.sum()}, {m})[0].abs().sum().item<double>(), 0);
}

TEST(Rotations, MatrixConstraints) {
  const Tensor m = noise({12, 9}, 5), c = matrix_constraints(m);
  for (int i = 0; i < 12; ++i) {
    const RotationMatrix r = matrix(m[i]);
    EXPECT_NEAR(c[i][0].item<double>(), (r * r.transpose() - RotationMatrix::Identity()).squaredNorm(), 1e-11);
    EXPECT_NEAR(c[i][1].item<double>(), std::abs(r.determinant() - 1), 1e-12);
  }
  EXPECT_LT(matrix_constraints(flat(to_matrix(exp_map({1, 2, 0.5})))).sum().item<double>(), 1e-14);
  const Tensor weight = noise({12, 2}, 6);
  expect_gradients([&](const auto& in) { return (matrix_constraints(in[0]) * weight).sum(); }, {m}, 1e-6, 108);
}

TEST(Rotations, SignsAreContinuousAndOnTheSideOfMostW) {
  Tensor q = normalize_quaternions(torch::cat({torch::ones({2, 30, 3, 1}), 0.3 * noise({2, 30, 3, 3}, 7)}, 3)).contiguous();
  const Tensor expected = q.clone();
  q.mul_(torch::where(noise({2, 30, 3, 1}, 8) > 0, torch::full({}, 1.0, torch::kDouble), torch::full({}, -1.0, torch::kDouble)));
  make_signs_continuous(q);
  EXPECT_TRUE(torch::equal(q, expected));
}

TEST(BodyPositions, EqualForwardKinematics) {
  const auto body = canonical_body();
  const auto joints = static_cast<std::int64_t>(body->joint_count());
  const BodyPositions positions(*body);
  const Tensor q = normalize_quaternions(noise({5, joints, 4}, 9)), p = positions(q);
  ASSERT_EQ(p.size(1), joints - 1 + static_cast<std::int64_t>(body->end_sites.size()));
  for (int n = 0; n < 5; ++n) {
    std::vector<Quaternion> local;
    for (int j = 0; j < joints; ++j) local.push_back(quaternion(q[n][j]));
    Pose pose;
    forward_kinematics(*body, local, Vector3::Zero(), pose);
    std::vector<Vector3> expected(pose.positions.begin() + 1, pose.positions.end());
    const auto tips = end_site_positions(*body, pose);
    expected.insert(expected.end(), tips.begin(), tips.end());
    for (std::size_t i = 0; i < expected.size(); ++i)
      for (int c = 0; c < 3; ++c) EXPECT_NEAR(p[n][static_cast<std::int64_t>(i)][c].item<double>(), expected[i][c], 1e-12);
  }
  const Tensor single = positions(q.to(torch::kFloat));
  EXPECT_LT((single - p).abs().max().item<double>(), 1e-5);
}

TEST(BodyPositions, Gradient) {
  const auto body = canonical_body();
  const BodyPositions positions(*body);
  const Tensor weight = noise({2, positions.points(), 3}, 10);
  expect_gradients([&](const auto& in) { return (positions(normalize_quaternions(in[0])) * weight).sum(); }, {noise({2, body->joint_count(), 4}, 11)}, 1e-6, 200);
}

}  // namespace
}  // namespace mocap::nn
