#include "libmocap/corpus/curves.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "libmocap/base/error.hpp"
#include "libmocap/corpus/planning.hpp"

namespace mocap::corpus {
namespace {

TEST(KeyCurve, PassesItsKeysWithoutOvershootAndWithoutKinks) {
  KeyCurve c;
  const std::vector<std::pair<double, double>> keys = {{0, 1}, {0.5, 3}, {0.7, 3}, {2, -1}, {2.1, 0}};
  for (const auto& [t, v] : keys) c.add(t, v);
  c.finish();
  for (const auto& [t, v] : keys) EXPECT_NEAR(c(t), v, 1e-12);
  for (double t = 0.5; t < 0.7; t += 0.01) EXPECT_NEAR(c(t), 3, 1e-12) << "a flat stretch stays flat";
  for (double t = -1; t < 3; t += 0.001) {
    EXPECT_LE(c(t), 3 + 1e-12);
    EXPECT_GE(c(t), -1 - 1e-12);
    const double slope = (c(t + 1e-6) - c(t - 1e-6)) / 2e-6;
    EXPECT_NEAR(c.at(t).slope, slope, 1e-3 * (1 + std::abs(slope))) << t;
  }
  EXPECT_EQ(c(-5), 1);
  EXPECT_EQ(c(5), 0);
}

TEST(KeyCurve, RefusesTimesThatDoNotIncrease) {
  KeyCurve c;
  c.add(1, 0);
  EXPECT_THROW(c.add(1, 2), Error);
  QuinticPath p;
  p.add(1, 0);
  EXPECT_THROW(p.add(0.5, 0), Error);
}

TEST(QuinticPath, IsExactOnFreeFallAndSmoothAtKnots) {
  QuinticPath p;
  p.add(0, 0);
  p.add(0.5, 1, 2, -9.81);
  const double h = 0.3;
  p.add(0.5 + h, 1 + 2 * h - 9.81 * h * h / 2, 2 - 9.81 * h, -9.81);
  p.add(1.5, 0.2);
  for (double t = 0.5; t <= 0.5 + h; t += 0.01)
    EXPECT_NEAR(p(t), 1 + 2 * (t - 0.5) - 9.81 * (t - 0.5) * (t - 0.5) / 2, 1e-12);
  const double e = 1e-4;
  for (const double t : {0.5, 0.8}) {
    EXPECT_NEAR((p(t + e) - p(t)) / e, (p(t) - p(t - e)) / e, 2e-3);
    EXPECT_NEAR((p(t + 2 * e) - 2 * p(t + e) + p(t)) / (e * e), -9.81, 0.2);
    EXPECT_NEAR((p(t) - 2 * p(t - e) + p(t - 2 * e)) / (e * e), -9.81, 0.2);
  }
}

TEST(SlowNoise, HasUnitVarianceAndIsSlow) {
  double sum = 0, square = 0, fastest = 0;
  for (std::uint64_t k = 0; k < 2000; ++k) {
    Random random(3, k);
    const SlowNoise noise(random, 0.05, 0.4);
    const double x = noise(1.7);
    sum += x, square += x * x;
    fastest = std::max(fastest, std::abs(noise(1.71) - x) / 0.01);
  }
  EXPECT_NEAR(sum / 2000, 0, 0.08);
  EXPECT_NEAR(square / 2000, 1, 0.08);
  EXPECT_LT(fastest, 4 * 2 * 3.15 * 0.4 * 0.71);
}

TEST(Fourier, HasItsMeanAndHarmonics) {
  const Fourier f{0.5, 2, 0.1, 0.3, 0.2};
  double mean = 0, c1 = 0, c2 = 0;
  const int n = 64;
  for (int i = 0; i < n; ++i) {
    const double p = static_cast<double>(i) / n, x = f(p), tau = 6.283185307179586;
    mean += x / n, c1 += 2 * x * std::cos(tau * (p - 0.1)) / n, c2 += 2 * x * std::cos(2 * tau * (p - 0.2)) / n;
  }
  EXPECT_NEAR(mean, 0.5, 1e-12);
  EXPECT_NEAR(c1, 2, 1e-12);
  EXPECT_NEAR(c2, 0.3, 1e-12);
}

TEST(SmoothCover, IsNowhereBelowAndSmooth) {
  std::vector<double> values(200, 0.0);
  values[80] = 1, values[90] = 0.4, values[199] = 0.7;
  const std::vector<double> cover = smooth_cover(values, 12);
  for (std::size_t i = 0; i < values.size(); ++i) {
    EXPECT_GE(cover[i], values[i] - 1e-12);
    EXPECT_LE(cover[i], 1 + 1e-12);
    EXPECT_LT(std::abs(cover[i] - cover[i > 0 ? i - 1 : 0]), 0.1);
  }
  EXPECT_EQ(cover[40], 0);
}

}  // namespace
}  // namespace mocap::corpus
