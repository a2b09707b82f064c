#include "libmocap/metrics/frechet.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>

#include "libmocap/base/error.hpp"
#include "libmocap/base/parallel.hpp"
#include "libmocap/metrics/linear_algebra.hpp"

namespace mocap::metrics {
namespace {

void check_finite(const Eigen::MatrixXd& x, const std::string& what) {
  if (x.allFinite()) return;
  for (Eigen::Index i = 0; i < x.rows(); ++i)
    for (Eigen::Index j = 0; j < x.cols(); ++j)
      if (!std::isfinite(x(i, j))) refuse({}, fmt::format("{}: row {}, column {} is {}, expected finite numbers", what, i + 1, j + 1, std::isnan(x(i, j)) ? "nan" : "infinite"));
}

void check_pair(const Gaussian& a, const Gaussian& b) {
  const auto d = a.mean.size();
  if (b.mean.size() != d) refuse({}, fmt::format("features of {} and of {} numbers, expected as many in both sets", d, b.mean.size()));
  for (const Gaussian* g : {&a, &b}) {
    if (g->covariance.rows() != d || g->covariance.cols() != d)
      refuse({}, fmt::format("a covariance of {} x {}, expected {} x {}", g->covariance.rows(), g->covariance.cols(), d, d));
    if (!g->mean.allFinite() || !g->covariance.allFinite()) refuse({}, "a mean or covariance that is not finite, expected finite numbers");
    if (g->n > 0 && g->n <= d)
      refuse({}, fmt::format("{} clips with {} features, expected more clips than features", g->n, d),
             "a covariance of so few clips is singular; take more clips, or fewer features by a PCA fitted on training clips (--pca K --train)");
  }
}

// As SciPy's sqrtm: a = U T U^H, the root of T column by column. Where two eigenvalues are 0 and what they would divide is not, it
// gives up (not a number): LAPACK finds exact zeros for columns that never vary, so this is common, not an accident.
Eigen::MatrixXcd schur_root(const Eigen::MatrixXd& a) {
  const auto [t, u] = schur(a);
  const Eigen::Index n = a.rows();
  Eigen::MatrixXcd r = Eigen::MatrixXcd::Zero(n, n);
  for (Eigen::Index j = 0; j < n; ++j) {
    r(j, j) = std::sqrt(t(j, j));
    for (Eigen::Index i = j - 1; i >= 0; --i) {
      std::complex<double> sum = t(i, j);
      for (Eigen::Index k = i + 1; k < j; ++k) sum -= r(i, k) * r(k, j);
      const std::complex<double> below = r(i, i) + r(j, j);
      r(i, j) = below != 0.0 ? sum / below : sum == 0.0 ? 0.0 : std::numeric_limits<double>::quiet_NaN();
    }
  }
  return u * r * u.adjoint();
}

Eigen::VectorXf float_mean(const Eigen::MatrixXd& x) {
  Eigen::VectorXf sum = Eigen::VectorXf::Zero(x.cols());
  for (Eigen::Index i = 0; i < x.rows(); ++i) sum += x.row(i).transpose().cast<float>();
  return sum / static_cast<float>(x.rows());
}

bool is_float(const Eigen::MatrixXd& x) { return (x.cast<float>().cast<double>().array() == x.array()).all(); }

}  // namespace

Gaussian gaussian(const Eigen::MatrixXd& features, const std::string& what) {
  if (features.rows() < 2) refuse({}, fmt::format("{}: {} clips, expected at least two", what, features.rows()));
  check_finite(features, what);
  Gaussian g;
  g.n = static_cast<long>(features.rows());
  g.mean = features.colwise().mean().transpose();
  g.covariance = gram(features.rowwise() - g.mean.transpose()) / static_cast<double>(g.n - 1);
  return g;
}

Gaussian gaussian(const Eigen::MatrixXd& features, const std::vector<int>& counts) {
  if (counts.size() != static_cast<std::size_t>(features.rows())) refuse({}, fmt::format("{} counts for {} clips, expected as many", counts.size(), features.rows()));
  const Eigen::VectorXd weight = Eigen::Map<const Eigen::VectorXi>(counts.data(), features.rows()).cast<double>();
  Gaussian g;
  g.n = static_cast<long>(weight.sum());
  if (g.n < 2) refuse({}, fmt::format("{} clips, expected at least two", g.n));
  g.mean = features.transpose() * weight / weight.sum();
  g.covariance = gram(weight.cwiseSqrt().asDiagonal() * (features.rowwise() - g.mean.transpose())) / static_cast<double>(g.n - 1);
  return g;
}

double frechet_distance(const Gaussian& a, const Gaussian& b) {
  check_pair(a, b);
  const auto distance = [&](const Eigen::VectorXd& squares) {
    return std::max(0.0, (a.mean - b.mean).squaredNorm() + a.covariance.trace() + b.covariance.trace() - 2 * squares.cwiseMax(0.0).cwiseSqrt().sum());
  };
  if (const Eigen::VectorXd values = product_eigenvalues(a.covariance, b.covariance); values.size() > 0) return distance(values);
  // A column that never varies: no Cholesky factor, but a root.
  const SymmetricEigen e = symmetric_eigen(a.covariance, true);
  const Eigen::VectorXd root1 = e.values.cwiseMax(0.0).cwiseSqrt();
  // With S1^1/2 = V D V^T the eigenvalues of D (V^T S2 V) D are those of S1^1/2 S2 S1^1/2, for one product fewer.
  Eigen::MatrixXd m = product(Eigen::MatrixXd(e.vectors.transpose()), product(b.covariance, e.vectors));
  m = root1.asDiagonal() * m * root1.asDiagonal();
  m = (m + m.transpose().eval()) / 2;
  return distance(symmetric_eigen(m, false).values);
}

double frechet_distance(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b, int threads) {
  Gaussian g[2];
  use_one_blas_thread();
  parallel_for(2, threads, [&](std::size_t i) { g[i] = gaussian(i == 0 ? a : b); });
  return frechet_distance(g[0], g[1]);
}

Pca fit_pca(const Eigen::MatrixXd& features, int k) {
  const Gaussian g = gaussian(features, "features of the training clips");
  const auto d = features.cols();
  if (k < 1 || k > d || k >= features.rows()) refuse({}, fmt::format("{} principal axes of {} clips with {} features, expected at most {}", k, features.rows(), d, std::min(d, features.rows() - 1)));
  const SymmetricEigen e = symmetric_eigen(g.covariance, true);
  Pca out;
  out.mean = g.mean;
  out.axes = e.vectors.rightCols(k).rowwise().reverse();
  out.variance = e.values.tail(k).reverse().cwiseMax(0.0);
  for (Eigen::Index c = 0; c < k; ++c) {
    Eigen::Index at = 0;
    out.axes.col(c).cwiseAbs().maxCoeff(&at);
    if (out.axes(at, c) < 0) out.axes.col(c) *= -1;
  }
  const double whole = e.values.cwiseMax(0.0).sum();
  out.kept = whole > 0 ? out.variance.sum() / whole : 1;
  return out;
}

Eigen::MatrixXd project(const Pca& pca, const Eigen::MatrixXd& features) {
  if (features.cols() != pca.mean.size()) refuse({}, fmt::format("features of {} numbers, expected {} as the PCA was fitted on", features.cols(), pca.mean.size()));
  return product(features.rowwise() - pca.mean.transpose(), pca.axes);
}

Compat parse_compat(const std::string& name) {
  if (name == "none") return Compat::none;
  if (name == "pytorch-fid") return Compat::pytorch_fid;
  if (name == "clean-fid") return Compat::clean_fid;
  if (name == "torch-fidelity") return Compat::torch_fidelity;
  if (name == "a2m") return Compat::a2m;
  if (name == "actor") return Compat::actor;
  refuse_usage("--compat '" + name + "', expected none, pytorch-fid, clean-fid, torch-fidelity, a2m or actor");
}

double frechet_distance_compat(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b, Compat formula) {
  Gaussian x = gaussian(a), y = gaussian(b);
  if (formula == Compat::none) return frechet_distance(x, y);
  x.n = y.n = 0;
  check_pair(x, y);
  double between = (x.mean - y.mean).squaredNorm();
  if (formula != Compat::pytorch_fid && is_float(a) && is_float(b)) between = (float_mean(a) - float_mean(b)).squaredNorm();
  double root = 0;
  if (formula == Compat::torch_fidelity) {
    const Eigen::EigenSolver<Eigen::MatrixXd> solver(product(x.covariance, y.covariance), false);
    for (const auto& value : solver.eigenvalues()) root += std::sqrt(std::complex<double>(value)).real();
  } else {
    Eigen::MatrixXcd r = schur_root(product(x.covariance, y.covariance));
    if (!r.allFinite()) {
      const Eigen::MatrixXd offset = 1e-6 * Eigen::MatrixXd::Identity(x.covariance.rows(), x.covariance.rows());
      r = schur_root(product(x.covariance + offset, y.covariance + offset));
    }
    const double imaginary = r.diagonal().imag().cwiseAbs().maxCoeff();
    if (formula != Compat::clean_fid && !(imaginary <= 1e-3)) refuse({}, fmt::format("imaginary component {} in the root of S1 S2, expected at most 0.001 (--compat)", imaginary));
    root = r.trace().real();
  }
  return between + x.covariance.trace() + y.covariance.trace() - 2 * root;
}

}  // namespace mocap::metrics
