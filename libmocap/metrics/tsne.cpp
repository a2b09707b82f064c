#include "libmocap/metrics/tsne.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "libmocap/base/error.hpp"
#include "libmocap/base/parallel.hpp"
#include "libmocap/base/random.hpp"
#include "libmocap/metrics/frechet.hpp"

namespace mocap::metrics {
namespace {

using Vector = Eigen::VectorXd;

void check_finite(const Eigen::MatrixXd& x) {
  if (x.allFinite()) return;
  for (Eigen::Index i = 0; i < x.rows(); ++i)
    for (Eigen::Index j = 0; j < x.cols(); ++j)
      if (!std::isfinite(x(i, j))) refuse({}, fmt::format("features: row {}, column {} is {}, expected finite numbers", i + 1, j + 1, std::isnan(x(i, j)) ? "nan" : "infinite"));
}

// Blocks of rows to share out; a row's result does not depend on its block.
void for_rows(Eigen::Index n, int threads, const std::function<void(Eigen::Index)>& body) {
  constexpr Eigen::Index kBlock = 32;
  parallel_for(static_cast<std::size_t>((n + kBlock - 1) / kBlock), threads, [&](std::size_t b) {
    const Eigen::Index first = static_cast<Eigen::Index>(b) * kBlock;
    for (Eigen::Index i = first; i < std::min(n, first + kBlock); ++i) body(i);
  });
}

// Squared distances of row i to all; `columns` holds the rows as columns.
Vector distances_from(const Eigen::MatrixXd& columns, Eigen::Index i) { return (columns.colwise() - columns.col(i)).colwise().squaredNorm().transpose(); }

// p_j|i over j. Newton on ln b, where the entropy H = ln S + b E[d] falls with slope -b^2 Var[d], kept inside a bracket that halves
// where Newton leaves it. Distances are counted from the nearest one: the same probabilities, and exp never underflows for all of them.
Vector conditional_row(const Vector& distances, Eigen::Index self, double perplexity, double* entropy) {
  const Eigen::Index n = distances.size();
  double least = std::numeric_limits<double>::infinity(), sum = 0;
  for (Eigen::Index j = 0; j < n; ++j)
    if (j != self) least = std::min(least, distances[j]), sum += distances[j];
  const double mean = sum / static_cast<double>(n - 1) - least;
  Vector p = Vector::Constant(n, 1 / static_cast<double>(n - 1));
  p[self] = 0;
  *entropy = std::log(static_cast<double>(n - 1));
  if (!(mean > 0)) return p;  // all at one distance: no width can tell them apart
  const double target = std::log(perplexity), log_mean = std::log(mean);
  double low = -40 - log_mean, high = 40 - log_mean, log_b = -log_mean;
  for (int step = 0; step < 200; ++step) {
    const double b = std::exp(log_b);
    double s = 0, first = 0, second = 0;
    for (Eigen::Index j = 0; j < n; ++j) {
      if (j == self) continue;
      const double d = distances[j] - least, w = std::exp(-b * d);
      p[j] = w;
      s += w;
      first += w * d;
      second += w * d * d;
    }
    first /= s;
    *entropy = std::log(s) + b * first;
    const double error = *entropy - target, slope = -b * b * std::max(0.0, second / s - first * first);
    (error > 0 ? low : high) = log_b;
    if (std::abs(error) < 1e-12 || high - low < 1e-14 * std::max(1.0, std::abs(log_b))) break;
    const double newton = slope < 0 ? log_b - error / slope : high;
    log_b = newton > low && newton < high ? newton : (low + high) / 2;
  }
  return p / p.sum();
}

// What one row of the gradient is made of.
struct Pull {
  double attract_x = 0, attract_y = 0;  // sum_j p_ij w_ij (y_i - y_j)
  double repel_x = 0, repel_y = 0;      // sum_j w_ij^2 (y_i - y_j)
  double weight = 0;                    // sum_j w_ij, j = i included
};

// Eight sums side by side, added up at the end in one order: the same bits whatever instructions the compiler may use.
// One pass suffices as the sum of all w, which q needs, can be divided by afterwards.
[[gnu::always_inline]] inline Pull pull_on(Eigen::Index n, const double* p, const double* x, const double* y, double xi, double yi) {
  constexpr Eigen::Index kLanes = 8;
  typedef double Lanes __attribute__((vector_size(kLanes * sizeof(double)), aligned(8), may_alias));
  Lanes ax{}, ay{}, rx{}, ry{}, z{};
  const Eigen::Index whole = n / kLanes * kLanes;
  for (Eigen::Index j = 0; j < whole; j += kLanes) {
    const Lanes dx = xi - *reinterpret_cast<const Lanes*>(x + j), dy = yi - *reinterpret_cast<const Lanes*>(y + j);
    const Lanes w = 1.0 / (1.0 + (dx * dx + dy * dy));
    const Lanes a = *reinterpret_cast<const Lanes*>(p + j) * w, r = w * w;
    ax += a * dx;
    ay += a * dy;
    rx += r * dx;
    ry += r * dy;
    z += w;
  }
  Pull out;
  for (Eigen::Index k = 0; k < kLanes; ++k) {
    out.attract_x += ax[k];
    out.attract_y += ay[k];
    out.repel_x += rx[k];
    out.repel_y += ry[k];
    out.weight += z[k];
  }
  for (Eigen::Index j = whole; j < n; ++j) {
    const double dx = xi - x[j], dy = yi - y[j], w = 1 / (1 + (dx * dx + dy * dy)), a = p[j] * w, r = w * w;
    out.attract_x += a * dx;
    out.attract_y += a * dy;
    out.repel_x += r * dx;
    out.repel_y += r * dy;
    out.weight += w;
  }
  return out;
}

#ifdef __x86_64__
__attribute__((target("avx512f,prefer-vector-width=512"))) Pull pull_avx512(Eigen::Index n, const double* p, const double* x, const double* y, double xi, double yi) { return pull_on(n, p, x, y, xi, yi); }
__attribute__((target("avx2"))) Pull pull_avx2(Eigen::Index n, const double* p, const double* x, const double* y, double xi, double yi) { return pull_on(n, p, x, y, xi, yi); }
#endif
Pull pull_plain(Eigen::Index n, const double* p, const double* x, const double* y, double xi, double yi) { return pull_on(n, p, x, y, xi, yi); }

auto pull_of_this_machine() {
#ifdef __x86_64__
  if (__builtin_cpu_supports("avx512f")) return pull_avx512;
  if (__builtin_cpu_supports("avx2")) return pull_avx2;
#endif
  return pull_plain;
}

Eigen::MatrixXd start(const Eigen::MatrixXd& features, const TsneOptions& options) {
  Eigen::MatrixXd y(features.rows(), 2);
  if (options.random_start) {
    Random random(options.seed, 0x75e);
    for (Eigen::Index i = 0; i < y.rows(); ++i)
      for (Eigen::Index k = 0; k < 2; ++k) y(i, k) = random.normal(0, 1e-4);
    return y;
  }
  const int axes = static_cast<int>(std::min<Eigen::Index>(2, features.cols()));
  const Pca pca = fit_pca(features, axes);
  y.leftCols(axes) = project(pca, features);
  y *= 1e-4 / std::sqrt((y.col(0).array() - y.col(0).mean()).square().mean());
  // On one line clips cannot pass each other, ever: a little breadth lets them.
  if (axes == 1 || !(pca.variance[1] > 1e-20 * pca.variance[0])) {
    Random random(options.seed, 0x75f);
    for (Eigen::Index i = 0; i < y.rows(); ++i) y(i, 1) = random.normal(0, 1e-5);
  }
  return y;
}

}  // namespace

Eigen::MatrixXd conditional_probabilities(const Eigen::MatrixXd& features, double perplexity, int threads) {
  const Eigen::MatrixXd columns = features.transpose();
  Eigen::MatrixXd p(features.rows(), features.rows());
  for_rows(features.rows(), threads, [&](Eigen::Index i) {
    double entropy = 0;
    p.col(i) = conditional_row(distances_from(columns, i), i, perplexity, &entropy);
  });
  return p;
}

Eigen::MatrixXd joint_probabilities(const Eigen::MatrixXd& conditional) {
  const Eigen::Index n = conditional.rows();
  Eigen::MatrixXd p(n, n);
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j <= i; ++j) p(i, j) = p(j, i) = (conditional(i, j) + conditional(j, i)) / (2 * static_cast<double>(n));
  return p;
}

Eigen::MatrixXd tsne_gradient(const Eigen::MatrixXd& joint, const Eigen::MatrixXd& points, double exaggeration, int threads) {
  static const auto pull = pull_of_this_machine();
  const Eigen::Index n = points.rows();
  std::vector<Pull> pulls(static_cast<std::size_t>(n));
  for_rows(n, threads, [&](Eigen::Index i) { pulls[static_cast<std::size_t>(i)] = pull(n, joint.col(i).data(), points.col(0).data(), points.col(1).data(), points(i, 0), points(i, 1)); });
  double z = 0;
  for (const Pull& p : pulls) z += p.weight;
  z -= static_cast<double>(n);  // w_ii = 1
  Eigen::MatrixXd gradient(n, 2);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Pull& p = pulls[static_cast<std::size_t>(i)];
    gradient(i, 0) = 4 * (exaggeration * p.attract_x - p.repel_x / z);
    gradient(i, 1) = 4 * (exaggeration * p.attract_y - p.repel_y / z);
  }
  return gradient;
}

double tsne_divergence(const Eigen::MatrixXd& joint, const Eigen::MatrixXd& points, int threads) {
  const Eigen::Index n = points.rows();
  const Eigen::MatrixXd columns = points.transpose();
  Vector weight(n), part(n), mass(n);
  for_rows(n, threads, [&](Eigen::Index i) {
    const Vector d = distances_from(columns, i);
    weight[i] = part[i] = mass[i] = 0;
    for (Eigen::Index j = 0; j < n; ++j) {
      if (j == i) continue;
      weight[i] += 1 / (1 + d[j]);
      if (const double p = joint(j, i); p > 0) {
        part[i] += p * (std::log(p) + std::log1p(d[j]));
        mass[i] += p;
      }
    }
  });
  return part.sum() + mass.sum() * std::log(weight.sum());
}

TsneMap tsne(const Eigen::MatrixXd& features, const TsneOptions& options) {
  const Eigen::Index n = features.rows();
  if (!(options.perplexity > 1)) refuse_usage(fmt::format("a perplexity of {}, expected more than 1", options.perplexity));
  if (options.iterations < 1 || options.exaggerated < 0) refuse_usage(fmt::format("{} iterations, {} of them exaggerated, expected at least one", options.iterations, options.exaggerated));
  if (!(options.exaggeration >= 1) || !(options.learning_rate >= 0)) refuse_usage(fmt::format("an exaggeration of {} and a learning rate of {}, expected at least 1 and 0", options.exaggeration, options.learning_rate));
  if (n < 3) refuse({}, fmt::format("{} clips, expected at least 3 for a map", n));
  if (static_cast<double>(n - 1) < 3 * options.perplexity) {
    const double most = std::floor(static_cast<double>(n - 1) / 3 * 10) / 10;
    refuse({}, fmt::format("{} clips with a perplexity of {}, expected at least {:.0f} clips (three times the perplexity, and one)", n, options.perplexity, std::ceil(3 * options.perplexity) + 1),
           most > 1 ? fmt::format("a perplexity of at most {} goes with so few", most) : "so few have no map by t-SNE; a principal map takes 3 clips");
  }
  if (n > kTsneMost) refuse({}, fmt::format("{} clips, expected at most {} for exact t-SNE", n, kTsneMost), "motion-select takes some of them; a principal map has no such limit");
  check_finite(features);
  if ((features.rowwise() - features.row(0)).isZero(0)) refuse({}, fmt::format("all {} clips have the same features, expected at least two that differ", n));
  // Distances are squared: features are brought to a size that no square leaves the range of a double.
  const double size = (features.rowwise() - features.row(0)).cwiseAbs().maxCoeff();
  if (!std::isfinite(size)) refuse({}, "features that differ by more than a double can hold, expected less");
  const Eigen::MatrixXd scaled = (features.rowwise() - features.row(0)) / size;

  const Eigen::MatrixXd columns = scaled.transpose();
  Eigen::MatrixXd joint(n, n);
  Vector entropies(n);
  for_rows(n, options.threads, [&](Eigen::Index i) { joint.col(i) = conditional_row(distances_from(columns, i), i, options.perplexity, &entropies[i]); });
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j <= i; ++j) joint(i, j) = joint(j, i) = (joint(i, j) + joint(j, i)) / (2 * static_cast<double>(n));

  TsneMap map;
  map.perplexity = std::exp(entropies.mean());
  map.learning_rate = options.learning_rate > 0 ? options.learning_rate : std::max(static_cast<double>(n) / options.exaggeration / 4, 50.0);
  map.points = start(scaled, options);
  Eigen::MatrixXd step = Eigen::MatrixXd::Zero(n, 2), gain = Eigen::MatrixXd::Ones(n, 2);
  for (int t = 0; t < options.iterations; ++t) {
    const bool early = t < options.exaggerated;
    const Eigen::MatrixXd g = tsne_gradient(joint, map.points, early ? options.exaggeration : 1, options.threads);
    for (Eigen::Index k = 0; k < 2; ++k)
      for (Eigen::Index i = 0; i < n; ++i) {
        gain(i, k) = step(i, k) * g(i, k) < 0 ? gain(i, k) + 0.2 : std::max(0.01, gain(i, k) * 0.8);
        step(i, k) = (early ? 0.5 : 0.8) * step(i, k) - map.learning_rate * gain(i, k) * g(i, k);
      }
    map.points += step;
    if (!map.points.allFinite()) refuse({}, fmt::format("the map runs away in iteration {} at a learning rate of {}, expected a smaller rate", t + 1, map.learning_rate));
    if (options.progress) options.progress(t + 1);
  }
  map.points.rowwise() -= map.points.colwise().mean();
  map.divergence = tsne_divergence(joint, map.points, options.threads);
  return map;
}

double trustworthiness(const Eigen::MatrixXd& features, const Eigen::MatrixXd& points, int k, int threads) {
  const Eigen::Index n = features.rows();
  if (points.rows() != n) refuse({}, fmt::format("a map of {} clips, expected {} as there are features", points.rows(), n));
  if (k < 1 || 2 * k >= n) refuse({}, fmt::format("{} neighbours of {} clips, expected at least 1 and fewer than half of the clips", k, n));
  const Eigen::MatrixXd columns = features.transpose(), places = points.transpose();
  const auto order_from = [&](const Eigen::MatrixXd& x, Eigen::Index i) {
    const Vector d = distances_from(x, i);
    std::vector<Eigen::Index> order;
    for (Eigen::Index j = 0; j < n; ++j)
      if (j != i) order.push_back(j);
    std::stable_sort(order.begin(), order.end(), [&](Eigen::Index a, Eigen::Index b) { return d[a] < d[b]; });
    return order;
  };
  Vector penalty = Vector::Zero(n);
  for_rows(n, threads, [&](Eigen::Index i) {
    const auto there = order_from(columns, i), here = order_from(places, i);
    std::vector<double> rank(static_cast<std::size_t>(n));
    for (std::size_t r = 0; r < there.size(); ++r) rank[static_cast<std::size_t>(there[r])] = static_cast<double>(r + 1);
    for (int m = 0; m < k; ++m) penalty[i] += std::max(0.0, rank[static_cast<std::size_t>(here[static_cast<std::size_t>(m)])] - k);
  });
  const double size = static_cast<double>(n);
  return 1 - 2 / (size * k * (2 * size - 3 * k - 1)) * penalty.sum();
}

}  // namespace mocap::metrics
