// Gradients of a scalar function of double tensors against central differences.
#pragma once
#include <gtest/gtest.h>
#include <torch/torch.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

namespace mocap {

// Checks at most `most` entries of each input, evenly spread.
inline void expect_gradients(const std::function<torch::Tensor(const std::vector<torch::Tensor>&)>& f,
                             std::vector<torch::Tensor> inputs, double tolerance = 1e-6, int most = 12,
                             double step = 1e-6) {
  for (auto& t : inputs) t = t.detach().clone().set_requires_grad(true);
  const auto gradients = torch::autograd::grad({f(inputs)}, inputs);
  const torch::NoGradGuard guard;
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    const torch::Tensor flat = inputs[i].view({-1}), g = gradients[i].reshape({-1});
    const std::int64_t stride = std::max<std::int64_t>(1, flat.numel() / most);
    for (std::int64_t e = 0; e < flat.numel(); e += stride) {
      double* value = flat.data_ptr<double>() + e;
      const double before = *value;
      *value = before + step;
      const double up = f(inputs).item<double>();
      *value = before - step;
      const double down = f(inputs).item<double>();
      *value = before;
      const double numeric = (up - down) / (2 * step), analytic = g[e].item<double>();
      EXPECT_NEAR(analytic, numeric, tolerance * std::max({1.0, std::abs(numeric)})) << "input " << i << " entry " << e;
    }
  }
}

}  // namespace mocap
