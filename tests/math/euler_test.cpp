#include <gtest/gtest.h>

#include "libmocap/base/error.hpp"
#include "tests/math/nasty.hpp"

namespace mocap {
namespace {

using testing::kPi;

const std::vector<std::string> kTaitBryan{"XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX"};

TEST(EulerOrder, ParsesAndPrints) {
  for (const std::string text : {"XYZ", "ZYX", "ZXZ", "X", "YZ"}) EXPECT_EQ(EulerOrder::parse(text).text(), text);
  EXPECT_EQ(EulerOrder::parse("zyx").text(), "ZYX");
  for (const std::string text : {"", "XYZX", "XYW", "X Y", "8", "XY\xfa"}) {
    try {
      EulerOrder::parse(text);
      FAIL() << text;
    } catch (const Error& e) {
      EXPECT_EQ(e.status(), Exit::usage);
    }
  }
}

TEST(Euler, OneAndTwoAxesMultiplyInOrder) {
  EXPECT_LT(geodesic_distance(from_euler({0.4, 9, 9}, EulerOrder::parse("Y")), testing::turn(Vector3::UnitY(), 0.4)), 1e-15);
  EXPECT_LT(geodesic_distance(from_euler({0.4, 0.3, 9}, EulerOrder::parse("ZX")),
                              testing::turn(Vector3::UnitZ(), 0.4) * testing::turn(Vector3::UnitX(), 0.3)), 1e-15);
}

TEST(Euler, ProperOrdersHaveNoInverseHere) {
  for (const char* text : {"XYX", "ZXZ", "XXY", "X", "XY"}) EXPECT_THROW(to_euler(Quaternion::Identity(), EulerOrder::parse(text)), Error) << text;
}

TEST(Euler, AnglesComeBackInTheirRanges) {
  for (const auto& text : kTaitBryan) {
    const EulerOrder order = EulerOrder::parse(text);
    for (double a = -3.1; a < 3.2; a += 0.62)
      for (double b = -1.5; b < 1.6; b += 0.5)
        for (double c = -3.1; c < 3.2; c += 0.62) {
          const Vector3 v = to_euler(from_euler({a, b, c}, order), order);
          ASSERT_LT((v - Vector3(a, b, c)).norm(), 1e-13) << text << " " << a << " " << b << " " << c;
        }
  }
}

TEST(Euler, GimbalLockTakesTheFirstAngleFromNear) {
  for (const auto& text : kTaitBryan) {
    const EulerOrder order = EulerOrder::parse(text);
    for (const double b : {kPi / 2, -kPi / 2}) {
      const Quaternion q = from_euler({0.5, b, -0.8}, order);
      EXPECT_NEAR(to_euler(q, order)[0], 0, 1e-15) << text;
      EXPECT_LT(geodesic_distance(from_euler(to_euler(q, order), order), q), 1e-14) << text;
      const Vector3 near(0.5, b, -0.8);
      EXPECT_LT((to_euler(q, order, &near) - near).norm(), 1e-14) << text;
      const Vector3 turns(0.5 + 4 * kPi, b, -0.8 - 6 * kPi);
      EXPECT_LT((to_euler(q, order, &turns) - turns).norm(), 1e-13) << text;
    }
  }
}

// The curve winds both outer angles several times round and takes the middle one over +-90 degrees and beyond +-180.
TEST(Euler, NearFollowsACurveThroughHalfTurnsAndPoles) {
  for (const auto& text : kTaitBryan) {
    const EulerOrder order = EulerOrder::parse(text);
    Vector3 previous(0.1, 0, -0.2);
    for (int t = 1; t <= 4000; ++t) {
      const double s = t / 4000.0;
      const Vector3 truth(0.1 + 15 * s, 4 * std::sin(9 * s), -0.2 - 11 * s);
      Quaternion q = from_euler(truth, order);
      if (t % 3 == 0) q = testing::negated(q);
      const Vector3 v = to_euler(q, order, &previous);
      ASSERT_LT((v - truth).norm(), 1e-9) << text << " at step " << t;
      previous = v;
    }
  }
}

TEST(Euler, NearStaysContinuousThroughExactGimbalLock) {
  for (const auto& text : kTaitBryan) {
    const EulerOrder order = EulerOrder::parse(text);
    Vector3 previous(0.3, kPi / 2 - 0.5, 0.4);
    for (int t = 0; t <= 100; ++t) {
      // Step 50 hits the pole exactly, where only the sum or difference of the outer angles is left.
      const Vector3 truth(0.3, kPi / 2 + 0.01 * (t - 50), 0.4 + 0.002 * t);
      const Quaternion q = from_euler(truth, order);
      const Vector3 v = to_euler(q, order, &previous);
      ASSERT_LT((v - previous).cwiseAbs().maxCoeff(), t == 0 ? 1e-9 : 0.0101) << text << " at step " << t;
      ASSERT_LT(geodesic_distance(from_euler(v, order), q), 1e-13);
      previous = v;
    }
  }
}

TEST(Euler, RotationIsExactHoweverNearThePole) {
  for (const auto& text : kTaitBryan) {
    const EulerOrder order = EulerOrder::parse(text);
    for (double miss = 1; miss > 1e-17; miss /= 3)
      for (const double pole : {kPi / 2, -kPi / 2}) {
        const Quaternion q = from_euler({0.9, pole - miss, 2.1}, order);
        ASSERT_LT(geodesic_distance(from_euler(to_euler(q, order), order), q), 2e-12) << text << " missed by " << miss;
      }
  }
}

}  // namespace
}  // namespace mocap
