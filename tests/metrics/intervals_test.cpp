#include "libmocap/metrics/intervals.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "fixtures.hpp"
#include "libmocap/base/error.hpp"
#include "libmocap/base/random.hpp"

namespace mocap::metrics {
namespace {

TEST(Intervals, StudentsTAgreesWithSciPy) {
  for (const auto& [p, n] : {std::pair{0.975, 19}, {0.975, 1}, {0.9, 3}, {0.025, 7}, {0.9995, 400}}) {
    char key[32];
    std::snprintf(key, sizeof key, "t.%g.%d", p, n);
    EXPECT_NEAR(t_quantile(p, n), test::expected(key), 5e-9 * std::abs(test::expected(key))) << key;  // SciPy 1.10 is off by 2e-9 at (0.9, 3): tables say 1.63774435369621
  }
  EXPECT_EQ(t_quantile(0.5, 4), 0);
  EXPECT_THROW(t_quantile(1, 4), Error);
  const auto i = t_interval({1, 2, 3, 4});
  EXPECT_EQ(i.value, 2.5);
  EXPECT_NEAR(i.high - i.value, 3.182446305284263 * std::sqrt(5.0 / 3) / 2, 1e-9);
  EXPECT_NEAR(i.value - i.low, i.high - i.value, 1e-12);
  EXPECT_EQ(i.n, 4);
  EXPECT_TRUE(std::isnan(t_interval({1}).low));
  EXPECT_THROW(t_interval({}), Error);
}

TEST(Intervals, TheBootstrapOfAMeanIsItsStandardError) {
  Random random(5, 0);
  std::vector<double> x;
  for (int i = 0; i < 400; ++i) x.push_back(random.normal(3, 2));
  const auto i = bootstrap_mean(x, 2000);
  double mean = 0, square = 0;
  for (const double v : x) mean += v / 400;
  for (const double v : x) square += (v - mean) * (v - mean);
  EXPECT_NEAR(i.value, mean, 1e-12);
  EXPECT_NEAR(i.high - i.low, 2 * 1.96 * std::sqrt(square / 400 / 400), 0.03);
  EXPECT_EQ(bootstrap_mean(x, 50).low, bootstrap_mean(x, 50).low);
  EXPECT_NE(bootstrap_mean(x, 50, 0.95, 2).low, bootstrap_mean(x, 50).low);
  // A figure that any resample makes larger by 10: the interval stays about the value.
  const auto figure = [&](const std::vector<int>& counts) {
    double sum = 0;
    for (std::size_t k = 0; k < counts.size(); ++k) sum += counts[k] * x[k];
    return sum / 400 + 10;
  };
  const auto one = bootstrap_interval(400, mean, figure, 100, 0.95, 1, 1), two = bootstrap_interval(400, mean, figure, 100, 0.95, 1, 2);
  EXPECT_LT(one.low, mean);
  EXPECT_GT(one.high, mean);
  EXPECT_EQ(one.low, two.low);
  EXPECT_EQ(one.high, two.high);
  EXPECT_THROW(bootstrap_mean({}), Error);
}

TEST(Intervals, SharesStayWithinZeroAndOne) {
  EXPECT_EQ(share_interval(0, 10).low, 0);
  EXPECT_NEAR(share_interval(0, 10).high, 0.2775, 1e-4);  // Wilson 1927
  EXPECT_EQ(share_interval(1, 10).high, 1);
  EXPECT_NEAR(share_interval(0.5, 100).low, 0.4038, 1e-4);
  EXPECT_THROW(share_interval(0.5, 0), Error);
}

}  // namespace
}  // namespace mocap::metrics
