#include "libmodels/nn/convolution.hpp"

#include <gtest/gtest.h>

namespace mocap::nn {
namespace {

using torch::Tensor;

// LibTorch's own, in double, is the other route; so are its gradients.
TEST(Convolution, IsThatOfLibTorch) {
  torch::manual_seed(3);
  for (const auto& [batch, frames, in, out, kernel] : {std::array<std::int64_t, 5>{3, 20, 58, 32, 15}, {1, 7, 3, 5, 7}, {2, 9, 4, 1, 1}, {4, 6, 2, 40, 5}}) {
    const Tensor x = torch::randn({batch, frames, in}).set_requires_grad(true), w = torch::randn({out, in, kernel}).set_requires_grad(true), b = torch::randn({out}).set_requires_grad(true), seen = torch::randn({batch, frames, out});
    const Tensor y = convolution(x, w, b);
    const auto ours = torch::autograd::grad({(y * seen).sum()}, {x, w, b});
    const Tensor xd = x.detach().to(torch::kDouble).set_requires_grad(true), wd = w.detach().to(torch::kDouble).set_requires_grad(true), bd = b.detach().to(torch::kDouble).set_requires_grad(true);
    const Tensor yd = torch::conv1d(xd.transpose(1, 2), wd, bd, 1, kernel / 2).transpose(1, 2);
    const auto theirs = torch::autograd::grad({(yd * seen.to(torch::kDouble)).sum()}, {xd, wd, bd});
    EXPECT_TRUE(torch::allclose(y.to(torch::kDouble), yd, 1e-4, 1e-4));
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_EQ(ours[i].sizes(), theirs[i].sizes());
      EXPECT_TRUE(torch::allclose(ours[i].to(torch::kDouble), theirs[i], 1e-4, 1e-3)) << i << " " << in;
    }
  }
}

TEST(Convolution, AWindowDoesNotDependOnTheOthers) {
  torch::manual_seed(4);
  const Tensor x = torch::randn({5, 12, 6}), w = torch::randn({7, 6, 3}), b = torch::randn({7});
  const Tensor all = convolution(x, w, b);
  for (std::int64_t i = 0; i < 5; ++i) EXPECT_TRUE(torch::equal(convolution(x.narrow(0, i, 1), w, b)[0], all[i]));
}

}  // namespace
}  // namespace mocap::nn
