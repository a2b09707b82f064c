#include "libmodels/nn/convolution.hpp"

#include <gtest/gtest.h>

#include <array>

namespace mocap::nn {
namespace {

using torch::Tensor;

// LibTorch's own, in double, is the other route; so are its gradients.
TEST(Convolution, IsThatOfLibTorch) {
  torch::manual_seed(3);
  for (const auto& [batch, frames, in, out, kernel, stride] : {std::array<std::int64_t, 6>{3, 20, 58, 32, 15, 1}, {1, 7, 3, 5, 7, 1}, {2, 9, 4, 1, 1, 1}, {4, 6, 2, 40, 5, 1}, {2, 11, 6, 5, 5, 2}, {2, 10, 6, 5, 5, 2}, {1, 13, 3, 4, 3, 4}})
    for (const auto type : {torch::kFloat, torch::kDouble}) {
      const double bound = type == torch::kFloat ? 1e-4 : 1e-11;
      const Tensor x = torch::randn({batch, frames, in}, type).set_requires_grad(true), w = torch::randn({out, in, kernel}, type).set_requires_grad(true), b = torch::randn({out}, type).set_requires_grad(true);
      const Tensor xd = x.detach().to(torch::kDouble).set_requires_grad(true), wd = w.detach().to(torch::kDouble).set_requires_grad(true), bd = b.detach().to(torch::kDouble).set_requires_grad(true);
      const Tensor y = convolution(x, w, b, static_cast<int>(stride)), yd = torch::conv1d(xd.transpose(1, 2), wd, bd, stride, kernel / 2).transpose(1, 2);
      ASSERT_EQ(y.sizes(), yd.sizes());
      EXPECT_TRUE(torch::allclose(y.to(torch::kDouble), yd, bound, bound));
      const Tensor seen = torch::randn(y.sizes(), type);
      const auto ours = torch::autograd::grad({(y * seen).sum()}, {x, w, b}), theirs = torch::autograd::grad({(yd * seen.to(torch::kDouble)).sum()}, {xd, wd, bd});
      for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_EQ(ours[i].sizes(), theirs[i].sizes());
        EXPECT_TRUE(torch::allclose(ours[i].to(torch::kDouble), theirs[i], bound, 10 * bound)) << i << " " << in << " " << stride;
      }
    }
}

// A network that is only looked through, as a classifier in a generator's loss.
TEST(Convolution, WeightsWithoutGradientsHaveNone) {
  torch::manual_seed(5);
  const Tensor x = torch::randn({2, 8, 3}).set_requires_grad(true), w = torch::randn({4, 3, 3}), b = torch::randn({4});
  const Tensor dx = torch::autograd::grad({convolution(x, w, b).sum()}, {x})[0];
  EXPECT_NEAR(dx[0][3][1].item<double>(), w.select(1, 1).sum().item<double>(), 1e-4);
}

TEST(Convolution, AWindowDoesNotDependOnTheOthers) {
  torch::manual_seed(4);
  const Tensor x = torch::randn({5, 12, 6}), w = torch::randn({7, 6, 3}), b = torch::randn({7});
  const Tensor all = convolution(x, w, b);
  for (std::int64_t i = 0; i < 5; ++i) EXPECT_TRUE(torch::equal(convolution(x.narrow(0, i, 1), w, b)[0], all[i]));
}

}  // namespace
}  // namespace mocap::nn
