// Exact t-SNE of N clips of 32 features in 8 classes, 1,000 iterations, on one thread and on two: N^2 pairs an iteration, 20 floating-point operations each.
#include <benchmark/benchmark.h>

#include "libmocap/base/random.hpp"
#include "libmocap/metrics/linear_algebra.hpp"
#include "libmocap/metrics/tsne.hpp"

namespace {

void tsne(benchmark::State& state) {
  const auto n = static_cast<Eigen::Index>(state.range(0));
  mocap::metrics::use_one_blas_thread();
  mocap::Random random(1, 1);
  Eigen::MatrixXd x(n, 32);
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < 32; ++j) x(i, j) = random.normal() + (i % 8 == j ? 6 : 0);
  mocap::metrics::TsneOptions options;
  options.threads = static_cast<int>(state.range(1));
  for (auto _ : state) benchmark::DoNotOptimize(mocap::metrics::tsne(x, options));
  state.counters["pairs/s"] = benchmark::Counter(static_cast<double>(n * n) * options.iterations, benchmark::Counter::kIsIterationInvariantRate);
}
BENCHMARK(tsne)->ArgNames({"clips", "threads"})->Args({1000, 1})->Args({1000, 2})->Args({2000, 1})->Args({2000, 2})->Unit(benchmark::kSecond)->UseRealTime()->MeasureProcessCPUTime();

}  // namespace

BENCHMARK_MAIN();
