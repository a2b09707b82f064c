// One GRU cell (Cho et al. 2014; PyTorch's gate order r, z, n and its second bias inside the reset gate's product).
#pragma once
#include <torch/torch.h>

#include "libmocap/base/random.hpp"
#include "libmodels/nn/layers.hpp"

namespace mocap::nn {

class GruCell : public torch::nn::Module {
 public:
  // All parameters uniform on +-1/sqrt(hidden), PyTorch's default (Kaiming uniform with a = sqrt(5)).
  GruCell(int in, int hidden, Random& random);

  // x (rows, in), h (rows, hidden), contiguous -> next h. Differentiable once, backward written by hand
  // (nn/layers.hpp). For long sequences a scan over PackedGru is cheaper: it forms weight gradients once for all steps.
  torch::Tensor forward(const torch::Tensor& x, const torch::Tensor& h) const;

  template <class T>
  PackedGru<T> pack(bool training) const;

  torch::Tensor weight_ih, weight_hh, bias_ih, bias_hh;  // (3H, in), (3H, H), (3H), (3H)
};

}  // namespace mocap::nn
