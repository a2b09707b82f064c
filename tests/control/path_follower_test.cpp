#include "libmodels/control/path_follower.hpp"

#include <cmath>
#include <limits>
#include <numbers>

#include "tests/control/control_support.hpp"

namespace mocap::control {
namespace {

constexpr double kPi = std::numbers::pi;

PlanOptions small() {
  PlanOptions o;
  o.window = 10;
  o.overlap = 5;
  o.swarm = {4, 1, 1, 1};
  o.lbfgs = {6, 1, 0.05};
  return o;
}

struct Walker {
  lstm_gmm::Model generator;
  lstm_gmm::Sampler sampler{*generator.network};
  MotionModel model{generator, nullptr};
  explicit Walker(double step) : generator(walker(step)) {}
  Followed operator()(const GroundCurve& curve, const FollowSettings& settings = {}, PlanOptions options = small(), std::uint64_t number = 0, Terms terms = {prior(), noise_prior(0.05)}) const {
    return follow_path(model, sampler, curve, terms, settings, options, number);
  }
};
const Walker& brisk() {
  static const Walker w(0.04);
  return w;
}

GroundCurve straight(double length) { return GroundCurve({{1, 2}, {1, 2 + length}}); }

bool same(const Clip& a, const Clip& b) {
  if (a.frames() != b.frames() || a.contacts != b.contacts) return false;
  for (std::size_t t = 0; t < a.frames(); ++t)
    if (a.root_position[t] != b.root_position[t]) return false;
  for (std::size_t i = 0; i < a.rotations.size(); ++i)
    if (a.rotations[i].coeffs() != b.rotations[i].coeffs()) return false;
  return true;
}

TEST(FollowPath, EndsWhereTheCurveEnds) {
  const Followed f = brisk()(straight(1.5));
  EXPECT_TRUE(f.reached_end);
  EXPECT_FALSE(f.stalled);
  EXPECT_NEAR(f.followed_m, 1.5, 1e-9);
  f.clip.validate();
  EXPECT_EQ(f.clip.root_position[0].head<2>(), Vector2(1, 2));
  EXPECT_NEAR(yaw_of(f.clip.frame(0)[0]), kPi / 2, 1e-5);
  // The last frame is the first that is there.
  const std::size_t n = f.clip.frames();
  EXPECT_GE(f.clip.root_position[n - 1].y(), 3.5 - 1e-4);
  EXPECT_LT(f.clip.root_position[n - 2].y(), 3.5);
  EXPECT_NEAR(static_cast<double>(n), 1.5 / 0.04, 12);
  // The path is the curve, every 5 cm; figures are those of the clip.
  EXPECT_EQ(f.clip.path, straight(1.5).resampled(0.05).points());
  double way = 0, sum = 0, largest = 0;
  for (std::size_t t = 0; t < n; ++t) {
    if (t > 0) way += (f.clip.root_position[t] - f.clip.root_position[t - 1]).head<2>().norm();
    const double off = std::abs(f.clip.root_position[t].x() - 1);
    sum += off;
    largest = std::max(largest, off);
  }
  EXPECT_NEAR(f.mean_speed, way * 30 / static_cast<double>(n - 1), 1e-9);
  EXPECT_NEAR(f.mean_distance, sum / static_cast<double>(n), 1e-4);
  EXPECT_NEAR(f.largest_distance, largest, 1e-4);
  // Its windows begin one behind the other.
  std::int64_t at = 1;
  for (const auto& w : f.windows) {
    EXPECT_EQ(w.first, at);
    EXPECT_LE(w.after_lbfgs, w.after_swarm);
    ASSERT_EQ(w.terms.at(0).first, "prior");
    EXPECT_NEAR(w.prior_per_frame, w.terms[0].second / 10, 1e-9);
    at += 5;
  }
  EXPECT_LT(n, static_cast<std::size_t>(at) + 1);
}

TEST(FollowPath, TurnsWithTheCurve) {
  std::vector<Vector2> points;
  for (int i = 0; i <= 40; ++i) points.emplace_back(std::sin(kPi / 2 * i / 40), 1 - std::cos(kPi / 2 * i / 40));
  FollowSettings s;
  s.curve_sigma = 0.02;
  s.facing_sigma = 0.05;
  const Followed f = brisk()(GroundCurve(points), s);
  EXPECT_TRUE(f.reached_end);
  EXPECT_LT(f.mean_distance, 0.05);
  EXPECT_NEAR(yaw_of(f.clip.frame(f.clip.frames() - 1)[0]), kPi / 2, 0.4);
}

// A curve that is shaken within a step's length is shorter once every 5 cm of it are joined straight: it still ends at its end.
TEST(FollowPath, AShakenCurveIsNotFollowedBeyondItsEnd) {
  std::vector<Vector2> points;
  for (int i = 0; i <= 75; ++i) points.emplace_back(0.02 * i, i % 2 ? 0.02 : -0.02);
  const GroundCurve curve(points);
  ASSERT_GT(curve.length(), curve.resampled(0.05).length() + 0.3);
  const Followed f = brisk()(curve);
  EXPECT_TRUE(f.reached_end);
  EXPECT_NEAR(f.followed_m, curve.length(), 1e-9);
  EXPECT_NEAR(f.clip.root_position.back().x(), 1.5, 0.1);
}

TEST(FollowPath, WhoDoesNotGoStalls) {
  const Walker standing(0);
  const Followed f = standing(straight(5));
  EXPECT_FALSE(f.reached_end);
  EXPECT_TRUE(f.stalled);
  EXPECT_LT(f.followed_m, 0.5);
  EXPECT_NEAR(static_cast<double>(f.clip.frames()), 3 * 30, 10);
}

TEST(FollowPath, TimeRunsOut) {
  FollowSettings s;
  s.most_seconds = 0.7;
  const Followed f = brisk()(straight(5), s);
  EXPECT_FALSE(f.reached_end);
  EXPECT_FALSE(f.stalled);
  EXPECT_EQ(f.clip.frames(), 21u);
  EXPECT_NEAR(f.followed_m, 0.8, 0.3);
  s.most_seconds = 0.001;  // the frame that it starts with
  const Followed none = brisk()(straight(5), s);
  EXPECT_EQ(none.clip.frames(), 1u);
  EXPECT_EQ(none.windows.size(), 0u);
  EXPECT_EQ(none.mean_speed, 0);
  EXPECT_EQ(none.prior_per_frame, 0);
}

TEST(FollowPath, GoesAsFastAsIsAsked) {
  FollowSettings s;
  s.speed_sigma = 0.02;
  s.speed = 0.6;
  EXPECT_NEAR(brisk()(straight(1), s).mean_speed, 0.6, 0.15);
  s.speed = 1.6;
  EXPECT_NEAR(brisk()(straight(1), s).mean_speed, 1.6, 0.2);
}

TEST(FollowPath, TermsAreThoseOfTheSettings) {
  FollowSettings s;
  s.most_seconds = 0.2;
  const auto names = [&] {
    std::string all;
    const Followed f = brisk()(straight(5), s);
    for (const auto& [name, value] : f.windows.at(0).terms) all += name + " ";
    return all;
  };
  s.speed = 1;
  EXPECT_EQ(names(), "prior noise curve facing speed ");
  s.facing_sigma = 0;
  s.step_length = 0.5;
  EXPECT_EQ(names(), "prior noise curve speed step_length ");
}

TEST(FollowPath, SeedsAndNumbersTellMotionsApart) {
  PlanOptions o = small();
  const auto curve = straight(0.6);
  const Followed f = brisk()(curve, {}, o);
  o.swarm.threads = 3;
  EXPECT_TRUE(same(f.clip, brisk()(curve, {}, o).clip));
  EXPECT_FALSE(same(f.clip, brisk()(curve, {}, o, 1).clip));
  o.seed = 2;
  EXPECT_FALSE(same(f.clip, brisk()(curve, {}, o).clip));
}

// Twice through its crossing: whoever took the other branch there would be at the end after half of the way.
TEST(FollowPath, AFigureEightIsGoneRoundOnce) {
  std::vector<Vector2> points;
  for (int i = 0; i <= 200; ++i) points.emplace_back(1.2 * std::sin(2 * kPi * i / 200), 1.2 * std::sin(2 * kPi * i / 200) * std::cos(2 * kPi * i / 200));
  const GroundCurve eight(points);
  FollowSettings s;
  s.curve_sigma = 0.02;
  s.facing_sigma = 0.2;
  s.speed_sigma = 0.2;  // hurried, it goes from side to side
  const Followed f = brisk()(eight, s);
  EXPECT_TRUE(f.reached_end);
  EXPECT_LT(f.mean_distance, 0.1);
  double right = -9, left = 9, way = 0;
  for (std::size_t t = 1; t < f.clip.frames(); ++t) {
    right = std::max(right, f.clip.root_position[t].x());
    left = std::min(left, f.clip.root_position[t].x());
    way += (f.clip.root_position[t] - f.clip.root_position[t - 1]).head<2>().norm();
  }
  EXPECT_GT(right, 1.0);
  EXPECT_LT(left, -1.0);
  EXPECT_NEAR(way, eight.length(), 0.15 * eight.length());
}

TEST(FollowPath, WithoutAnyValueItStandsAndSaysSo) {
  const Walker standing(0);
  const Terms none = {term_of([](const Seen& seen) { return std::numeric_limits<double>::quiet_NaN() * seen.nats.sum(0); })};
  FollowSettings s;
  s.most_seconds = 1;
  const Followed f = standing(straight(5), s, small(), 0, none);
  EXPECT_FALSE(f.reached_end);
  EXPECT_EQ(f.clip.frames(), 30u);
  EXPECT_TRUE(std::isnan(f.windows.at(0).after_lbfgs));
  f.clip.validate();
}

}  // namespace
}  // namespace mocap::control
