#include "libmocap/metrics/linear_algebra.hpp"

#include <dlfcn.h>

#include <complex>
#include <limits>
#include <string>
#include <vector>

#include "libmocap/base/error.hpp"

extern "C" {
void dsyrk_(const char*, const char*, const int*, const int*, const double*, const double*, const int*, const double*, double*, const int*);
void dgemm_(const char*, const char*, const int*, const int*, const int*, const double*, const double*, const int*, const double*, const int*, const double*, double*, const int*);
void sgemm_(const char*, const char*, const int*, const int*, const int*, const float*, const float*, const int*, const float*, const int*, const float*, float*, const int*);
void dsyevd_(const char*, const char*, const int*, double*, const int*, double*, double*, const int*, int*, const int*, int*);
void dpotrf_(const char*, const int*, double*, const int*, int*);
void dsygst_(const int*, const char*, const int*, double*, const int*, const double*, const int*, int*);
void dgees_(const char*, const char*, int (*)(const double*, const double*), const int*, double*, const int*, int*, double*, double*, double*, const int*, double*, const int*, int*, int*);
void zgees_(const char*, const char*, int (*)(const std::complex<double>*), const int*, std::complex<double>*, const int*, int*, std::complex<double>*, std::complex<double>*, const int*,
            std::complex<double>*, const int*, double*, int*, int*);
}

namespace mocap::metrics {
namespace {

int size_of(Eigen::Index n) { return static_cast<int>(n); }

Eigen::MatrixXd multiply(char transpose_b, const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  const int m = size_of(a.rows()), k = size_of(a.cols()), n = size_of(transpose_b == 'T' ? b.rows() : b.cols());
  Eigen::MatrixXd c(m, n);
  if (m == 0 || n == 0 || k == 0) return Eigen::MatrixXd::Zero(m, n);
  const double one = 1, zero = 0;
  const int lda = m, ldb = size_of(b.rows());
  dgemm_("N", &transpose_b, &m, &n, &k, &one, a.data(), &lda, b.data(), &ldb, &zero, c.data(), &m);
  return c;
}

}  // namespace

void use_one_blas_thread() {
  static const bool done = [] {
    if (auto* set = reinterpret_cast<void (*)(int)>(dlsym(RTLD_DEFAULT, "openblas_set_num_threads"))) set(1);
    return true;
  }();
  (void)done;
}

Eigen::MatrixXd gram(const Eigen::MatrixXd& x) {
  use_one_blas_thread();
  const int n = size_of(x.cols()), k = size_of(x.rows());
  Eigen::MatrixXd c = Eigen::MatrixXd::Zero(n, n);
  if (n == 0 || k == 0) return c;
  const double one = 1, zero = 0;
  dsyrk_("U", "T", &n, &k, &one, x.data(), &k, &zero, c.data(), &n);
  c.triangularView<Eigen::StrictlyLower>() = c.transpose();
  return c;
}

Eigen::MatrixXd product(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  use_one_blas_thread();
  return multiply('N', a, b);
}

Eigen::MatrixXd product_transposed(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  use_one_blas_thread();
  return multiply('T', a, b);
}

Eigen::MatrixXf product_transposed(const Eigen::MatrixXf& a, const Eigen::MatrixXf& b) {
  use_one_blas_thread();
  const int m = size_of(a.rows()), k = size_of(a.cols()), n = size_of(b.rows());
  if (m == 0 || n == 0 || k == 0) return Eigen::MatrixXf::Zero(m, n);
  Eigen::MatrixXf c(m, n);
  const float one = 1, zero = 0;
  sgemm_("N", "T", &m, &n, &k, &one, a.data(), &m, b.data(), &n, &zero, c.data(), &m);
  return c;
}

SymmetricEigen symmetric_eigen(const Eigen::MatrixXd& a, bool vectors) {
  use_one_blas_thread();
  SymmetricEigen out;
  const int n = size_of(a.rows());
  out.values.resize(n);
  out.vectors = a;
  if (n == 0) return out;
  double wanted = 0;
  int wanted_int = 0, info = 0;
  const int query = -1;
  const char* job = vectors ? "V" : "N";
  dsyevd_(job, "U", &n, out.vectors.data(), &n, out.values.data(), &wanted, &query, &wanted_int, &query, &info);
  std::vector<double> work(static_cast<std::size_t>(wanted));
  std::vector<int> work_int(static_cast<std::size_t>(wanted_int));
  const int size = static_cast<int>(work.size()), size_int = wanted_int;
  dsyevd_(job, "U", &n, out.vectors.data(), &n, out.values.data(), work.data(), &size, work_int.data(), &size_int, &info);
  if (info != 0) throw Error(Exit::internal, {}, "eigenvalues of a symmetric matrix did not converge (dsyevd " + std::to_string(info) + "), expected finite values");
  if (!vectors) out.vectors.resize(0, 0);
  return out;
}

Eigen::VectorXd product_eigenvalues(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  use_one_blas_thread();
  const int n = size_of(a.rows()), second_kind = 2;
  int info = 0;
  Eigen::MatrixXd l = a, m = b;
  if (n == 0) return {};
  dpotrf_("L", &n, l.data(), &n, &info);
  if (info != 0) return {};
  dsygst_(&second_kind, "L", &n, m.data(), &n, l.data(), &n, &info);  // the lower triangle of L^T b L
  if (info != 0) throw Error(Exit::internal, {}, "a product with a Cholesky factor failed (dsygst " + std::to_string(info) + "), expected matrices of one size");
  m.triangularView<Eigen::StrictlyUpper>() = m.transpose();
  return symmetric_eigen(m, false).values;
}

Schur schur(const Eigen::MatrixXd& a) {
  use_one_blas_thread();
  const int n = size_of(a.rows());
  const int size = 64 * std::max(1, n);
  int found = 0, info = 0;
  Eigen::MatrixXd t = a, u(n, n);
  Eigen::VectorXd real(n), imaginary(n), work(size);
  dgees_("V", "N", nullptr, &n, t.data(), &n, &found, real.data(), imaginary.data(), u.data(), &n, work.data(), &size, nullptr, &info);
  bool triangular = info == 0;
  for (int i = 0; triangular && i + 1 < n; ++i) triangular = std::abs(t(i + 1, i)) <= std::numeric_limits<double>::epsilon() * (std::abs(t(i, i)) + std::abs(t(i + 1, i + 1)));
  if (triangular) return {t.triangularView<Eigen::Upper>().toDenseMatrix().cast<std::complex<double>>(), u.cast<std::complex<double>>()};
  Schur out{a.cast<std::complex<double>>(), Eigen::MatrixXcd(n, n)};
  Eigen::VectorXcd values(n), complex_work(size);
  zgees_("V", "N", nullptr, &n, out.t.data(), &n, &found, values.data(), out.u.data(), &n, complex_work.data(), &size, real.data(), nullptr, &info);
  if (info != 0) throw Error(Exit::internal, {}, "eigenvalues of a matrix did not converge (zgees " + std::to_string(info) + "), expected finite values");
  return out;
}

}  // namespace mocap::metrics
