// Convolution over time on the packed kernels of this room (nn/packed_matrix.hpp).
//
//   y[t, o] = bias[o] + sum_k sum_c x[t + k - K/2, c] weight[o, c, k],  zeros beyond the ends
// Frames one after the other in memory are the rows of the product already: K of them, overlapping, so nothing is unfolded. The same bits on any x86-64 processor with fused multiply-add.
//
// Not torch::conv1d: under load its oneDNN 2.7 has damaged the heap in one training of a hundred ("corrupted size vs. prev_size", found in its own execute), and once left numbers that are not finite.
#pragma once
#include <torch/torch.h>

namespace mocap::nn {

// x (B, T, C), weight (O, C, K) with K odd, bias (O), float -> (B, T, O). Differentiable once, forward and backward on the caller's thread.
// Cost: 2 B T C O K flop forward, as many for each gradient asked for.
torch::Tensor convolution(const torch::Tensor& x, const torch::Tensor& weight, const torch::Tensor& bias);

}  // namespace mocap::nn
