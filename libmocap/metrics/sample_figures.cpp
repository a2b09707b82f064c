#include "libmocap/metrics/sample_figures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "libmocap/base/error.hpp"
#include "libmocap/base/parallel.hpp"
#include "libmocap/base/random.hpp"
#include "libmocap/metrics/linear_algebra.hpp"
#include "libmocap/metrics/numpy_random.hpp"

namespace mocap::metrics {
namespace {

// Streams of one seed, so that no two figures draw the same numbers.
enum Stream : std::uint64_t { kSplits = 0x1501, kSubsets, kPairs, kModes };

void check_features(const Eigen::MatrixXd& x, Eigen::Index least) {
  if (x.rows() < least) refuse({}, fmt::format("{} clips, expected at least {}", x.rows(), least));
  for (Eigen::Index j = 0; j < x.cols(); ++j)
    for (Eigen::Index i = 0; i < x.rows(); ++i)
      if (!std::isfinite(x(i, j))) refuse({}, fmt::format("features: row {}, column {} is not finite, expected finite numbers", i + 1, j + 1));
}

void check_posteriors(const Eigen::MatrixXd& p) {
  if (p.cols() < 2) refuse({}, fmt::format("posteriors over {} classes, expected at least two", p.cols()));
  if (p.rows() < 1) refuse({}, "0 clips, expected at least one");
  for (Eigen::Index i = 0; i < p.rows(); ++i) {
    const double sum = p.row(i).sum();
    if (!(std::abs(sum - 1) <= 1e-6) || p.row(i).minCoeff() < 0) refuse({}, fmt::format("posteriors: row {} sums to {:.6g}, expected a distribution", i + 1, sum));
  }
}

std::vector<std::size_t> shuffled(std::size_t n, std::size_t first, Random& random) {  // the first of a permutation of n
  std::vector<std::size_t> p(n);
  std::iota(p.begin(), p.end(), std::size_t{0});
  for (std::size_t i = 0; i < std::min(first, n); ++i) std::swap(p[i], p[i + random.below(n - i)]);
  p.resize(std::min(first, n));
  return p;
}

Eigen::MatrixXd rows_of(const Eigen::MatrixXd& x, const std::vector<std::size_t>& rows) {
  Eigen::MatrixXd out(static_cast<Eigen::Index>(rows.size()), x.cols());
  for (Eigen::Index j = 0; j < x.cols(); ++j)
    for (std::size_t i = 0; i < rows.size(); ++i) out(static_cast<Eigen::Index>(i), j) = x(static_cast<Eigen::Index>(rows[i]), j);
  return out;
}

MeanDeviation mean_deviation(const std::vector<double>& values) {
  const double n = static_cast<double>(values.size()), mean = std::accumulate(values.begin(), values.end(), 0.0) / n;
  double square = 0;
  for (const double v : values) square += (v - mean) * (v - mean);
  return {mean, std::sqrt(square / n)};
}

MeanDeviation score_of_splits(const Eigen::MatrixXd& p, int splits, const std::vector<std::size_t>& order) {
  const std::size_t n = order.size(), parts = static_cast<std::size_t>(splits);
  std::vector<double> scores;
  for (std::size_t s = 0; s < parts; ++s) {
    const std::size_t begin = s * n / parts, end = (s + 1) * n / parts;
    const Eigen::MatrixXd part = rows_of(p, {order.begin() + static_cast<std::ptrdiff_t>(begin), order.begin() + static_cast<std::ptrdiff_t>(end)});
    const Eigen::VectorXd marginal = part.colwise().mean();
    double sum = 0;
    for (Eigen::Index c = 0; c < part.cols(); ++c)
      for (Eigen::Index i = 0; i < part.rows(); ++i)
        if (part(i, c) > 0) sum += part(i, c) * (std::log(part(i, c)) - std::log(marginal[c]));
    scores.push_back(std::exp(sum / static_cast<double>(part.rows())));
  }
  return mean_deviation(scores);
}

void check_splits(const Eigen::MatrixXd& p, int splits) {
  check_posteriors(p);
  if (splits < 1 || p.rows() < splits) refuse({}, fmt::format("{} clips for {} splits, expected at least one for each", p.rows(), splits));
}

double kernel_sum(const Eigen::MatrixXd& x, const Eigen::MatrixXd& y, bool same) {
  const Eigen::MatrixXd k = ((product_transposed(x, y) / static_cast<double>(x.cols())).array() + 1).cube();
  return same ? k.sum() - k.diagonal().sum() : k.sum();
}

constexpr Eigen::Index kBlock = 256;  // rows of a distance block; part of the result's last bits, hence no option

// Squared distances of rows first .. of x to all rows of y.
Eigen::MatrixXd squared_distances(const Eigen::MatrixXd& x, Eigen::Index first, const Eigen::MatrixXd& y, const Eigen::VectorXd& y_norm) {
  const Eigen::MatrixXd part = x.middleRows(first, std::min(kBlock, x.rows() - first));
  Eigen::MatrixXd d = -2 * product_transposed(y, part);  // [M, block]: a column is one row's distances, contiguous
  d.colwise() += y_norm;
  d.rowwise() += part.rowwise().squaredNorm().transpose();
  return d.cwiseMax(0.0);
}

Eigen::VectorXd kth_neighbour(const Eigen::MatrixXd& x, const Eigen::VectorXd& norm, int k, int threads) {
  Eigen::VectorXd radius(x.rows());
  parallel_for(static_cast<std::size_t>((x.rows() + kBlock - 1) / kBlock), threads, [&](std::size_t b) {
    const Eigen::Index first = static_cast<Eigen::Index>(b) * kBlock;
    Eigen::MatrixXd d = squared_distances(x, first, x, norm);
    for (Eigen::Index i = 0; i < d.cols(); ++i) {
      d(first + i, i) = -1;  // itself comes first, whatever rounding left of its 0
      double* column = d.col(i).data();
      std::nth_element(column, column + k, column + d.rows());
      radius[first + i] = column[k];
    }
  });
  return radius;
}

double covered_share(const Eigen::MatrixXd& x, const Eigen::MatrixXd& y, const Eigen::VectorXd& y_norm, const Eigen::VectorXd& y_radius, int threads) {
  const auto blocks = static_cast<std::size_t>((x.rows() + kBlock - 1) / kBlock);
  std::vector<Eigen::Index> covered(blocks, 0);
  parallel_for(blocks, threads, [&](std::size_t b) {
    const Eigen::MatrixXd d = squared_distances(x, static_cast<Eigen::Index>(b) * kBlock, y, y_norm);
    for (Eigen::Index i = 0; i < d.cols(); ++i) covered[b] += (d.col(i).array() <= y_radius.array()).any();
  });
  return static_cast<double>(std::accumulate(covered.begin(), covered.end(), Eigen::Index{0})) / static_cast<double>(x.rows());
}

std::vector<std::vector<std::size_t>> rows_by_class(const Eigen::MatrixXd& x, const std::vector<int>& labels, const std::vector<std::string>& classes, std::size_t least) {
  if (labels.size() != static_cast<std::size_t>(x.rows())) refuse({}, fmt::format("{} labels for {} clips, expected as many", labels.size(), x.rows()));
  std::vector<std::vector<std::size_t>> rows(classes.size());
  for (std::size_t i = 0; i < labels.size(); ++i) {
    if (labels[i] >= static_cast<int>(classes.size())) refuse({}, fmt::format("label {}, expected one of {} classes", labels[i], classes.size()));
    if (labels[i] >= 0) rows[static_cast<std::size_t>(labels[i])].push_back(i);
  }
  if (classes.empty()) refuse({}, "no classes, expected at least one");
  for (std::size_t c = 0; c < classes.size(); ++c)
    if (rows[c].size() < least) refuse({}, fmt::format("class {} has {} clips, expected at least {}", classes[c], rows[c].size(), least));
  return rows;
}

double distance(const Eigen::MatrixXd& x, std::size_t a, std::size_t b) { return (x.row(static_cast<Eigen::Index>(a)) - x.row(static_cast<Eigen::Index>(b))).norm(); }

double pair_distance(const Eigen::MatrixXd& x, const std::vector<std::size_t>& rows, int pairs, Random& random) {
  double sum = 0;
  for (int i = 0; i < pairs; ++i) {
    const auto a = random.below(rows.size());
    auto b = random.below(rows.size() - 1);
    b += b >= a;
    sum += distance(x, rows[a], rows[b]);
  }
  return sum / pairs;
}

// Sums of each row's kernel or distance to all others of x.
template <class F>
Eigen::VectorXd sums_by_row(Eigen::Index rows, int threads, F&& block) {
  Eigen::VectorXd out(rows);
  parallel_for(static_cast<std::size_t>((rows + kBlock - 1) / kBlock), threads, [&](std::size_t b) {
    const Eigen::Index first = static_cast<Eigen::Index>(b) * kBlock;
    const Eigen::VectorXd sums = block(first, std::min(kBlock, rows - first));
    out.segment(first, sums.size()) = sums;
  });
  return out;
}

double jackknife_variance(const Eigen::VectorXd& without) {
  const double n = static_cast<double>(without.size());
  return (n - 1) / n * (without.array() - without.mean()).square().sum();
}

// Of the mean of `pairs` random distances among the rows of x: of the clips drawn, and of the pairs.
double pair_variance(const Eigen::MatrixXd& features, int pairs, int threads) {
  const double n = static_cast<double>(features.rows());
  const Eigen::MatrixXd x = features.rowwise() - features.colwise().mean();
  const Eigen::VectorXd norm = x.rowwise().squaredNorm();
  const Eigen::VectorXd row = sums_by_row(x.rows(), threads, [&](Eigen::Index first, Eigen::Index) -> Eigen::VectorXd {
    Eigen::MatrixXd d = squared_distances(x, first, x, norm);
    for (Eigen::Index i = 0; i < d.cols(); ++i) d(first + i, i) = 0;  // itself, whatever rounding left
    return d.cwiseSqrt().colwise().sum().transpose();
  });
  const double mean = row.sum() / (n * (n - 1)), square = 2 * norm.sum() / (n - 1);
  return jackknife_variance((row.sum() - 2 * row.array()) / ((n - 1) * (n - 2))) + std::max(0.0, square - mean * mean) / pairs;
}

Interval about(double value, double variance, long n, long freedom) {
  const double half = freedom < 1 ? std::numeric_limits<double>::quiet_NaN() : t_quantile(0.975, static_cast<double>(freedom)) * std::sqrt(variance);
  return {value, value - half, value + half, n};
}

// The variance of a mean over the classes, from that of each class.
template <class F>
Interval about_classes(double value, const Eigen::MatrixXd& features, const std::vector<int>& labels, const std::vector<std::string>& classes, F&& variance_of) {
  check_features(features, 1);
  double variance = 0;
  long n = 0;
  bool enough = true;
  for (const auto& rows : rows_by_class(features, labels, classes, 2)) {
    n += static_cast<long>(rows.size());
    enough = enough && rows.size() > 2;
    if (enough) variance += variance_of(rows_of(features, rows));
  }
  const auto count = static_cast<double>(classes.size());
  Interval out = about(value, variance / (count * count), n, enough ? n - static_cast<long>(classes.size()) : 0);
  out.low = std::isnan(out.low) ? out.low : std::max(0.0, out.low);
  return out;
}

}  // namespace

MeanDeviation inception_score(const Eigen::MatrixXd& posteriors, int splits, std::uint64_t seed) {
  check_splits(posteriors, splits);
  Random random(seed, kSplits);
  const auto n = static_cast<std::size_t>(posteriors.rows());
  return score_of_splits(posteriors, splits, shuffled(n, n, random));
}

MeanDeviation inception_score_torch_fidelity(const Eigen::MatrixXd& posteriors, int splits, std::uint32_t seed) {
  check_splits(posteriors, splits);
  return score_of_splits(posteriors, splits, NumpyRandom(seed).permutation(static_cast<std::size_t>(posteriors.rows())));
}

double inception_bound(long classes, long n) {
  if (n % classes == 0) return static_cast<double>(classes);
  const long each = n / classes, more = n % classes;  // `more` classes have one row more
  double entropy = 0;
  for (const auto& [count, how_many] : {std::pair{each, classes - more}, std::pair{each + 1, more}})
    if (count > 0) {
      const double share = static_cast<double>(count) / static_cast<double>(n);
      entropy -= static_cast<double>(how_many) * share * std::log(share);
    }
  return std::exp(entropy);
}

Eigen::MatrixXd joint_posteriors(const std::vector<Eigen::MatrixXd>& attributes) {
  if (attributes.empty()) refuse({}, "posteriors of 0 attributes, expected at least one");
  Eigen::MatrixXd joint = attributes[0];
  for (std::size_t a = 1; a < attributes.size(); ++a) {
    const Eigen::MatrixXd& p = attributes[a];
    if (p.rows() != joint.rows()) refuse({}, fmt::format("posteriors of {} and of {} clips, expected as many", joint.rows(), p.rows()));
    Eigen::MatrixXd next(joint.rows(), joint.cols() * p.cols());
    for (Eigen::Index i = 0; i < joint.cols(); ++i)
      for (Eigen::Index j = 0; j < p.cols(); ++j) next.col(i * p.cols() + j) = joint.col(i).cwiseProduct(p.col(j));
    joint = std::move(next);
  }
  return joint;
}

MeanDeviation kid(const Eigen::MatrixXd& generated, const Eigen::MatrixXd& real, const KidOptions& o) {
  check_features(generated, 2);
  check_features(real, 2);
  if (generated.cols() != real.cols()) refuse({}, fmt::format("features of {} and of {} numbers, expected as many in both sets", generated.cols(), real.cols()));
  const auto n = static_cast<std::size_t>(generated.rows()), m = static_cast<std::size_t>(real.rows()), size = std::min({static_cast<std::size_t>(o.subset), n, m});
  if (size < 2 || o.subsets < 1) refuse({}, fmt::format("{} subsets of {} clips, expected at least one of two", o.subsets, size));
  std::vector<std::pair<std::vector<std::size_t>, std::vector<std::size_t>>> draws(static_cast<std::size_t>(o.subsets));
  NumpyRandom numpy(static_cast<std::uint32_t>(o.seed));
  for (std::size_t s = 0; s < draws.size(); ++s) {
    if (o.numpy_draws) {
      draws[s].first = numpy.permutation(n);
      draws[s].second = numpy.permutation(m);
      draws[s].first.resize(size);
      draws[s].second.resize(size);
    } else {
      Random random(o.seed, stream_of(kSubsets, s));
      draws[s].first = shuffled(n, size, random);
      draws[s].second = shuffled(m, size, random);
    }
  }
  std::vector<double> values(draws.size());
  const double count = static_cast<double>(size);
  use_one_blas_thread();
  parallel_for(draws.size(), o.threads, [&](std::size_t s) {
    const Eigen::MatrixXd x = rows_of(generated, draws[s].first), y = rows_of(real, draws[s].second);
    values[s] = (kernel_sum(x, x, true) + kernel_sum(y, y, true)) / (count * (count - 1)) - 2 * kernel_sum(x, y, false) / (count * count);
  });
  return mean_deviation(values);
}

Standard standard_of(const Eigen::MatrixXd& real) {
  check_features(real, 2);
  Standard out;
  out.mean = real.colwise().mean();
  const Eigen::RowVectorXd deviation = ((real.rowwise() - out.mean).colwise().squaredNorm() / static_cast<double>(real.rows() - 1)).cwiseSqrt();
  const double typical = deviation.norm() / std::sqrt(static_cast<double>(deviation.size()));
  out.scale = typical > 0 ? Eigen::RowVectorXd(deviation.cwiseMax(0.1 * typical)) : Eigen::RowVectorXd::Ones(deviation.size());
  return out;
}

Eigen::MatrixXd Standard::operator()(const Eigen::MatrixXd& features) const {
  if (features.cols() != mean.size()) refuse({}, fmt::format("features of {} and of {} numbers, expected as many in both sets", features.cols(), mean.size()));
  return (features.rowwise() - mean).array().rowwise() / scale.array();
}

PrecisionRecall precision_recall(const Eigen::MatrixXd& generated, const Eigen::MatrixXd& real, int k, int threads) {
  if (k < 1) refuse({}, fmt::format("neighbour {}, expected 1 or more", k));
  check_features(generated, k + 1);
  check_features(real, k + 1);
  if (generated.cols() != real.cols()) refuse({}, fmt::format("features of {} and of {} numbers, expected as many in both sets", generated.cols(), real.cols()));
  use_one_blas_thread();
  // About the real mean: less is lost to cancellation in |x|^2 + |y|^2 - 2 x.y.
  const Eigen::RowVectorXd centre = real.colwise().mean();
  const Eigen::MatrixXd x = generated.rowwise() - centre, y = real.rowwise() - centre;
  const Eigen::VectorXd x_norm = x.rowwise().squaredNorm(), y_norm = y.rowwise().squaredNorm();
  const Eigen::VectorXd x_radius = kth_neighbour(x, x_norm, k, threads), y_radius = kth_neighbour(y, y_norm, k, threads);
  // The rim counts, so rounding must not push a point over it.
  const double slack = 1e-13 * std::max(x_norm.maxCoeff(), y_norm.maxCoeff());
  return {covered_share(x, y, y_norm, y_radius.array() + slack, threads), covered_share(y, x, x_norm, x_radius.array() + slack, threads)};
}

double accuracy(const Eigen::MatrixXd& posteriors, const std::vector<int>& labels, long* counted) {
  check_posteriors(posteriors);
  if (labels.size() != static_cast<std::size_t>(posteriors.rows())) refuse({}, fmt::format("{} labels for {} clips, expected as many", labels.size(), posteriors.rows()));
  long right = 0, all = 0;
  for (Eigen::Index i = 0; i < posteriors.rows(); ++i) {
    const int label = labels[static_cast<std::size_t>(i)];
    if (label >= posteriors.cols()) refuse({}, fmt::format("label {}, expected one of {} classes", label, posteriors.cols()));
    if (label < 0) continue;
    Eigen::Index best = 0;
    posteriors.row(i).maxCoeff(&best);
    right += best == label;
    ++all;
  }
  if (counted) *counted = all;
  if (all == 0) refuse({}, "no clip is labelled, expected at least one");
  return static_cast<double>(right) / static_cast<double>(all);
}

double diversity(const Eigen::MatrixXd& features, int pairs, std::uint64_t seed) {
  check_features(features, 2);
  std::vector<std::size_t> rows(static_cast<std::size_t>(features.rows()));
  std::iota(rows.begin(), rows.end(), std::size_t{0});
  Random random(seed, kPairs);
  return pair_distance(features, rows, pairs, random);
}

double diversity_a2m(const Eigen::MatrixXd& features, int pairs, std::uint32_t seed) {
  check_features(features, 1);
  const auto n = static_cast<std::uint32_t>(features.rows());
  NumpyRandom random(seed);
  std::vector<std::size_t> first, second;
  for (int i = 0; i < pairs; ++i) first.push_back(random.below(n));
  for (int i = 0; i < pairs; ++i) second.push_back(random.below(n));
  double sum = 0;
  for (std::size_t i = 0; i < first.size(); ++i) sum += distance(features, first[i], second[i]);
  return sum / pairs;
}

double within_class_variance(const Eigen::MatrixXd& features, const std::vector<int>& labels, const std::vector<std::string>& classes) {
  check_features(features, 1);
  double sum = 0;
  for (const auto& rows : rows_by_class(features, labels, classes, 2)) {
    const Eigen::MatrixXd x = rows_of(features, rows);
    sum += (x.rowwise() - x.colwise().mean()).squaredNorm() / static_cast<double>(rows.size() - 1);
  }
  return sum / static_cast<double>(classes.size());
}

double multimodality(const Eigen::MatrixXd& features, const std::vector<int>& labels, const std::vector<std::string>& classes, int pairs, std::uint64_t seed) {
  check_features(features, 1);
  double sum = 0;
  std::uint64_t c = 0;
  for (const auto& rows : rows_by_class(features, labels, classes, 2)) {
    Random random(seed, stream_of(kModes, c++));
    sum += pair_distance(features, rows, pairs, random);
  }
  return sum / static_cast<double>(classes.size());
}

double multimodality_a2m(const Eigen::MatrixXd& features, const std::vector<int>& labels, const std::vector<std::string>& classes, int pairs, std::uint32_t seed) {
  check_features(features, 1);
  rows_by_class(features, labels, classes, 1);
  const auto n = static_cast<std::uint32_t>(features.rows());
  NumpyRandom random(seed);
  std::vector<int> left(classes.size(), pairs);
  long open = pairs * static_cast<long>(classes.size());
  double sum = 0;
  while (open > 0) {
    const std::size_t a = random.below(n);
    if (labels[a] < 0 || left[static_cast<std::size_t>(labels[a])] == 0) continue;
    std::size_t b = random.below(n);
    while (labels[b] != labels[a]) b = random.below(n);
    sum += distance(features, a, b);
    --left[static_cast<std::size_t>(labels[a])];
    --open;
  }
  return sum / (pairs * static_cast<double>(classes.size()));
}

Interval kid_interval(const Eigen::MatrixXd& generated, const Eigen::MatrixXd& real, const MeanDeviation& found, const KidOptions& o) {
  check_features(generated, 2);
  check_features(real, 2);
  if (generated.cols() != real.cols()) refuse({}, fmt::format("features of {} and of {} numbers, expected as many in both sets", generated.cols(), real.cols()));
  use_one_blas_thread();
  const double n = static_cast<double>(generated.rows()), d = static_cast<double>(generated.cols());
  Eigen::VectorXd cross(generated.rows());  // mean kernel with the real clips
  const Eigen::VectorXd own = sums_by_row(generated.rows(), o.threads, [&](Eigen::Index first, Eigen::Index count) -> Eigen::VectorXd {
    const Eigen::MatrixXd part = generated.middleRows(first, count);
    const auto kernel = [&](const Eigen::MatrixXd& with) { return Eigen::MatrixXd(((product_transposed(with, part) / d).array() + 1).cube()); };
    cross.segment(first, count) = kernel(real).colwise().mean().transpose();
    const Eigen::MatrixXd k = kernel(generated);
    Eigen::VectorXd sums = k.colwise().sum().transpose();
    for (Eigen::Index i = 0; i < count; ++i) sums[i] -= k(first + i, i);
    return sums;
  });
  if (generated.rows() < 3) return about(found.mean, 0, generated.rows(), 0);
  const double variance = jackknife_variance((own.sum() - 2 * own.array()) / ((n - 1) * (n - 2)) - 2 * (cross.sum() - cross.array()) / (n - 1));
  return about(found.mean, variance + found.deviation * found.deviation / o.subsets, generated.rows(), generated.rows() - 1);
}

Interval diversity_interval(double value, const Eigen::MatrixXd& features, int pairs, int threads) {
  check_features(features, 2);
  if (features.rows() < 3) return about(value, 0, features.rows(), 0);
  Interval out = about(value, pair_variance(features, pairs, threads), features.rows(), features.rows() - 1);
  out.low = std::max(0.0, out.low);
  return out;
}

Interval within_class_variance_interval(double value, const Eigen::MatrixXd& features, const std::vector<int>& labels, const std::vector<std::string>& classes) {
  return about_classes(value, features, labels, classes, [](const Eigen::MatrixXd& x) {
    const double n = static_cast<double>(x.rows());
    const Eigen::ArrayXd square = (x.rowwise() - x.colwise().mean()).rowwise().squaredNorm();
    return jackknife_variance((square.sum() - n / (n - 1) * square) / (n - 2));
  });
}

Interval multimodality_interval(double value, const Eigen::MatrixXd& features, const std::vector<int>& labels, const std::vector<std::string>& classes, int pairs, int threads) {
  return about_classes(value, features, labels, classes, [&](const Eigen::MatrixXd& x) { return pair_variance(x, pairs, threads); });
}

}  // namespace mocap::metrics
