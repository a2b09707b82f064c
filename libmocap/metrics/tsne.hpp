// A map of features: exact t-SNE (van der Maaten and Hinton 2008; Ghorbani et al. 2020, Figure 4), in double.
//
//   p_j|i = exp(-b_i |x_i - x_j|^2) / sum_{k != i} exp(-b_i |x_i - x_k|^2)   b_i such that the entropy of row i is ln(perplexity)
//   p_ij  = (p_j|i + p_i|j) / 2N
//   q_ij  = w_ij / sum_{k != l} w_kl,  w_ij = 1 / (1 + |y_i - y_j|^2)
//   C     = KL(P || Q) = sum_{i != j} p_ij ln(p_ij / q_ij),  dC/dy_i = 4 sum_j (p_ij - q_ij) w_ij (y_i - y_j)
//
// Features are [N,d], one row a clip; maps [N,2]. Every row of a result is summed by itself, in one order: equal bits for any `threads`.
// All O(N^2): the figures of speed are in docs/performance.md. A principal map is fit_pca and project of frechet.hpp.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <functional>

namespace mocap::metrics {

// Descent as in van der Maaten's program, with scikit-learn's defaults: step y += v, v = m v - rate * gain * dC/dy; m 0.5 in the first
// `exaggerated` iterations, in which P is multiplied by `exaggeration`, 0.8 afterwards; a gain grows by 0.2 where gradient and v
// have opposite signs and shrinks to 0.8 of itself elsewhere, at least 0.01. It always takes all iterations.
struct TsneOptions {
  double perplexity = 30;
  int iterations = 1000, exaggerated = 250;
  double exaggeration = 12;
  double learning_rate = 0;   // 0: max(N / exaggeration / 4, 50)
  bool random_start = false;  // false: the first two principal axes, the first brought to a deviation of 1e-4; true: normal, of 1e-4, from `seed`.
                              // Where there is no second axis, that coordinate is normal, of 1e-5
  std::uint64_t seed = 1;
  int threads = 1;
  std::function<void(int)> progress{};  // called with the number of iterations done
};

inline constexpr long kTsneMost = 20000;  // rows; P takes 8 N^2 bytes: 3.2 GB

struct TsneMap {
  Eigen::MatrixXd points;  // [N,2], mean 0
  double divergence = 0;   // C at the end, without exaggeration, nats
  double perplexity = 0;   // exp of the mean entropy of the rows p_.|i: below options.perplexity only where more clips than that are equal
  double learning_rate = 0;
};

// Error(data) for fewer than 3 rows, for N - 1 < 3 perplexity (a neighbourhood would be the whole set; the message names the most that N
// allows), for more than kTsneMost rows, for values that are not finite, and where all rows are equal; Error(usage) for a perplexity not above 1,
// iterations below 1, exaggeration below 1, a negative rate.
TsneMap tsne(const Eigen::MatrixXd& features, const TsneOptions& options);

// Its parts, for tests and other descents. Column i holds p_j|i over j (diagonal 0, sum 1 within 1e-14), each entropy within 1e-11 of
// ln(perplexity). Where more rows equal row i than `perplexity` says, they share its probability evenly.
Eigen::MatrixXd conditional_probabilities(const Eigen::MatrixXd& features, double perplexity, int threads = 1);
// p_ij: symmetric, diagonal 0, sum 1.
Eigen::MatrixXd joint_probabilities(const Eigen::MatrixXd& conditional);
// dC/dy [N,2] with `exaggeration` times P; joint [N,N] symmetric.
Eigen::MatrixXd tsne_gradient(const Eigen::MatrixXd& joint, const Eigen::MatrixXd& points, double exaggeration = 1, int threads = 1);
double tsne_divergence(const Eigen::MatrixXd& joint, const Eigen::MatrixXd& points, int threads = 1);

// How well a map keeps neighbours (Venna and Kaski 2001): 1 - 2 / (N k (2N - 3k - 1)) sum_i sum_{j in U_k(i)} (r(i,j) - k), U_k(i) those of the k nearest
// in the map that are not among the k nearest in features, r(i,j) the rank of j from i in features. 1: none intrudes; about 0.5 at random.
// Error(data) unless 1 <= k < N / 2 and both have as many rows.
double trustworthiness(const Eigen::MatrixXd& features, const Eigen::MatrixXd& points, int k = 5, int threads = 1);

}  // namespace mocap::metrics
