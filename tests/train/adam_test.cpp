#include "libmodels/train/adam.hpp"

#include <gtest/gtest.h>

#include "libmocap/base/error.hpp"
#include "libmocap/base/log.hpp"
#include "libmodels/nn/blas.hpp"

namespace mocap::train {
namespace {

using torch::Tensor;

struct OneThread : testing::Environment {
  void SetUp() override {
    nn::use_one_blas_thread();
    log::start("test", log::Level::warning);
  }
};
const auto* const kEnvironment = testing::AddGlobalTestEnvironment(new OneThread);

TEST(Adam, EqualsLibTorch) {
  torch::manual_seed(1);
  const Tensor start_a = torch::randn({7, 5}), start_b = torch::randn({3});
  Tensor a = start_a.clone(), b = start_b.clone();
  Tensor ra = start_a.clone().set_requires_grad(true), rb = start_b.clone().set_requires_grad(true);
  Adam ours({{"a", a}, {"b", b}});
  torch::optim::Adam theirs({ra, rb}, torch::optim::AdamOptions(0.01));
  for (int step = 0; step < 50; ++step) {
    const double rate = 0.01 / (1 + step);
    const std::vector<Tensor> gradients = {torch::randn({7, 5}) * (step % 7 == 0 ? 1e-6 : 3.0), torch::randn({3}) + 1};
    ra.mutable_grad() = gradients[0].clone();
    rb.mutable_grad() = gradients[1].clone();
    static_cast<torch::optim::AdamOptions&>(theirs.param_groups()[0].options()).lr(rate);
    theirs.step();
    ours.step(gradients, rate);
    ASSERT_LT((a - ra).abs().max().item<double>(), 1e-6) << step;
    ASSERT_LT((b - rb).abs().max().item<double>(), 1e-6) << step;
  }
  EXPECT_GT((a - start_a).abs().min().item<double>(), 1e-5);
  EXPECT_EQ(ours.steps(), 50);
}

TEST(Adam, StateContinuesToTheSameBits) {
  torch::manual_seed(2);
  std::vector<Tensor> gradients;
  for (int i = 0; i < 10; ++i) gradients.push_back(torch::randn({4}));
  const Tensor start = torch::randn({4});
  Tensor whole = start.clone(), resumed = start.clone(), forgetful = start.clone(), miscounted = start.clone();
  Adam uninterrupted({{"p", whole}}), first({{"p", resumed}});
  for (int i = 0; i < 10; ++i) uninterrupted.step({gradients[i]}, 0.1);
  for (int i = 0; i < 6; ++i) first.step({gradients[i]}, 0.1);
  forgetful.copy_(resumed);
  miscounted.copy_(resumed);
  std::map<std::string, Tensor> state;
  for (const auto& [name, tensor] : first.state()) state[name] = tensor.clone();
  Adam second({{"p", resumed}}), none({{"p", forgetful}}), wrong({{"p", miscounted}});
  second.set_state(state, 6);
  wrong.set_state(state, 5);
  for (int i = 6; i < 10; ++i) {
    second.step({gradients[i]}, 0.1);
    none.step({gradients[i]}, 0.1);
    wrong.step({gradients[i]}, 0.1);
  }
  EXPECT_TRUE(torch::equal(resumed, whole));
  EXPECT_FALSE(torch::equal(forgetful, whole));
  EXPECT_FALSE(torch::equal(miscounted, whole));
}

TEST(Adam, StateOfAnotherNetworkIsRefused) {
  Adam adam({{"p", torch::zeros({4})}, {"q", torch::zeros({2})}});
  auto state = adam.state();
  EXPECT_EQ(state.size(), 4u);
  const auto refused = [&](const std::map<std::string, Tensor>& s) {
    try {
      adam.set_state(s, 1);
    } catch (const Error& e) {
      return e.status() == Exit::data ? e.where().object : std::string("another status");
    }
    return std::string();
  };
  EXPECT_EQ(refused(state), "");
  auto shorter = state;
  shorter["q/v"] = torch::zeros({3});
  EXPECT_EQ(refused(shorter), "training/q/v");
  state.erase("p/m");
  EXPECT_EQ(refused(state), "training/p/m");
}

TEST(ClipGradients, ScalesTheJointNorm) {
  std::vector<Tensor> g = {torch::tensor({3.0f, 0.0f}), torch::tensor({{4.0f}})};
  EXPECT_DOUBLE_EQ(clip_gradients(g, 10), 5);
  EXPECT_EQ(g[0][0].item<float>(), 3);
  EXPECT_DOUBLE_EQ(clip_gradients(g, 0.1), 5);
  EXPECT_NEAR(g[0][0].item<double>(), 0.06, 1e-8);
  EXPECT_NEAR(g[1][0][0].item<double>(), 0.08, 1e-8);
  EXPECT_NEAR(clip_gradients(g, 10), 0.1, 1e-8);
}

TEST(ClipGradients, SharedMemoryIsScaledOnce) {
  const Tensor same = torch::tensor({3.0f, 4.0f});
  std::vector<Tensor> g = {same, same, torch::ones({1}).expand({50})};
  EXPECT_NEAR(clip_gradients(g, 1), 10, 1e-6);
  EXPECT_NEAR(g[0][0].item<double>(), 0.3, 1e-7);
  EXPECT_NEAR(g[1][1].item<double>(), 0.4, 1e-7);
  EXPECT_NEAR(g[2][49].item<double>(), 0.1, 1e-7);
}

TEST(ClipGradients, NotFiniteIsReported) {
  std::vector<Tensor> g = {torch::tensor({1.0f, std::numeric_limits<float>::quiet_NaN()})};
  EXPECT_TRUE(std::isnan(clip_gradients(g, 1)));
  g = {torch::tensor({std::numeric_limits<float>::infinity()})};
  EXPECT_TRUE(std::isinf(clip_gradients(g, 1)));
}

}  // namespace
}  // namespace mocap::train
