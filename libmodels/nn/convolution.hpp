// Convolution over time on the packed kernels of this room (nn/packed_matrix.hpp).
//
//   y[t, o] = bias[o] + sum_k sum_c x[s t + k - K/2, c] weight[o, c, k],  zeros beyond the ends; ceil(T / s) frames
// Frames one after the other in memory are the rows of the product already: K of them, overlapping, so nothing is unfolded. A row of a batch does not depend on the others; the same bits on any
// x86-64 processor with fused multiply-add.
//
// Not torch::conv1d: under load its oneDNN 2.7 has damaged the heap in one training of a hundred ("corrupted size vs. prev_size", found in its own execute), and once left numbers that are not finite.
#pragma once
#include <torch/torch.h>

#include "libmodels/nn/layers.hpp"

namespace mocap::nn {

// A convolution's weights laid out, to be used many times.
template <class T>
struct PackedConvolution {
  PackedLinear<T> layer;
  int kernel = 1, stride = 1;

  // weight (O, C, K), bias (O) or undefined.
  void pack(const torch::Tensor& weight, const torch::Tensor& bias, int stride_frames = 1);
  // `frames` frames of y (frames, O) from x with K/2 frames of zeros at either end.
  void forward(std::int64_t frames, const T* x, T* y) const;
};

// x (B, T, C), weight (O, C, K) with K odd, bias (O), float or double -> (B, ceil(T / stride), O). Differentiable once, forward and backward on the caller's thread.
// Cost: 2 B T C O K / stride flop forward, as many for the weights' gradient, 2 B T C O K for that of x; what is not asked for is not computed.
torch::Tensor convolution(const torch::Tensor& x, const torch::Tensor& weight, const torch::Tensor& bias, int stride = 1);

}  // namespace mocap::nn
