#include "libmodels/train/rmsprop.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "libmocap/base/error.hpp"

namespace mocap::train {
namespace {

using torch::Tensor;

TEST(RmsProp, EqualsLibTorch) {
  torch::manual_seed(1);
  const Tensor start_a = torch::randn({7, 5}), start_b = torch::randn({3});
  Tensor a = start_a.clone(), b = start_b.clone();
  Tensor ra = start_a.clone().set_requires_grad(true), rb = start_b.clone().set_requires_grad(true);
  RmsProp ours({{"a", a}, {"b", b}}, {0.9, 1e-8});
  torch::optim::RMSprop theirs({ra, rb}, torch::optim::RMSpropOptions(0.01).alpha(0.9).eps(1e-8));
  for (int step = 0; step < 50; ++step) {
    const double rate = 0.01 / (1 + step);
    const std::vector<Tensor> gradients = {torch::randn({7, 5}) * (step % 7 == 0 ? 1e-6 : 3.0), torch::randn({3}) + 1};
    ra.mutable_grad() = gradients[0].clone();
    rb.mutable_grad() = gradients[1].clone();
    static_cast<torch::optim::RMSpropOptions&>(theirs.param_groups()[0].options()).lr(rate);
    theirs.step();
    ours.step(gradients, rate);
    ASSERT_LT((a - ra).abs().max().item<double>(), 1e-6) << step;
    ASSERT_LT((b - rb).abs().max().item<double>(), 1e-6) << step;
  }
  EXPECT_GT((a - start_a).abs().min().item<double>(), 1e-5);
}

TEST(RmsProp, UpdatesAPartAlone) {
  Tensor a = torch::ones({2}), b = torch::ones({3}), c = torch::ones({1});
  RmsProp optimizer({{"a", a}, {"b", b}, {"c", c}});
  optimizer.step({torch::ones({3}), torch::ones({1})}, 0.1, 1);
  EXPECT_TRUE(torch::equal(a, torch::ones({2})));
  EXPECT_NEAR(b[1].item<double>(), 1 - 0.1 / std::sqrt(0.1), 1e-6);
  EXPECT_NEAR(c[0].item<double>(), b[0].item<double>(), 1e-7);
  EXPECT_TRUE(torch::equal(optimizer.state().at("a/v"), torch::zeros({2})));
}

TEST(RmsProp, StateContinuesToTheSameBitsAndIsChecked) {
  torch::manual_seed(2);
  std::vector<Tensor> gradients;
  for (int i = 0; i < 10; ++i) gradients.push_back(torch::randn({4}));
  const Tensor start = torch::randn({4});
  Tensor whole = start.clone(), resumed = start.clone(), forgetful;
  RmsProp uninterrupted({{"p", whole}}), first({{"p", resumed}});
  for (int i = 0; i < 10; ++i) uninterrupted.step({gradients[static_cast<std::size_t>(i)]}, 0.1);
  for (int i = 0; i < 6; ++i) first.step({gradients[static_cast<std::size_t>(i)]}, 0.1);
  forgetful = resumed.clone();
  std::map<std::string, Tensor> state;
  for (const auto& [name, tensor] : first.state()) state[name] = tensor.clone();
  RmsProp second({{"p", resumed}}), none({{"p", forgetful}});
  second.set_state(state, 6);
  for (int i = 6; i < 10; ++i) {
    second.step({gradients[static_cast<std::size_t>(i)]}, 0.1);
    none.step({gradients[static_cast<std::size_t>(i)]}, 0.1);
  }
  EXPECT_TRUE(torch::equal(resumed, whole));
  EXPECT_FALSE(torch::equal(forgetful, whole));
  EXPECT_THROW(second.set_state({}, 6), Error);
  EXPECT_THROW(second.set_state({{"p/v", torch::zeros({5})}}, 6), Error);
}

TEST(ClipEntries, EveryDerivativeAlone) {
  std::vector<Tensor> gradients = {torch::tensor({-7.0f, 3.0f, 5.5f}), torch::tensor({0.5f})};
  clip_entries(gradients, 5);
  EXPECT_TRUE(torch::equal(gradients[0], torch::tensor({-5.0f, 3.0f, 5.0f})));
  EXPECT_TRUE(torch::equal(gradients[1], torch::tensor({0.5f})));
  gradients[0] = torch::tensor({std::numeric_limits<float>::quiet_NaN()});
  clip_entries(gradients, 5);
  EXPECT_TRUE(std::isnan(gradients[0].item<float>()));  // a diverging training must show
}

}  // namespace
}  // namespace mocap::train
