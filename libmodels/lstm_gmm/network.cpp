#include "libmodels/lstm_gmm/network.hpp"

#include <cmath>
#include <numbers>

#include "libmocap/base/random.hpp"
#include "libmodels/train/adam.hpp"

namespace mocap::lstm_gmm {

using torch::Tensor;

Network::Network(const LstmGmmConfig& config, std::uint64_t seed) : config_(config) {
  config.validate();
  std::uint64_t part = 0;
  const auto mlp = [&](const char* name, const std::vector<int>& sizes, bool activate_last) {
    Random random(seed, stream_of(++part, 0));
    return register_module(name, std::make_shared<nn::Mlp>(sizes, activate_last, random));
  };
  const auto lstm = [&](const char* name, int in) {
    Random random(seed, stream_of(++part, 0));
    return register_module(name, std::make_shared<nn::LstmCell>(in, config.hidden, random, config.cell == Cell::paper));
  };
  encoder = mlp("encoder", {config.input(), config.width}, true);
  lstm_1 = lstm("lstm_1", config.width);
  lstm_2 = lstm("lstm_2", config.hidden);
  decoder = mlp("decoder", {config.hidden, config.width, config.outputs()}, false);
}

PackedNetwork::PackedNetwork(const Network& n, bool training)
    : lstm_1(std::make_shared<nn::PackedLstmCell>(*n.lstm_1, training)), lstm_2(std::make_shared<nn::PackedLstmCell>(*n.lstm_2, training)) {}

Network::Output Network::forward(const Tensor& x, const Tensor& state, const PackedNetwork* packed) const {
  const std::int64_t h = config_.hidden, b = state.size(0), rows = x.size(0);
  const Tensor s_1 = nn::lstm_sequence(*lstm_1, encoder->forward(x.contiguous()), state.narrow(1, 0, 2 * h), packed ? packed->lstm_1 : nullptr);
  const Tensor s_2 = nn::lstm_sequence(*lstm_2, s_1.narrow(1, 0, h), state.narrow(1, 2 * h, 2 * h), packed ? packed->lstm_2 : nullptr);
  return {decoder->forward(s_2.narrow(1, 0, h).contiguous()), torch::cat({s_1.narrow(0, rows - b, b), s_2.narrow(0, rows - b, b)}, 1)};
}

Mixture Network::mixture(const Tensor& y, const Tensor& x) const {
  const std::int64_t m = config_.mixtures, d = config_.features, r = y.size(0);
  Tensor means = y.narrow(1, m, m * d).reshape({r, m, d});
  if (config_.carry != 0) means = means + config_.carry * x.narrow(1, 0, d).unsqueeze(1);
  return {y.narrow(1, 0, m).log_softmax(1), means, y.narrow(1, m + m * d, m * d).reshape({r, m, d}).clamp_min(kLeastLogSigma), y.narrow(1, m + 2 * m * d, config_.contacts)};
}

Tensor feature_loss(const Mixture& mixture, const Tensor& x) {
  const Tensor z = (x.unsqueeze(1) - mixture.means) * (-mixture.log_sigmas).exp();
  const double constant = 0.5 * std::log(2 * std::numbers::pi) * static_cast<double>(x.size(1));
  return constant - torch::logsumexp(mixture.log_weights - (0.5 * z.square() + mixture.log_sigmas).sum(2), 1);
}

Tensor contact_loss(const Mixture& mixture, const Tensor& contacts) {
  // softplus(l) - c l = -log P(c)
  return (torch::nn::functional::softplus(mixture.contact_logits) - contacts * mixture.contact_logits).sum(1);
}

Tensor initial_state(const Network& network, const Tensor& first, const Tensor& second, int steps, double rate) {
  const std::int64_t d = network.config().features;
  const PackedNetwork packed(network);
  Tensor state = torch::zeros({first.size(0), network.config().state()}, first.options());
  const torch::AutoGradMode with_gradients(true);
  train::Adam adam({{"state", state}});
  for (int i = 0; i < steps; ++i) {
    const Tensor s = state.detach().set_requires_grad(true);
    const Mixture next = network.mixture(network.forward(first, s, &packed).y, first);
    const Tensor loss = (feature_loss(next, second.narrow(1, 0, d)) + contact_loss(next, second.narrow(1, d, second.size(1) - d))).sum();
    adam.step(torch::autograd::grad({loss}, {s}), rate);
  }
  return state;
}

}  // namespace mocap::lstm_gmm
