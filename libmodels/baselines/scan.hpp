// The recurrent part of a baseline's training pass as one autograd function with a hand-written backward pass: frame by
// frame, since own output needs the frame before; every weight gradient is one product over all T B rows afterwards.
// The formulas step by step, in plain double operations, are the oracle in tests/baselines.
#pragma once
#include <torch/torch.h>

#include <memory>

#include "libmodels/baselines/network.hpp"

namespace mocap::baselines {

// Rows are time-major: row t B + b is frame t of clip b. Gradients reach s0, u0 and the network's layers.
// x (T B, D).   control (B or T B, A) one-hots.   s0 (B, state).   u0 (B, D).   noise (T, B, D), replace (T, B) or undefined.
// Returns y (T B, D).
torch::Tensor scan(const Network& network, std::shared_ptr<const PackedNetwork> packed, const torch::Tensor& x, const torch::Tensor& control, const torch::Tensor& s0, const torch::Tensor& u0,
                   const torch::Tensor& noise, const torch::Tensor& replace);

}  // namespace mocap::baselines
