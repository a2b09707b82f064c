#include "libmocap/math/ground_curve.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <random>

#include "libmocap/base/error.hpp"

namespace mocap {
namespace {

constexpr double kPi = std::numbers::pi, kNan = std::numeric_limits<double>::quiet_NaN(), kInfinity = std::numeric_limits<double>::infinity();
using Points = std::vector<Vector2>;

std::string error_of(const std::function<void()>& call, Exit status = Exit::data) {
  try {
    call();
  } catch (const Error& e) {
    EXPECT_EQ(e.status(), status);
    return e.what();
  }
  return "no error";
}

// x = sin u, y = sin u cos u: from the crossing in the middle round both lobes and back.
GroundCurve figure_eight(int n = 400) {
  Points points;
  for (int i = 0; i <= n; ++i) {
    const double u = 2 * kPi * i / n;
    points.push_back({std::sin(u), std::sin(u) * std::cos(u)});
  }
  points.back() = points[static_cast<std::size_t>(n) / 2] = points[0];
  return GroundCurve(points);
}

GroundCurve random_curve(std::mt19937& random, int n) {
  std::uniform_real_distribution<double> u(-2, 2);
  Points points;
  for (int i = 0; i < n; ++i) points.push_back({u(random), u(random)});
  return GroundCurve(points);
}

TEST(GroundCurve, LengthsPointsAndTangents) {
  const GroundCurve c({{1, 1}, {4, 5}, {4, 5}, {4, 7}, {3, 7}});
  EXPECT_EQ(c.points(), (Points{{1, 1}, {4, 5}, {4, 7}, {3, 7}}));
  EXPECT_EQ(c.length(), 8);
  EXPECT_EQ(c.point_at(0), Vector2(1, 1));
  EXPECT_LT((c.point_at(2.5) - Vector2(2.5, 3)).norm(), 1e-15);
  EXPECT_EQ(c.point_at(5), Vector2(4, 5));
  EXPECT_EQ(c.point_at(6), Vector2(4, 6));
  EXPECT_EQ(c.point_at(8), Vector2(3, 7));
  EXPECT_EQ(c.point_at(-1), Vector2(1, 1));
  EXPECT_EQ(c.point_at(99), Vector2(3, 7));
  EXPECT_LT((c.tangent_at(0) - Vector2(0.6, 0.8)).norm(), 1e-15);
  EXPECT_EQ(c.tangent_at(-1), c.tangent_at(0));
  EXPECT_EQ(c.tangent_at(5), Vector2(0, 1));  // the segment that begins there
  EXPECT_EQ(c.tangent_at(7), Vector2(-1, 0));
  EXPECT_EQ(c.tangent_at(8), Vector2(-1, 0));
  EXPECT_TRUE(c.point_at(kNan).hasNaN() && c.tangent_at(kNan).hasNaN());
}

TEST(GroundCurve, RefusesWhatIsNoCurve) {
  EXPECT_EQ(error_of([] { GroundCurve({}); }), "a curve of 0 different points, expected at least 2");
  EXPECT_EQ(error_of([] { GroundCurve({{1, 2}, {1, 2}}); }), "a curve of 1 different points, expected at least 2");
  EXPECT_EQ(error_of([] { GroundCurve({{0.0, 0}, {-0.0, 0}}); }), "a curve of 1 different points, expected at least 2");
  EXPECT_EQ(error_of([] { GroundCurve({{0, 0}, {1, 0}, {kNan, 1}}); }), "point 2 is (nan, 1), expected finite metres");
  EXPECT_EQ(error_of([] { GroundCurve({{0, -kInfinity}, {1, 0}}); }), "point 0 is (0, -inf), expected finite metres");
  EXPECT_EQ(error_of([] { GroundCurve({{0, 0}, {2e9, 0}}); }), "point 1 is (2000000000, 0), expected metres within +-1e+09");
}

TEST(GroundCurve, NearestOnSegmentsAndCorners) {
  const GroundCurve c({{0, 0}, {2, 0}, {2, 2}});
  auto n = c.nearest({1, -3});
  EXPECT_EQ(n.s, 1);
  EXPECT_EQ(n.point, Vector2(1, 0));
  EXPECT_EQ(n.distance, 3);
  n = c.nearest({5, -4});  // beyond the corner: the same point for both segments
  EXPECT_EQ(n.s, 2);
  EXPECT_EQ(n.point, Vector2(2, 0));
  EXPECT_EQ(n.distance, 5);
  n = c.nearest({-3, 4});
  EXPECT_EQ(n.s, 0);
  EXPECT_EQ(n.distance, 5);
  n = c.nearest({2, 9});
  EXPECT_EQ(n.s, 4);
  EXPECT_EQ(n.point, Vector2(2, 2));
  n = c.nearest({kNan, 0});
  EXPECT_EQ(n.s, 0);
  EXPECT_TRUE(std::isnan(n.distance));
  EXPECT_EQ(c.nearest({kInfinity, 0}).distance, kInfinity);
}

TEST(GroundCurve, TiesGoToTheLowestArcLength) {
  const GroundCurve square({{0, 0}, {2, 0}, {2, 2}, {0, 2}, {0, 0}});
  EXPECT_EQ(square.nearest({1, 1}).s, 1);                // all four sides are 1 away
  EXPECT_EQ(square.nearest({1, 1}, 1.5, 8).s, 3);
  EXPECT_EQ(square.nearest({-1, -1}).s, 0);              // its start and its end
  EXPECT_EQ(square.nearest({-1, -1}, 0.5, 8).s, 8);
  const GroundCurve there_and_back({{0, 0}, {4, 0}, {0, 0}});
  EXPECT_EQ(there_and_back.nearest({1, 1}).s, 1);
  EXPECT_EQ(there_and_back.nearest({1, 1}, 4, 8).s, 7);
}

TEST(GroundCurve, NearestWithinAnInterval) {
  const GroundCurve c({{0, 0}, {2, 0}, {2, 2}});
  auto n = c.nearest({0, -1}, 0.5, 1.5);  // cut in the middle of a segment
  EXPECT_EQ(n.s, 0.5);
  EXPECT_EQ(n.point, Vector2(0.5, 0));
  n = c.nearest({9, 0}, 0.5, 1.5);
  EXPECT_EQ(n.s, 1.5);
  EXPECT_EQ(n.point, Vector2(1.5, 0));
  n = c.nearest({0, 0}, 3, 3);
  EXPECT_EQ(n.s, 3);
  EXPECT_EQ(n.point, Vector2(2, 1));
  EXPECT_EQ(c.nearest({0, 0}, 5, 7).s, 4);     // wholly outside
  EXPECT_EQ(c.nearest({9, 9}, -7, -5).s, 0);
  EXPECT_EQ(c.nearest({9, 9}, -kInfinity, kInfinity).s, 4);
  EXPECT_EQ(error_of([&] { c.nearest({0, 0}, 2, 1); }, Exit::internal), "GroundCurve: nearest point between 2 and 1 m");
  EXPECT_EQ(error_of([&] { c.nearest({0, 0}, kNan, 1); }, Exit::internal), "GroundCurve: nearest point between nan and 1 m");
}

// The same against points tried one by one.
TEST(GroundCurve, NearestAgreesWithTrialOverRandomCurves) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> u(-3, 3);
  for (int i = 0; i < 200; ++i) {
    const GroundCurve c = random_curve(random, 2 + i % 9);
    const Vector2 p(u(random), u(random));
    double from = (u(random) + 3) / 6 * c.length(), to = (u(random) + 3) / 6 * c.length();
    if (from > to) std::swap(from, to);
    const auto n = c.nearest(p, from, to);
    EXPECT_LE(from, n.s);
    EXPECT_LE(n.s, to);
    EXPECT_LT((c.point_at(n.s) - n.point).norm(), 1e-14);
    EXPECT_NEAR((p - n.point).norm(), n.distance, 1e-15);
    double least = kInfinity;
    for (int k = 0; k <= 5000; ++k) least = std::min(least, (c.point_at(from + (to - from) * k / 5000) - p).norm());
    EXPECT_LE(n.distance, least + 1e-14);
    EXPECT_GE(n.distance, least - (to - from) / 5000);
  }
}

// Somebody who walks a figure eight looks for the next point a little ahead only: both passes of the crossing come in their turn.
TEST(GroundCurve, AFigureEightIsFollowedInOrder) {
  const GroundCurve c = figure_eight();
  double s = 0, unrestricted = 0;
  int jumps = 0;
  for (int k = 1; k <= 500; ++k) {
    const double u = 2 * kPi * k / 500;
    const Vector2 p(std::sin(u), std::sin(u) * std::cos(u) + 0.05);  // beside the crossing the other pass is nearer
    const auto n = c.nearest(p, s - 0.1, s + 0.3);
    EXPECT_GT(n.s, s - 1e-9);
    EXPECT_LT(n.s, s + 0.1);
    EXPECT_LE(n.distance, 0.05 + 1e-4);
    s = n.s;
    const double everywhere = c.nearest(p).s;
    jumps += std::abs(everywhere - unrestricted) > 0.3;
    unrestricted = everywhere;
  }
  EXPECT_NEAR(s, c.length(), 1e-12);
  EXPECT_GT(jumps, 0);  // the interval is what keeps the order
}

TEST(GroundCurve, ACircleHasItsLengthAndItsDistances) {
  Points points;
  const int n = 100000;
  for (int i = 0; i <= n; ++i) points.push_back(Vector2(3, -1) + 2 * Vector2(std::cos(2 * kPi * i / n), std::sin(2 * kPi * i / n)));
  const GroundCurve c(points);
  const double chords = 2 * n * 2 * std::sin(kPi / n);
  EXPECT_NEAR(c.length(), chords, 1e-11);
  for (double a : {0.1, 1.0, 2.5, 4.0, 6.0}) {
    const auto near = c.nearest(Vector2(3, -1) + 5 * Vector2(std::cos(a), std::sin(a)));
    EXPECT_NEAR(near.s, 2 * a, 2 * kPi * 2 / n / 2);  // half a chord
    EXPECT_NEAR(near.distance, 3, 2e-9);
    EXPECT_LT((c.tangent_at(2 * a) - Vector2(-std::sin(a), std::cos(a))).norm(), 1e-4);
    EXPECT_NEAR(c.tangent_at(2 * a).norm(), 1, 1e-15);
  }
}

TEST(GroundCurve, SegmentsTooShortForTheSumDoNoHarm) {
  const double tiny = std::numeric_limits<double>::denorm_min();
  const GroundCurve c({{0, 0}, {0, 0.5}, {1e-300, 0.5}, {1e-300 + 1e-310, 0.5}, {0, 1}});
  EXPECT_EQ(c.points().size(), 5u);
  EXPECT_EQ(c.length(), 1);
  EXPECT_EQ(c.point_at(0.5), Vector2(1e-300 + 1e-310, 0.5));
  EXPECT_EQ(c.nearest({3, 0.5}).distance, 3);
  EXPECT_EQ(c.nearest({3, 0.75}).s, 0.75);
  const GroundCurve smallest({{0, 0}, {tiny, tiny}});
  EXPECT_GT(smallest.length(), 0);
  EXPECT_NEAR(smallest.tangent_at(0).x(), std::sqrt(0.5), 1e-15);
  EXPECT_NEAR(smallest.tangent_at(0).y(), std::sqrt(0.5), 1e-15);
  EXPECT_EQ(smallest.nearest({1, 1}).distance, std::sqrt(2));
  EXPECT_EQ(smallest.resampled(1).points().size(), 2u);
  const GroundCurve last_is_lost({{0, 0}, {1e9, 0}, {1e9, 1e-8}});
  EXPECT_EQ(last_is_lost.length(), 1e9);
  EXPECT_EQ(last_is_lost.point_at(1e9), Vector2(1e9, 1e-8));
  EXPECT_TRUE(last_is_lost.nearest({1e9, 1}, 1e9, 1e9).point.allFinite());
}

TEST(GroundCurve, ResampledEvenlyWithBothEnds) {
  const GroundCurve c({{0, 0}, {3, 0}, {3, 4}});
  const GroundCurve r = c.resampled(0.3);  // 7 / 0.3 = 23.3: 23 pieces
  ASSERT_EQ(r.points().size(), 24u);
  EXPECT_EQ(r.points().front(), Vector2(0, 0));
  EXPECT_EQ(r.points().back(), Vector2(3, 4));
  for (std::size_t i = 0; i < 24; ++i) EXPECT_LT((r.points()[i] - c.point_at(7.0 * static_cast<double>(i) / 23)).norm(), 1e-14);
  EXPECT_LT(r.length(), c.length());  // the corner is cut
  EXPECT_EQ(c.resampled(1).points().size(), 8u);
  EXPECT_EQ(c.resampled(1).length(), 7);  // the corner is one of the points
  EXPECT_EQ(c.resampled(100).points(), (Points{{0, 0}, {3, 4}}));
  EXPECT_EQ(error_of([&] { c.resampled(0); }, Exit::usage), "a spacing of 0 m, expected one above 0");
  EXPECT_EQ(error_of([&] { c.resampled(kNan); }, Exit::usage), "a spacing of nan m, expected one above 0");
  EXPECT_EQ(error_of([&] { c.resampled(1e-9); }, Exit::usage), "a spacing of 1e-09 m along 7 m, expected at most 10000000 points");
  EXPECT_EQ(error_of([&] { c.resampled(5e-324); }, Exit::usage), "a spacing of 5e-324 m along 7 m, expected at most 10000000 points");
}

TEST(GroundCurve, ResampledClosedCurvesStayCurves) {
  EXPECT_EQ(GroundCurve({{0, 0}, {2, 0}, {2, 2}, {0, 2}, {0, 0}}).resampled(100).points(), (Points{{0, 0}, {2, 2}, {0, 0}}));
  // Two equal lobes from the same crossing: halves would be the crossing three times.
  EXPECT_EQ(GroundCurve({{0, 0}, {1, 0}, {1, 1}, {0, 1}, {0, 0}, {-1, 0}, {-1, -1}, {0, -1}, {0, 0}}).resampled(100).points().size(), 4u);
}

TEST(GroundCurve, PlacedStartsWhereAndAsItIsTold) {
  std::mt19937 random(5);
  for (int i = 0; i < 100; ++i) {
    const GroundCurve c = random_curve(random, 2 + i % 5);
    std::uniform_real_distribution<double> u(-3, 3);
    const Vector2 origin(u(random), u(random));
    const double heading = u(random);
    const GroundCurve p = c.placed(origin, heading);
    EXPECT_EQ(p.points()[0], origin);
    EXPECT_NEAR(p.initial_heading(), heading, 1e-12);
    EXPECT_NEAR(p.length(), c.length(), 1e-13);
    ASSERT_EQ(p.points().size(), c.points().size());
    for (std::size_t k = 0; k < p.points().size(); ++k) EXPECT_NEAR((p.points()[k] - origin).norm(), (c.points()[k] - c.points()[0]).norm(), 1e-14);
    const auto area = [](const Points& q) { return q.size() < 3 ? 0 : (q[1] - q[0]).x() * (q[2] - q[0]).y() - (q[1] - q[0]).y() * (q[2] - q[0]).x(); };
    EXPECT_NEAR(area(p.points()), area(c.points()), 1e-12);  // turned, not mirrored
  }
}

TEST(GroundCurve, InitialHeadingLooksAFootAhead) {
  EXPECT_NEAR(GroundCurve({{0, 0}, {0, 0.01}, {9, 0.01}}).initial_heading(), std::atan2(0.01, 0.29), 1e-15);  // not pi / 2
  EXPECT_EQ(GroundCurve({{0, 0}, {0.05, 0.05}}).initial_heading(), kPi / 4);                                  // shorter than that
  EXPECT_EQ(GroundCurve({{0, 0}, {-1, 0}}).initial_heading(), kPi);
  // Back at its start after 0.3 m: the first segment decides.
  EXPECT_EQ(GroundCurve({{1, 1}, {1, 1.1}, {1.05, 1.05}, {1, 1.0}}).initial_heading(), kPi / 2);
  EXPECT_EQ(GroundCurve({{1, 1}, {1, 1.15}, {1, 1}}).initial_heading(), kPi / 2);
  EXPECT_EQ(error_of([] { GroundCurve({{0, 0}, {1, 0}}).placed({kNan, 0}, 0); }), "point 0 is (nan, 0), expected finite metres");
  EXPECT_EQ(error_of([] { GroundCurve({{0, 0}, {1e-12, 0}}).placed({1e6, 0}, 0); }), "a curve of 1 different points, expected at least 2");
}

}  // namespace
}  // namespace mocap
