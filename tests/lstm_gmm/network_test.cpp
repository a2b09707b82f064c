#include "libmodels/lstm_gmm/network.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "libmocap/base/error.hpp"
#include "libmocap/base/random.hpp"
#include "libmodels/lstm_gmm/sampler.hpp"
#include "tests/nn/gradient_check.hpp"

namespace mocap::lstm_gmm {
namespace {

using torch::Tensor;

Tensor noise(at::IntArrayRef sizes, std::uint64_t stream) {
  Random random(5, stream);
  return nn::normal_tensor(sizes, random).to(torch::kDouble);
}

LstmGmmConfig tiny(Cell cell = Cell::paper, double carry = 0.9) {
  LstmGmmConfig c;
  c.features = 6;
  c.hidden = 8;
  c.width = 7;
  c.mixtures = 3;
  c.cell = cell;
  c.carry = carry;
  return c;
}

TEST(LstmGmm, PaperSizeIsThePapers) {
  EXPECT_EQ(LstmGmmConfig::preset("paper").parameter_count(), 6952633);
  for (const Cell cell : {Cell::paper, Cell::standard}) {
    const Network network(tiny(cell), 1);
    std::int64_t count = 0;
    for (const Tensor& p : network.parameters()) count += p.numel();
    EXPECT_EQ(count, tiny(cell).parameter_count());
  }
}

TEST(LstmGmm, LossIsMinusTheLogOfTheMixture) {
  const Network network(tiny(), 1);
  const Mixture m = network.mixture(noise({4, tiny().outputs()}, 1), noise({4, 8}, 4));
  const Tensor x = noise({4, 6}, 2), bits = (noise({4, 2}, 3) > 0).to(torch::kDouble);
  const Tensor loss = feature_loss(m, x), contacts = contact_loss(m, bits);
  for (std::int64_t r = 0; r < 4; ++r) {
    double p = 0, sum = 0;
    for (std::int64_t i = 0; i < 3; ++i) {
      double density = std::exp(m.log_weights[r][i].item<double>());
      sum += density;
      for (std::int64_t k = 0; k < 6; ++k) {
        const double sigma = std::exp(m.log_sigmas[r][i][k].item<double>()), z = (x[r][k].item<double>() - m.means[r][i][k].item<double>()) / sigma;
        density *= std::exp(-0.5 * z * z) / (sigma * std::sqrt(2 * std::numbers::pi));
      }
      p += density;
    }
    EXPECT_NEAR(sum, 1, 1e-12);
    EXPECT_NEAR(loss[r].item<double>(), -std::log(p), 1e-10);
    double q = 1;
    for (std::int64_t k = 0; k < 2; ++k) {
      const double on = 1 / (1 + std::exp(-m.contact_logits[r][k].item<double>()));
      q *= bits[r][k].item<double>() > 0 ? on : 1 - on;
    }
    EXPECT_NEAR(contacts[r].item<double>(), -std::log(q), 1e-10);
  }
}

TEST(LstmGmm, FarFromEveryComponentTheLossIsFiniteAndSoIsItsGradient) {
  const Network network(tiny(), 1);
  const Tensor y = (30 * noise({3, tiny().outputs()}, 1)).to(torch::kFloat).set_requires_grad(true);
  const Tensor x = torch::zeros({3, 8});
  const Tensor loss = (feature_loss(network.mixture(y, x), torch::full({3, 6}, 50.0f)) + contact_loss(network.mixture(y, x), torch::ones({3, 2}))).sum();
  EXPECT_TRUE(std::isfinite(loss.item<double>()));
  EXPECT_TRUE(torch::isfinite(torch::autograd::grad({loss}, {y})[0]).all().item<bool>());
}

TEST(LstmGmm, FiniteDifferencesThroughTheWholeNetwork) {
  for (const auto& [cell, carry] : {std::pair{Cell::paper, 0.9}, {Cell::standard, 0.0}}) {
    Network network(tiny(cell, carry), 3);
    network.to(torch::kDouble);
    const Tensor x = noise({10, 8}, 1), next = noise({10, 6}, 2), bits = (noise({10, 2}, 3) > 0).to(torch::kDouble);
    const auto loss = [&](const std::vector<Tensor>& in) {
      const Mixture m = network.mixture(network.forward(in[0], in[1]).y, in[0]);
      return (feature_loss(m, next) + contact_loss(m, bits)).sum();
    };
    expect_gradients(loss, {x, noise({2, 32}, 4)}, 1e-5);
    const Tensor l = loss({x, noise({2, 32}, 4)});
    const auto parameters = network.parameters();
    const auto gradients = torch::autograd::grad({l}, parameters);
    const torch::NoGradGuard guard;
    for (std::size_t i = 0; i < parameters.size(); ++i) {
      const Tensor flat = parameters[i].view({-1});
      const std::int64_t e = flat.numel() / 2;
      const double before = flat[e].item<double>(), step = 1e-6;
      flat[e] = before + step;
      const double up = loss({x, noise({2, 32}, 4)}).item<double>();
      flat[e] = before - step;
      const double down = loss({x, noise({2, 32}, 4)}).item<double>();
      flat[e] = before;
      EXPECT_NEAR(gradients[i].reshape({-1})[e].item<double>(), (up - down) / (2 * step), 1e-4 * std::max(1.0, std::abs(up - down) / (2 * step))) << i;
    }
  }
}

TEST(LstmGmm, InitialStateMakesTheSecondFrameProbable) {
  Network network(tiny(), 3);
  const Tensor first = noise({5, 8}, 1).to(torch::kFloat), second = noise({5, 8}, 2).to(torch::kFloat);
  first.narrow(1, 6, 2).fill_(1);
  second.narrow(1, 6, 2).fill_(0);
  const auto loss = [&](const Tensor& state) {
    const torch::NoGradGuard guard;
    const Mixture m = network.mixture(network.forward(first, state).y, first);
    return feature_loss(m, second.narrow(1, 0, 6)) + contact_loss(m, second.narrow(1, 6, 2));
  };
  const Tensor state = initial_state(network, first, second);
  EXPECT_EQ(state.sizes(), at::IntArrayRef({5, 32}));
  EXPECT_TRUE((loss(state) < loss(torch::zeros({5, 32})) - 0.1).all().item<bool>());
  EXPECT_TRUE(torch::equal(state.narrow(0, 2, 1), initial_state(network, first.narrow(0, 2, 1), second.narrow(0, 2, 1))));
}

ClipRequest request(std::uint64_t stream, std::int64_t frames, std::int64_t state) {
  Random random(9, stream);
  ClipRequest r{1, stream, frames, {}, {}};
  for (int i = 0; i < 6; ++i) r.first.push_back(static_cast<float>(random.normal()));
  r.first.insert(r.first.end(), {1.0f, 0.0f});
  for (std::int64_t i = 0; i < state; ++i) r.state.push_back(0.3f * static_cast<float>(random.normal()));
  return r;
}

TEST(Sampler, ScaleZeroFollowsTheNetwork) {
  for (const auto& [cell, carry] : {std::pair{Cell::paper, 0.9}, {Cell::standard, 0.0}}) {
    const Network network(tiny(cell, carry), 4);
    const Sampler sampler(network);
    const ClipRequest r = request(1, 12, 32);
    const auto frames = sampler.sample({r}, {1, 4, 0, 0})[0];
    ASSERT_EQ(frames.size(), 12u * 8);
    const torch::NoGradGuard guard;
    Tensor x = torch::tensor(r.first).view({1, 8}), state = torch::tensor(r.state).view({1, 32});
    for (int t = 1; t < 12; ++t) {
      const auto out = network.forward(x, state);
      state = out.state;
      const Mixture m = network.mixture(out.y, x);
      x = torch::cat({m.means[0][m.log_weights[0].argmax().item<std::int64_t>()].view({1, 6}), (m.contact_logits > 0).to(torch::kFloat)}, 1);
      for (int k = 0; k < 8; ++k) ASSERT_EQ(frames[static_cast<std::size_t>(8 * t + k)], x[0][k].item<float>()) << t << " " << k;
    }
  }
}

// A network whose output does not depend on its input.
Network constant(const std::vector<float>& y) {
  Network network(tiny(Cell::paper, 0), 1);
  const torch::NoGradGuard guard;
  for (auto& p : network.parameters()) p.zero_();
  network.named_parameters()["decoder.1.bias"].copy_(torch::tensor(y));
  return network;
}

TEST(Sampler, DrawsComeFromTheMixture) {
  std::vector<float> y = {std::log(0.5f), std::log(0.3f), std::log(0.2f)};
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 6; ++k) y.push_back(10.0f * static_cast<float>(i) + static_cast<float>(k));
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 6; ++k) y.push_back(std::log(0.1f * static_cast<float>(i + 1)));
  y.insert(y.end(), {0.4f, -0.1f});
  const Sampler sampler(constant(y));
  const std::int64_t n = 20000;
  const auto frames = sampler.sample({request(3, n + 1, 0)})[0];
  double count[3] = {}, sum[3][6] = {}, squares[3][6] = {};
  for (std::int64_t t = 1; t <= n; ++t) {
    const float* x = frames.data() + 8 * t;
    const int i = static_cast<int>(std::lround((x[0] - 0.0) / 10));
    ASSERT_TRUE(i >= 0 && i < 3);
    ++count[i];
    for (int k = 0; k < 6; ++k) {
      const double d = x[k] - (10 * i + k);
      sum[i][k] += d;
      squares[i][k] += d * d;
    }
    ASSERT_EQ(x[6], 1);
    ASSERT_EQ(x[7], 0);
  }
  const double weight[3] = {0.5, 0.3, 0.2};
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(count[i] / n, weight[i], 4 * std::sqrt(weight[i] * (1 - weight[i]) / n));
    for (int k = 0; k < 6; ++k) {
      const double sigma = 0.1 * (i + 1);
      EXPECT_NEAR(sum[i][k] / count[i], 0, 4 * sigma / std::sqrt(count[i]));
      EXPECT_NEAR(std::sqrt(squares[i][k] / count[i]), sigma, 4 * sigma / std::sqrt(2 * count[i]));
    }
  }
}

TEST(Sampler, ClipsDependOnTheirOwnStreamAlone) {
  const Sampler sampler(Network(tiny(), 5));
  std::vector<ClipRequest> requests;
  for (std::uint64_t i = 0; i < 13; ++i) requests.push_back(request(i, 5 + static_cast<std::int64_t>(i * 7 % 11), i % 2 ? 32 : 0));
  const auto together = sampler.sample(requests, {2, 5, 1, 0.05}), other = sampler.sample(requests, {1, 32, 1, 0.05});
  EXPECT_EQ(together, other);
  for (std::size_t i = 0; i < requests.size(); ++i) EXPECT_EQ(sampler.sample({requests[i]}, {1, 1, 1, 0.05})[0], together[i]) << i;
  EXPECT_NE(sampler.sample({requests[3]}, {1, 1, 1, 0})[0], together[3]);
}

TEST(Sampler, StartsOfAnotherSizeAreRefused) {
  const Sampler sampler(Network(tiny(), 5));
  ClipRequest r = request(1, 3, 31);
  EXPECT_THROW(sampler.sample({r}), Error);
  r = request(1, 3, 32);
  r.first.pop_back();
  EXPECT_THROW(sampler.sample({r}), Error);
}

TEST(Config, JsonAndRefusals) {
  const LstmGmmConfig c = tiny(Cell::standard, 0);
  EXPECT_EQ(config_from_json(to_json(c)), c);
  auto json = to_json(c);
  for (const char* name : {"cell", "carry"}) {
    json[name] = "other";
    EXPECT_THROW(config_from_json(json), Error);
    json = to_json(c);
  }
  json["carry"] = 1.5;
  EXPECT_THROW(config_from_json(json), Error);
  json = to_json(c);
  json.erase("hidden");
  EXPECT_THROW(config_from_json(json), Error);
  json = to_json(c);
  json["mixtures"] = 0;
  EXPECT_THROW(config_from_json(json), Error);
  EXPECT_THROW(LstmGmmConfig::preset("large"), Error);
}

}  // namespace
}  // namespace mocap::lstm_gmm
