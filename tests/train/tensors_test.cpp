#include "libmodels/train/tensors.hpp"

#include <gtest/gtest.h>

#include "libmocap/base/error.hpp"

namespace mocap::train {
namespace {

TEST(Tensors, RoundTripOfAnyLayout) {
  const torch::Tensor x = torch::arange(24, torch::kFloat32).reshape({2, 3, 4});
  for (const torch::Tensor& t : {x, x.transpose(0, 2), x.narrow(1, 1, 2), torch::tensor(5.0f), torch::empty({0, 3}), x.to(torch::kDouble)}) {
    const store::Tensor stored = to_stored(t);
    EXPECT_EQ(stored.shape, t.sizes().vec());
    EXPECT_TRUE(torch::equal(from_stored(stored), t.to(torch::kFloat32)));
  }
  store::Tensor stored = to_stored(x);
  const torch::Tensor copy = from_stored(stored);
  stored.values[0] = 100;
  EXPECT_EQ(copy[0][0][0].item<float>(), 0);
}

TEST(Tensors, LoadWeights) {
  torch::Tensor a = torch::zeros({2, 2}).set_requires_grad(true), b = torch::zeros({3});
  const NamedTensors parameters = {{"a", a}, {"b", b}};
  const std::map<std::string, store::Tensor> stored = to_stored({{"a", torch::ones({2, 2})}, {"b", torch::full({3}, 2)}});
  load_weights(parameters, stored, "model.h5");
  EXPECT_TRUE(torch::equal(a, torch::ones({2, 2})));
  EXPECT_TRUE(torch::equal(b, torch::full({3}, 2.0f)));
  EXPECT_TRUE(a.requires_grad());

  const auto refusal = [&](std::map<std::string, store::Tensor> changed) {
    try {
      load_weights(parameters, changed, "model.h5");
    } catch (const Error& e) {
      return e.status() == Exit::data ? std::string(e.what()) : std::string("another status");
    }
    return std::string("none");
  };
  auto changed = stored;
  changed.erase("b");
  EXPECT_NE(refusal(changed).find("model.h5:weights/b: missing"), std::string::npos) << refusal(changed);
  changed = stored;
  changed["b"] = to_stored(torch::zeros({4}));
  EXPECT_NE(refusal(changed).find("weights/b: shape 4, expected 3"), std::string::npos) << refusal(changed);
  changed = stored;
  changed["c"] = to_stored(torch::zeros({1}));
  EXPECT_NE(refusal(changed).find("weights: 3 tensors, expected the 2"), std::string::npos) << refusal(changed);
}

}  // namespace
}  // namespace mocap::train
