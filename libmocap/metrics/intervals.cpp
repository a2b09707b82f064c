#include "libmocap/metrics/intervals.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "libmocap/base/error.hpp"
#include "libmocap/base/parallel.hpp"
#include "libmocap/base/random.hpp"

namespace mocap::metrics {
namespace {

// Regularised incomplete beta function by its continued fraction (DLMF 8.17.22, modified Lentz).
double incomplete_beta(double a, double b, double x) {
  if (x <= 0) return 0;
  if (x >= 1) return 1;
  if (x > (a + 1) / (a + b + 2)) return 1 - incomplete_beta(b, a, 1 - x);
  const double tiny = 1e-300;
  double c = 1, d = 1 - (a + b) * x / (a + 1);
  d = 1 / (std::abs(d) < tiny ? tiny : d);
  double h = d;
  for (int m = 1; m < 1000; ++m) {
    const double even = m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m)), odd = -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1));
    double step = 1;
    for (const double f : {even, odd}) {
      d = 1 + f * d;
      c = 1 + f / c;
      d = 1 / (std::abs(d) < tiny ? tiny : d);
      if (std::abs(c) < tiny) c = tiny;
      step = c * d;
      h *= step;
    }
    if (std::abs(step - 1) < 1e-16) break;
  }
  return std::exp(std::lgamma(a + b) - std::lgamma(a) - std::lgamma(b) + a * std::log(x) + b * std::log1p(-x)) * h / a;
}

double t_upper_tail(double t, double freedom) { return 0.5 * incomplete_beta(freedom / 2, 0.5, freedom / (freedom + t * t)); }  // t >= 0

double percentile(const std::vector<double>& sorted, double p) {
  const double at = p * static_cast<double>(sorted.size() - 1);
  const auto i = static_cast<std::size_t>(at);
  return i + 1 < sorted.size() ? sorted[i] + (at - static_cast<double>(i)) * (sorted[i + 1] - sorted[i]) : sorted.back();
}

constexpr std::uint64_t kStream = 0xb007;

}  // namespace

double t_quantile(double p, double freedom) {
  if (!(p > 0 && p < 1) || !(freedom > 0)) refuse({}, "a quantile of Student's t outside 0 < p < 1 or without freedom, expected both");
  if (p == 0.5) return 0;
  const double tail = std::min(p, 1 - p);
  double low = 0, high = 1;
  while (t_upper_tail(high, freedom) > tail && high < 1e300) high *= 2;
  for (int i = 0; i < 200 && high - low > 1e-14 * high; ++i) {
    const double middle = (low + high) / 2;
    (t_upper_tail(middle, freedom) > tail ? low : high) = middle;
  }
  return p < 0.5 ? -high : high;
}

Interval t_interval(const std::vector<double>& repeats, double level) {
  if (repeats.empty()) refuse({}, "0 repeats, expected at least one");
  const double n = static_cast<double>(repeats.size()), mean = std::accumulate(repeats.begin(), repeats.end(), 0.0) / n;
  Interval out{mean, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::quiet_NaN(), static_cast<long>(repeats.size())};
  if (repeats.size() < 2) return out;
  double square = 0;
  for (const double v : repeats) square += (v - mean) * (v - mean);
  const double half = t_quantile(1 - (1 - level) / 2, n - 1) * std::sqrt(square / (n - 1) / n);
  out.low = mean - half;
  out.high = mean + half;
  return out;
}

Interval bootstrap_interval(std::size_t n, double value, const std::function<double(const std::vector<int>&)>& figure, int resamples, double level, std::uint64_t seed, int threads) {
  if (n < 1 || resamples < 2) refuse({}, "a bootstrap of 0 clips or fewer than two resamples, expected both");
  std::vector<double> values(static_cast<std::size_t>(resamples));
  parallel_for(values.size(), threads, [&](std::size_t r) {
    Random random(seed, stream_of(kStream, r));
    std::vector<int> counts(n, 0);
    for (std::size_t i = 0; i < n; ++i) ++counts[random.below(n)];
    values[r] = figure(counts);
  });
  const double moved = value - std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
  std::sort(values.begin(), values.end());
  return {value, percentile(values, (1 - level) / 2) + moved, percentile(values, (1 + level) / 2) + moved, static_cast<long>(n)};
}

Interval bootstrap_mean(const std::vector<double>& values, int resamples, double level, std::uint64_t seed) {
  if (values.empty()) refuse({}, "0 values, expected at least one");
  const double n = static_cast<double>(values.size()), mean = std::accumulate(values.begin(), values.end(), 0.0) / n;
  return bootstrap_interval(
      values.size(), mean,
      [&](const std::vector<int>& counts) {
        double sum = 0;
        for (std::size_t i = 0; i < values.size(); ++i) sum += counts[i] * values[i];
        return sum / n;
      },
      resamples, level, seed);
}

Interval share_interval(double share, long n) {
  if (n < 1) refuse({}, "a share of 0 clips, expected at least one");
  const double z = 1.959963984540054, count = static_cast<double>(n), spread = z * z / count;
  const double centre = (share + spread / 2) / (1 + spread), half = std::sqrt(spread * (share * (1 - share) + spread / 4)) / (1 + spread);
  return {share, std::clamp(centre - half, 0.0, share), std::clamp(centre + half, share, 1.0), n};
}

}  // namespace mocap::metrics
