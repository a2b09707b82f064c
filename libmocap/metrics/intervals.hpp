// How sure a figure is: Student's t over repeats, the bootstrap over clips.
#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

namespace mocap::metrics {

struct Interval {
  double value = 0, low = 0, high = 0;
  long n = 0;  // repeats, or clips
};

// Quantile of Student's t with `freedom` degrees of freedom, 0 < p < 1; within 1e-9. t(0.975, 19) = 2.093.
double t_quantile(double p, double freedom);

// Mean of repeats +- t(1 - (1 - level)/2, n - 1) s / sqrt(n), s with ddof 1. low and high are NaN for fewer than two values.
// Error(data) without values.
Interval t_interval(const std::vector<double>& repeats, double level = 0.95);

// `figure` of the rows counted (row i occurs counts[i] times; sum n), for `resamples` draws of n rows with replacement (Efron 1979):
// percentiles (1 -+ level)/2 of the draws, by linear interpolation, moved by value - mean of the draws, since a figure such as the
// Frechet distance is larger for any resample. Philox streams by draw: the same for any number of threads. `figure` must be thread-safe.
Interval bootstrap_interval(std::size_t n, double value, const std::function<double(const std::vector<int>& counts)>& figure, int resamples = 200, double level = 0.95,
                            std::uint64_t seed = 1, int threads = 1);
// Of the mean of values.
Interval bootstrap_mean(const std::vector<double>& values, int resamples = 1000, double level = 0.95, std::uint64_t seed = 1);

// Of a share of n clips: Wilson's 95 % score interval, which stays within 0 and 1. Error(data) for n < 1.
Interval share_interval(double share, long n);

}  // namespace mocap::metrics
