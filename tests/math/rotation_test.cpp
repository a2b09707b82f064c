#include <gtest/gtest.h>

#include "libmocap/base/error.hpp"
#include "tests/math/nasty.hpp"

namespace mocap {
namespace {

using testing::kPi;
using testing::nasty_rotations;
using testing::negated;
using testing::turn;

TEST(Distances, AgreeWithEachOther) {
  const auto list = nasty_rotations();
  for (std::size_t i = 0; i < list.size(); i += 2)
    for (std::size_t j = 0; j < list.size(); j += 5) {
      const Quaternion &a = list[i], &b = list[j];
      const double d = geodesic_distance(a, b);
      ASSERT_NEAR(geodesic_distance(to_matrix(a), to_matrix(b)), d, 1e-14);
      ASSERT_NEAR(log_map(a.conjugate() * b).norm(), d, 1e-14);
      ASSERT_NEAR(quaternion_d2(a, b), 1 - std::cos(d / 2), 1e-15);
      ASSERT_NEAR(quaternion_d3(a, b), 2 * quaternion_d2(a, b), 2e-15);  // eq. 19
      ASSERT_EQ(geodesic_distance(a, negated(b)), d);
      ASSERT_NEAR(geodesic_distance(b, a), d, 1e-15);
      ASSERT_LE(d, kPi + 1e-15);
    }
}

TEST(Distances, AreExactForTinyTurns) {
  for (const double angle : {1e-12, 1e-9, 1e-7, 1e-4}) {
    const Quaternion a = turn(Vector3(1, 1, 0).normalized(), 0.8), b = a * turn(Vector3::UnitZ(), angle);
    EXPECT_NEAR(geodesic_distance(a, b), angle, 1e-15);
    EXPECT_NEAR(geodesic_distance(to_matrix(a), to_matrix(b)), angle, 1e-15);
  }
}

TEST(Slerp, MeetsItsEndsAndDividesTheArc) {
  const auto list = nasty_rotations();
  for (std::size_t i = 0; i < list.size(); i += 3)
    for (std::size_t j = 0; j < list.size(); j += 5) {
      const Quaternion &a = list[i], &b = list[j];
      const double d = geodesic_distance(a, b);
      ASSERT_LT(geodesic_distance(slerp(a, b, 0), a), 1e-14);
      ASSERT_LT(geodesic_distance(slerp(a, b, 1), b), 1e-14);
      for (const double t : {0.1, 0.5, 0.75}) {
        const Quaternion q = slerp(a, b, t);
        ASSERT_NEAR(q.norm(), 1, 1e-15);
        ASSERT_NEAR(geodesic_distance(a, q), t * d, 1e-13);
        ASSERT_NEAR(geodesic_distance(q, b), (1 - t) * d, 1e-13);
      }
    }
}

TEST(RotationBetween, TakesOneDirectionToTheOtherByTheShortestTurn) {
  const Vector3 directions[] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {-1, 0, 0}, {0, 0, -1}, {1, -2, 3}, {2e-5, 1e-5, -3e-5}};
  for (const Vector3& from : directions)
    for (const Vector3& to : directions) {
      const Quaternion q = rotation_between(from, to);
      EXPECT_LT((q * from.normalized() - to.normalized()).norm(), 1e-15 * 8) << from.transpose() << " to " << to.transpose();
      EXPECT_NEAR(geodesic_distance(q, Quaternion::Identity()), std::atan2(from.cross(to).norm(), from.dot(to)), 1e-14);
    }
}

TEST(RotationBetween, IsExactNearOppositeDirections) {
  for (const Vector3& a : {Vector3(1, 0, 0), Vector3(0, 0, 1), Vector3(0, 0, -1), Vector3(1, -2, 3).normalized().eval()})
    for (const double miss : {0.0, 1e-15, 1e-12, 1e-9, 1e-7, 1.3e-6, 1e-5, 1e-3}) {
      const Vector3 side = a.unitOrthogonal(), b = -std::cos(miss) * a + std::sin(miss) * side;
      const Quaternion q = rotation_between(a, b);
      EXPECT_NEAR(q.norm(), 1, 1e-14);
      EXPECT_LT((q * a - b).norm(), 2e-12) << a.transpose() << " missed by " << miss;
      EXPECT_NEAR(geodesic_distance(q, Quaternion::Identity()), kPi - miss, 2e-12);
    }
}

TEST(RotationBetween, OppositeHorizontalDirectionsTurnAboutZ) {
  EXPECT_LT(geodesic_distance(rotation_between({2, 1, 0}, {-4, -2, 0}), turn(Vector3::UnitZ(), kPi)), 1e-15);
}

TEST(FrameFrom, HasXAlongAndZNearestToUp) {
  const Quaternion q = frame_from({1, 1, 0.5}, {0, 0, 2});
  EXPECT_LT((q * Vector3::UnitX() - Vector3(1, 1, 0.5).normalized()).norm(), 1e-15);
  EXPECT_NEAR((q * Vector3::UnitY()).z(), 0, 1e-15);
  EXPECT_GT((q * Vector3::UnitZ()).z(), 0);
  EXPECT_THROW(frame_from({0, 0, 1}, {0, 0, -3}), Error);
  EXPECT_THROW(frame_from({0, 0, 0}, {0, 0, 1}), Error);
}

TEST(Twist, SplitsSwingAndTwist) {
  for (const Quaternion& q : nasty_rotations())
    for (const Vector3& axis : testing::nasty_axes()) {
      const Quaternion twist = twist_about(q, axis), swing = q * twist.conjugate();
      ASSERT_NEAR(twist.norm(), 1, 1e-14);
      ASSERT_LT((Vector3(twist.vec()) - axis * axis.dot(twist.vec())).norm(), 1e-15);
      ASSERT_NEAR(swing.vec().dot(axis), 0, 1e-12);
    }
  const Quaternion twist = turn(Vector3::UnitZ(), 2.5), swing = turn(Vector3(1, 2, 0).normalized(), 1.2);
  EXPECT_LT(geodesic_distance(twist_about(swing * twist, Vector3::UnitZ()), twist), 1e-15);
  EXPECT_LT(geodesic_distance(twist_about(turn(Vector3::UnitX(), kPi), Vector3::UnitZ()), Quaternion::Identity()), 1e-15);
}

TEST(Yaw, IsTheTwistAboutZ) {
  for (const Quaternion& q : nasty_rotations()) {
    const double yaw = yaw_of(q);
    ASSERT_GT(yaw, -kPi);
    ASSERT_LE(yaw, kPi);
    ASSERT_LT(geodesic_distance(yaw_rotation(yaw), twist_about(q, Vector3::UnitZ())), 1e-14) << q.coeffs().transpose();
  }
  for (const double yaw : {-3.0, -1e-9, 0.0, 1.0, kPi}) EXPECT_NEAR(yaw_of(yaw_rotation(yaw)), yaw, 1e-15);
  // A half turn on its side has no heading: rounding noise must not invent one.
  EXPECT_EQ(yaw_of(Quaternion(1e-17, 1, 0, 1e-17)), 0);
}

TEST(WrapAngle, LandsInTheHalfOpenCircle) {
  EXPECT_EQ(wrap_angle(kPi), kPi);
  EXPECT_EQ(wrap_angle(-kPi), kPi);
  EXPECT_EQ(wrap_angle(0), 0);
  EXPECT_NEAR(wrap_angle(kPi + 0.1), -kPi + 0.1, 1e-15);
  for (int k = -50; k <= 50; ++k)
    for (const double a : {-3.1, -1e-7, 0.0, 1.0, 3.1}) {
      EXPECT_NEAR(wrap_angle(a + 2 * kPi * k), a, 1e-13);
      EXPECT_LE(wrap_angle((2 * k + 1) * kPi), kPi);
      EXPECT_GT(wrap_angle((2 * k + 1) * kPi), -kPi);
    }
}

TEST(SignContinuity, FlipsOnlyWhereNeeded) {
  std::vector<Quaternion> q;
  for (int t = 0; t < 50; ++t)
    for (int j = 0; j < 2; ++j) {
      q.push_back(turn(Vector3::UnitY(), 0.3 * t + j));
      if ((t * 7 + j) % 3 == 0) q.back() = negated(q.back());
    }
  const auto before = q;
  for (std::size_t j = 0; j < 2; ++j) make_sign_continuous(q, j, 2, 50);
  for (std::size_t j = 0; j < 2; ++j) {
    EXPECT_GE(q[j].w(), 0);
    for (std::size_t t = 1; t < 50; ++t) EXPECT_GT(q[t * 2 + j].dot(q[(t - 1) * 2 + j]), 0);
  }
  for (std::size_t i = 0; i < q.size(); ++i) EXPECT_EQ(std::abs(q[i].dot(before[i])), std::abs(before[i].dot(before[i])));
  std::vector<Quaternion> half{Quaternion(0, 0, -1, 0)};
  make_sign_continuous(half, 0, 1, 1);
  EXPECT_EQ(half[0].y(), 1);
  make_sign_continuous(half, 0, 1, 0);
  EXPECT_EQ(half[0].y(), 1);
}

}  // namespace
}  // namespace mocap
