// Dense products and symmetric eigenvalues by BLAS and LAPACK, one thread a call: the caller shares work out by fixed
// blocks, so that results do not depend on the number of threads. Eigen alone takes 2.4 times as long (8000 x 512: 0.41 s of processor time
// for what takes 0.17 s here).
#pragma once
#include <Eigen/Core>

namespace mocap::metrics {

// Called before the first product: keeps OpenBLAS (where that is the BLAS) on its caller's thread.
void use_one_blas_thread();

Eigen::MatrixXd gram(const Eigen::MatrixXd& x);                                       // x^T x, [d,d]
Eigen::MatrixXd product(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);          // a b
Eigen::MatrixXd product_transposed(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);  // a b^T
Eigen::MatrixXf product_transposed(const Eigen::MatrixXf& a, const Eigen::MatrixXf& b);

struct SymmetricEigen {
  Eigen::VectorXd values;   // ascending
  Eigen::MatrixXd vectors;  // [d,d], columns; empty where they were not asked for
};
// Error(internal) where LAPACK does not converge.
SymmetricEigen symmetric_eigen(const Eigen::MatrixXd& a, bool vectors);

// Eigenvalues of a b, ascending, for a positive definite and b symmetric: of L^T b L with a = L L^T. No eigenvectors are needed
// (512 x 512: 18 ms of processor time; the eigenvectors of a alone take 30). Empty where a is not positive definite in double.
Eigen::VectorXd product_eigenvalues(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);

// a = U T U^H with T upper triangular. Real where T is, complex otherwise (some eigenvalues are a conjugate pair).
struct Schur {
  Eigen::MatrixXcd t, u;
};
Schur schur(const Eigen::MatrixXd& a);

}  // namespace mocap::metrics
