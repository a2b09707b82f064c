#include "libmodels/cae_vae/latent_prior.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "libmocap/base/error.hpp"

namespace mocap::cae_vae {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kIterations = 100, kMostComponents = 1024;
constexpr Index kLeastWindows = 10;  // a component
constexpr double kLeastVariance = 1e-4, kSettled = 1e-5;

double log_density(const VectorXd& z, const VectorXd& mean, const MatrixXd& root) {
  const VectorXd u = root.triangularView<Eigen::Lower>().solve(z - mean);
  return -0.5 * (u.squaredNorm() + static_cast<double>(z.size()) * std::log(2 * std::numbers::pi)) - root.diagonal().array().log().sum();
}

// (K, N) of log w_k N(z_n | k), and the log of their sum for each n.
std::pair<MatrixXd, VectorXd> joint(const LatentPrior& p, const MatrixXd& z) {
  MatrixXd log_joint(p.components(), z.cols());
  VectorXd total(z.cols());
  for (Index n = 0; n < z.cols(); ++n) {
    for (Index k = 0; k < p.components(); ++k) log_joint(k, n) = std::log(p.weight[k]) + log_density(z.col(n), p.mean.col(k), p.root[static_cast<std::size_t>(k)]);
    const double most = log_joint.col(n).maxCoeff();
    total[n] = most + std::log((log_joint.col(n).array() - most).exp().sum());
  }
  return {std::move(log_joint), std::move(total)};
}

// Mean, covariance and weight of every component from responsibilities (K, N).
void maximise(LatentPrior& p, const MatrixXd& r, const MatrixXd& means, const MatrixXd& variances) {
  const Index latent = means.rows();
  for (Index k = 0; k < p.components(); ++k) {
    const double sum = std::max(r.row(k).sum(), 1e-12);
    p.weight[k] = sum / static_cast<double>(means.cols());
    const VectorXd mean = means * r.row(k).transpose() / sum;
    const MatrixXd apart = means.colwise() - mean;
    MatrixXd covariance = apart * r.row(k).transpose().asDiagonal() * apart.transpose() / sum;
    covariance.diagonal() += variances * r.row(k).transpose() / sum + VectorXd::Constant(latent, kLeastVariance);
    p.mean.col(k) = mean;
    p.root[static_cast<std::size_t>(k)] = covariance.llt().matrixL();
  }
  p.weight /= p.weight.sum();
}

}  // namespace

VectorXd LatentPrior::draw(Random& random, double scale) const {
  double u = random.uniform();
  Index k = 0;
  while (k + 1 < components() && u >= weight[k]) u -= weight[k++];
  VectorXd e(mean.rows());
  for (double& v : e) v = random.normal();
  return mean.col(k) + VectorXd(root[static_cast<std::size_t>(k)].triangularView<Eigen::Lower>() * e) * scale;
}

double LatentPrior::log_likelihood(const MatrixXd& z) const { return joint(*this, z).second.mean(); }

LatentPrior fit_latent_prior(const MatrixXd& means, const MatrixXd& variances, int components, std::uint64_t seed) {
  const Index n = means.cols(), latent = means.rows(), k = std::clamp<Index>(n / kLeastWindows, 1, components);
  if (n == 0 || variances.rows() != latent || variances.cols() != n) throw Error(Exit::internal, {}, "a latent prior of no windows");
  LatentPrior p{VectorXd::Constant(k, 1.0 / static_cast<double>(k)), MatrixXd(latent, k), std::vector<MatrixXd>(static_cast<std::size_t>(k))};
  // Centres far apart (k-means++), each window first with its nearest.
  Random random(seed, stream_of(0x9e37, 1));
  VectorXd nearest = VectorXd::Constant(n, std::numeric_limits<double>::infinity());
  MatrixXd r = MatrixXd::Zero(k, n);
  std::vector<Index> owner(static_cast<std::size_t>(n), 0);
  for (Index c = 0; c < k; ++c) {
    Index chosen = static_cast<Index>(random.below(static_cast<std::uint64_t>(n)));
    if (c > 0 && nearest.sum() > 0) {
      double u = random.uniform() * nearest.sum();
      for (chosen = 0; chosen + 1 < n && u >= nearest[chosen]; ++chosen) u -= nearest[chosen];
    }
    for (Index i = 0; i < n; ++i)
      if (const double d = (means.col(i) - means.col(chosen)).squaredNorm(); d < nearest[i]) nearest[i] = d, owner[static_cast<std::size_t>(i)] = c;
  }
  for (Index i = 0; i < n; ++i) r(owner[static_cast<std::size_t>(i)], i) = 1;
  maximise(p, r, means, variances);
  double before = -std::numeric_limits<double>::infinity();
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    const auto [log_joint, total] = joint(p, means);
    r = (log_joint.rowwise() - total.transpose()).array().exp();
    maximise(p, r, means, variances);
    if (total.mean() - before < kSettled) break;
    before = total.mean();
  }
  return p;
}

std::map<std::string, store::Tensor> stored(const LatentPrior& p) {
  const std::int64_t k = p.components(), latent = p.mean.rows();
  std::map<std::string, store::Tensor> out;
  store::Tensor &weight = out["prior/weight"], &mean = out["prior/mean"], &root = out["prior/root"];
  weight.shape = {k};
  mean.shape = {k, latent};
  root.shape = {k, latent, latent};
  for (Index c = 0; c < k; ++c) {
    weight.values.push_back(static_cast<float>(p.weight[c]));
    for (Index i = 0; i < latent; ++i) mean.values.push_back(static_cast<float>(p.mean(i, c)));
    for (Index i = 0; i < latent; ++i)
      for (Index j = 0; j < latent; ++j) root.values.push_back(static_cast<float>(p.root[static_cast<std::size_t>(c)](i, j)));
  }
  return out;
}

LatentPrior take_latent_prior(std::map<std::string, store::Tensor>& weights, int latent, const std::string& file) {
  const auto take = [&](const std::string& part, const std::vector<std::int64_t>& shape) {
    const auto found = weights.find("prior/" + part);
    if (found == weights.end() || found->second.shape != shape) refuse({file, 0, "weights/prior/" + part}, fmt::format("absent or of another shape, expected {}", fmt::join(shape, " x ")));
    for (const float v : found->second.values)
      if (!std::isfinite(v)) refuse({file, 0, "weights/prior/" + part}, "a value that is not finite");
    std::vector<float> values = std::move(found->second.values);
    weights.erase(found);
    return values;
  };
  const auto first = weights.find("prior/weight");
  const std::int64_t k = first == weights.end() || first->second.shape.size() != 1 ? 1 : std::clamp<std::int64_t>(first->second.shape[0], 1, kMostComponents);
  const std::vector<float> w = take("weight", {k}), m = take("mean", {k, latent}), r = take("root", {k, latent, latent});
  LatentPrior p{VectorXd(k), MatrixXd(latent, k), std::vector<MatrixXd>(static_cast<std::size_t>(k), MatrixXd(latent, latent))};
  std::size_t im = 0, ir = 0;
  for (Index c = 0; c < k; ++c) {
    p.weight[c] = w[static_cast<std::size_t>(c)];
    for (Index i = 0; i < latent; ++i) p.mean(i, c) = m[im++];
    MatrixXd& root = p.root[static_cast<std::size_t>(c)];
    for (Index i = 0; i < latent; ++i)
      for (Index j = 0; j < latent; ++j) root(i, j) = r[ir++];
    if (!(root.diagonal().array() > 0).all()) refuse({file, 0, "weights/prior/root"}, "a deviation of 0 or less, expected numbers above 0");
  }
  if (!((p.weight.array() >= 0).all() && std::abs(p.weight.sum() - 1) < 1e-3)) refuse({file, 0, "weights/prior/weight"}, fmt::format("weights that add up to {}, expected 1", p.weight.sum()));
  p.weight /= p.weight.sum();
  return p;
}

}  // namespace mocap::cae_vae
