#include "libmodels/baselines/network.hpp"

#include <fmt/format.h>

#include <cmath>

#include "libmocap/base/error.hpp"
#include "libmodels/baselines/packed_network.hpp"
#include "libmodels/baselines/scan.hpp"

namespace mocap::baselines {
namespace {

using torch::Tensor;

void expect(const Tensor& t, at::IntArrayRef sizes, const char* name) {
  if (!t.defined() || t.sizes() != sizes)
    throw Error(Exit::internal, {}, fmt::format("baseline: {} has {} values, expected {}", name, t.defined() ? t.numel() : 0, c10::multiply_integers(sizes)));
}

}  // namespace

Network::Network(const BaselineConfig& config, const std::vector<float>& mean, const std::vector<float>& deviation, std::uint64_t seed) : config_(config), mean_(mean), deviation_(deviation) {
  config.validate();
  const auto columns = static_cast<std::size_t>(config.features());
  if (mean.size() != columns || deviation.size() != columns) throw Error(Exit::internal, {}, fmt::format("baseline: {} means, expected {}", mean.size(), columns));
  std::uint64_t part = 0;
  const auto mlp = [&](const char* name, const std::vector<int>& sizes, bool activate_last) {
    Random random(seed, stream_of(++part, 0));
    return register_module(name, std::make_shared<nn::Mlp>(sizes, activate_last, random));
  };
  const auto cell = [&]<class Cell>(std::shared_ptr<Cell>& c, const char* name, int in) {
    Random random(seed, stream_of(++part, 0));
    c = register_module(name, std::make_shared<Cell>(in, config.hidden, random));
  };
  if (config.arch == Arch::erd) {
    encoder = mlp("encoder", {config.input(), config.width, config.width}, true);
    cell(lstm_1, "lstm_1", config.width);
    cell(lstm_2, "lstm_2", config.hidden);
    decoder = mlp("decoder", {config.hidden, config.width, config.narrow, config.features()}, false);
  } else {
    cell(gru_1, "gru_1", config.input());
    cell(gru_2, "gru_2", config.hidden);
    decoder = mlp("decoder", {config.hidden, config.features()}, false);
  }
  start = mlp("start", {config.state(), config.features()}, false);
  auto initial = std::make_shared<torch::nn::Module>();
  Random random(seed, stream_of(++part, 0));
  const std::int64_t rows = config.attribute_combinations();
  initial_mu = initial->register_parameter("mu", nn::normal_tensor({rows, config.state()}, random).mul_(0.1));
  initial_log_sigma = initial->register_parameter("log_sigma", torch::full({rows, config.state()}, std::log(kInitialStateSigma)));
  register_module("initial_state", initial);
}

std::int64_t Network::parameter_count() const {
  std::int64_t count = 0;
  for (const Tensor& p : parameters()) count += p.numel();
  return count;
}

std::int64_t Network::parameter_count(const BaselineConfig& c) {
  const auto mlp = [](std::initializer_list<std::int64_t> sizes) {
    std::int64_t count = 0;
    for (const auto* in = sizes.begin(); in + 1 != sizes.end(); ++in) count += (in[0] + 1) * in[1];
    return count;
  };
  const std::int64_t h = c.hidden, d = c.features(), in = c.input(), w = c.width;
  const std::int64_t rest = mlp({c.state(), d}) + 2 * std::int64_t{c.attribute_combinations()} * c.state();
  if (c.arch == Arch::quaternet) return 3 * h * (in + h + 2) + 3 * h * (2 * h + 2) + mlp({h, d}) + rest;
  return mlp({in, w, w}) + 4 * h * (w + h + 1) + 4 * h * (2 * h + 1) + mlp({h, w, c.narrow, d}) + rest;
}

std::shared_ptr<const PackedNetwork> Network::pack(bool training) const {
  auto packed = std::make_shared<PackedNetwork>();
  if (initial_mu.scalar_type() == torch::kDouble)
    packed->double_ = std::make_unique<NetworkWeights<double>>(*this, training);
  else
    packed->single = std::make_unique<NetworkWeights<float>>(*this, training);
  return packed;
}

Tensor Network::forward(const NetworkInput& input, std::shared_ptr<const PackedNetwork> packed) const {
  const BaselineConfig& c = config_;
  if (!input.x.defined() || input.x.dim() != 3 || input.x.size(0) < 1 || input.x.size(1) < 1)
    throw Error(Exit::internal, {}, "baseline: x is empty or not (clips, frames, features), expected at least one frame");
  const std::int64_t batch = input.x.size(0), frames = input.x.size(1), attributes = static_cast<std::int64_t>(c.attribute_classes.size());
  const bool changing = input.classes.dim() == 3;
  expect(input.x, {batch, frames, c.features()}, "x");
  if (changing)
    expect(input.classes, {batch, frames, attributes}, "classes");
  else
    expect(input.classes, {batch, attributes}, "classes");
  expect(input.initial_noise, {batch, c.state()}, "initial_noise");
  if (input.input_noise.defined()) expect(input.input_noise, {frames, batch, c.features()}, "input_noise");
  if (input.replace.defined()) expect(input.replace, {frames, batch}, "replace");

  // One-hots, a row per clip, or per frame in time-major order; and the initial state's row by the first frame's classes.
  const auto type = initial_mu.scalar_type();
  const Tensor classes = (changing ? input.classes.transpose(0, 1) : input.classes).to(torch::kLong).reshape({-1, attributes}).contiguous();
  const Tensor one_hot = torch::zeros({classes.size(0), c.attribute_total()}), first_rows = torch::empty({batch}, torch::kLong);
  for (std::int64_t r = 0; r < classes.size(0); ++r) {
    const std::span row(classes.data_ptr<std::int64_t>() + r * attributes, static_cast<std::size_t>(attributes));
    const std::int64_t combined = c.combination(row);
    if (r < batch) first_rows.data_ptr<std::int64_t>()[r] = combined;
    std::int64_t offset = r * c.attribute_total();
    for (std::int64_t i = 0; i < attributes; ++i) {
      one_hot.data_ptr<float>()[offset + row[static_cast<std::size_t>(i)]] = 1;
      offset += c.attribute_classes[static_cast<std::size_t>(i)];
    }
  }
  const Tensor s0 = initial_mu.index_select(0, first_rows) + initial_log_sigma.index_select(0, first_rows).exp() * input.initial_noise;
  const Tensor y = scan(*this, packed ? std::move(packed) : pack(), input.x.transpose(0, 1).reshape({frames * batch, -1}), one_hot.to(type), s0, start->forward(s0), input.input_noise, input.replace);
  return y.view({frames, batch, c.features()}).transpose(0, 1);
}

}  // namespace mocap::baselines
