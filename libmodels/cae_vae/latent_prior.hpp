// Where in the latent space motion lies: a Gaussian mixture fitted to the training windows after the training ("ex-post density estimation", Ghosh et al. 2020, section 4).
//
//   p(z) = sum_k w_k N(z | mu_k, Sigma_k),  fitted to the aggregated posterior 1/N sum_n q(z | y_n)
//
// The paper draws from N(0, I), which is what the KL divergence pulls all windows together towards, but on a few hundred clips of several actions they stay apart in clumps, and most of N(0, I)
// lies between them: arms half raised, half walking. By expectation maximisation with responsibilities by the means of q(z | y_n); Sigma_k are their covariances plus the mean variances of q.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "libmocap/base/random.hpp"
#include "libmocap/store/model_file.hpp"

namespace mocap::cae_vae {

struct LatentPrior {
  Eigen::VectorXd weight;                    // (K), sum 1
  Eigen::MatrixXd mean;                      // (L, K)
  std::vector<Eigen::MatrixXd> root;         // K times (L, L) lower triangular, Sigma = root root^T

  int components() const { return static_cast<int>(weight.size()); }
  // mu_k + scale root_k eps with k drawn by the weights.
  Eigen::VectorXd draw(Random& random, double scale) const;
  // Mean of log p(z) over the columns of z.
  double log_likelihood(const Eigen::MatrixXd& z) const;
};

// means, variances (L, N) of q(z | y_n). `components` at most; fewer where windows are few: every one has ten windows at least. Depends on (seed) and the data alone. Cost: O(N K L^2) an iteration, at most 100.
LatentPrior fit_latent_prior(const Eigen::MatrixXd& means, const Eigen::MatrixXd& variances, int components, std::uint64_t seed);

// As tensors of a model file under `prior/`, and back: Error(data) naming the part that is missing, of another size or no such distribution. take_latent_prior removes them from `weights`.
std::map<std::string, store::Tensor> stored(const LatentPrior& prior);
LatentPrior take_latent_prior(std::map<std::string, store::Tensor>& weights, int latent, const std::string& file);

}  // namespace mocap::cae_vae
