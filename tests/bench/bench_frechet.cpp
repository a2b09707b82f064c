// The Frechet distance of 8,000 x 512 features twice, covariances included; and its parts.
//
// usage: bench_frechet [FOLDER]    with FOLDER the features go there as raw doubles (row by row), for another program to be timed beside it: scripts/bench.sh
//
// Best of 5 medians of 3, wall clock and processor time.
#include <fmt/core.h>
#include <time.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <fstream>
#include <string>

#include "libmocap/base/random.hpp"
#include "libmocap/metrics/frechet.hpp"
#include "libmocap/metrics/linear_algebra.hpp"

namespace {

constexpr Eigen::Index kClips = 8000, kFeatures = 512;

double wall() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }
double processor() {
  timespec t{};
  ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

// Correlated, as a network's features are.
Eigen::MatrixXd features(std::uint64_t seed) {
  mocap::Random random(seed, 0xbe7c);
  Eigen::MatrixXd x(kClips, kFeatures);
  for (double& v : x.reshaped()) v = random.normal();
  for (Eigen::Index j = 1; j < kFeatures; ++j) x.col(j) = (0.6 * x.col(j - 1) + x.col(j)).array() + 0.01 * static_cast<double>(seed);
  return x;
}

template <class F>
void time(const std::string& name, F&& body) {
  double best_wall = 1e9, best_processor = 1e9;
  for (int round = 0; round < 5; ++round) {
    std::array<double, 3> walls{}, processors{};
    for (std::size_t i = 0; i < 3; ++i) {
      const double w = wall(), p = processor();
      body();
      walls[i] = wall() - w;
      processors[i] = processor() - p;
    }
    std::sort(walls.begin(), walls.end());
    std::sort(processors.begin(), processors.end());
    best_wall = std::min(best_wall, walls[1]);
    best_processor = std::min(best_processor, processors[1]);
  }
  fmt::print("{:<52} {:.3f} s wall, {:.3f} s of processor time\n", name, best_wall, best_processor);
}

}  // namespace

int main(int argc, char** argv) {
  using namespace mocap::metrics;
  const Eigen::MatrixXd a = features(1), b = features(2);
  if (argc > 1)
    for (const auto& [name, x] : {std::pair{"a", &a}, {"b", &b}}) {
      std::ofstream out(std::string(argv[1]) + "/" + name + ".f64", std::ios::binary);
      const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> rows = *x;
      out.write(reinterpret_cast<const char*>(rows.data()), static_cast<std::streamsize>(rows.size() * static_cast<Eigen::Index>(sizeof(double))));
    }
  double found = 0;
  time("Frechet distance, 8000 x 512 twice, two threads", [&] { found = frechet_distance(a, b, 2); });
  time("the same, one thread", [&] { found = frechet_distance(a, b, 1); });
  const Gaussian x = gaussian(a), y = gaussian(b);
  time("one covariance", [&] { gaussian(a); });
  time("distance of two Gaussians", [&] { frechet_distance(x, y); });
  time("  eigenvalues of S1 S2 by Cholesky", [&] { product_eigenvalues(x.covariance, y.covariance); });
  time("  root of S1 by eigenvectors (where Cholesky fails)", [&] { symmetric_eigen(x.covariance, true); });
  fmt::print("distance {:.12g}\n", found);
}
