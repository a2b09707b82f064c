// Loss terms of Ghorbani et al. 2020, section 3.5, on tensors. Quaternions are wxyz in the last dimension.
#pragma once
#include <torch/torch.h>

#include "libmocap/skeleton/skeleton.hpp"

namespace mocap::nn {

// Angle between rotations, eq. 17, as 2 atan2(|vec|, |w|) of target^-1 q: arccos has infinite slope at 1.
// q, target  (..., 4); q need not be unit (the angle is that of the normalised q), target is a unit constant.
// Returns (...), radians in [0, pi]. The gradient is with respect to q only: of length 2 / |q|, except that it falls to
// 0 linearly below kGeodesicFloor, where its direction is noise; also 0 at q = 0. One pass forward, one backward.
inline constexpr double kGeodesicFloor = 1e-6;
torch::Tensor geodesic_distance(const torch::Tensor& q, const torch::Tensor& target);

// Eq. 18 and 20, for unit q: 1 - |q . t| and min(|q - t|^2, |q + t|^2).
torch::Tensor quaternion_d2(const torch::Tensor& q, const torch::Tensor& target);
torch::Tensor quaternion_d3(const torch::Tensor& q, const torch::Tensor& target);

// q / |q|, with |q| >= 1e-8.
torch::Tensor normalize_quaternions(const torch::Tensor& q);

// Eq. 26 per quaternion: | |q|^2 - 1 |. (..., 4) -> (...)
torch::Tensor unit_norm_penalty(const torch::Tensor& q);

// Impact factors of eq. 23 (libmocap/skeleton), at least `floor` metres, as a float tensor (J); eq. 22 is
// (geodesic_distance(q, target) * joint_weights).sum(-1).
torch::Tensor joint_weights(const Skeleton& skeleton, double floor);

// KL(N(mu_q, sigma_q^2) || N(mu_p, sigma_p^2)) summed over the last dimension of factorised Gaussians, nats.
torch::Tensor gaussian_kl(const torch::Tensor& mu_q, const torch::Tensor& sigma_q, const torch::Tensor& mu_p,
                          const torch::Tensor& sigma_p);

}  // namespace mocap::nn
