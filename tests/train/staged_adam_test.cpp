#include "libmodels/train/staged_adam.hpp"

#include <gtest/gtest.h>

#include "libmocap/base/error.hpp"

namespace mocap::train {
namespace {

using torch::Tensor;

// Two stages of 5 and 7 steps are two Adams, wherever the training is stopped between.
TEST(StagedAdam, EachStageIsAnAdamOfItsOwn) {
  torch::manual_seed(4);
  const Tensor start = torch::randn({3}), other = torch::randn({2, 2});
  std::vector<Tensor> g, h;
  for (int i = 0; i < 5; ++i) g.push_back(torch::randn({3}));
  for (int i = 0; i < 7; ++i) h.push_back(torch::randn({2, 2}));
  Tensor a = start.clone(), b = other.clone();
  Adam one({{"a", a}}), two({{"b", b}});
  for (const auto& x : g) one.step({x}, 0.1);
  for (const auto& x : h) two.step({x}, 0.1);

  for (const int stop : {0, 3, 5, 8}) {
    const Tensor constant = torch::randn({1}), kept = constant.clone();
    Tensor p = start.clone(), q = other.clone();
    const NamedTensors named = {{"c", constant}, {"a", p}, {"b", q}};
    const std::vector<StagedAdam::Stage> stages = {{1, 1, 0}, {2, 1, 5}};
    auto adam = std::make_unique<StagedAdam>(named, stages);
    for (int step = 0; step < 12; ++step) {
      if (step == stop) {
        std::map<std::string, Tensor> state;
        for (const auto& [name, tensor] : adam->state()) state[name] = tensor.clone();
        EXPECT_EQ(state.size(), 4u);
        adam = std::make_unique<StagedAdam>(named, stages);
        adam->set_state(state, step);
      }
      if (step < 5)
        adam->step({g[static_cast<std::size_t>(step)]}, 0.1, 1);
      else
        adam->step({h[static_cast<std::size_t>(step - 5)]}, 0.1, 2);
    }
    EXPECT_TRUE(torch::equal(p, a)) << stop;
    EXPECT_TRUE(torch::equal(q, b)) << stop;
    EXPECT_TRUE(torch::equal(constant, kept));
    EXPECT_THROW(adam->step({g[0]}, 0.1, 0), Error);
  }
}

}  // namespace
}  // namespace mocap::train
