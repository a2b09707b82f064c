// The Frechet distance between two sets of features (Heusel et al. 2017; Ghorbani et al. 2020, eq. 28), in double.
//
//   d^2 = |m1 - m2|^2 + tr S1 + tr S2 - 2 tr sqrt(S1^1/2 S2 S1^1/2),   m mean, S covariance (n - 1)
//
// The matrix under the root is symmetric, so the trace is the sum of the roots of its eigenvalues: no complex numbers and no
// matrix square root that fails (S1 S2, which is what most programs take the root of, has the same eigenvalues, and so has L^T S2 L with S1 = L L^T,
// which takes no eigenvectors).
// Features are [N,d], one row a clip.
#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

namespace mocap::metrics {

struct Gaussian {
  Eigen::VectorXd mean;        // [d]
  Eigen::MatrixXd covariance;  // [d,d]
  long n = 0;                  // clips it was estimated from; 0: unknown (read from a file)
};

// Error(data) for fewer than 2 rows, and for a value that is not finite, naming its row and column. `what` is what errors
// call the set. Cost N d^2.
Gaussian gaussian(const Eigen::MatrixXd& features, const std::string& what = "features");
// Row i counted counts[i] times (a resample of the bootstrap); n is the sum. Error(data) where that is below 2.
Gaussian gaussian(const Eigen::MatrixXd& features, const std::vector<int>& counts);

// Error(data) unless n > d for each set whose n is known: below that a covariance is singular and the distance an artefact of
// n. Error(data) where dimensions differ or values are not finite. Within 1e-9 (relative to the traces) of SciPy's for
// covariances of full rank. Never below 0.
double frechet_distance(const Gaussian& a, const Gaussian& b);
// Of features, with the covariances of both sets at a time. 8000 x 512: 0.13 s of processor time.
double frechet_distance(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b, int threads = 1);

// Principal axes of features: what brings d under N. Fit it on the training clips, never on what is compared.
struct Pca {
  Eigen::VectorXd mean;     // [d]
  Eigen::MatrixXd axes;     // [d,k] orthonormal, by falling variance; the largest entry of each is positive
  Eigen::VectorXd variance; // [k]
  double kept = 0;          // share of the whole variance
};
Pca fit_pca(const Eigen::MatrixXd& features, int k);                        // Error(data) unless 1 <= k <= d and k < N
Eigen::MatrixXd project(const Pca& pca, const Eigen::MatrixXd& features);  // [N,k]

// The formula as public programs compute it, deviations included: sqrtm(S1 S2) by the Schur form as SciPy does it; where that is
// not finite, of (S1 + 1e-6 I)(S2 + 1e-6 I).
//   pytorch_fid, a2m, actor   real part; Error(data) where a diagonal entry's imaginary part is above 1e-3
//   clean_fid                 real part, no check
//   torch_fidelity            sum of the real parts of the roots of the eigenvalues of S1 S2, no 1e-6
// All but pytorch_fid average float32 features in float32, row after row, as np.mean does, and square the difference in it: so here where every value is a float32.
// No refusal for N <= d: these programs have none. Within 1e-6 (relative) of them.
enum class Compat { none, pytorch_fid, clean_fid, torch_fidelity, a2m, actor };
Compat parse_compat(const std::string& name);  // "pytorch-fid", ...; Error(usage)
double frechet_distance_compat(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b, Compat formula);

}  // namespace mocap::metrics
