#include "libmodels/motion_cell/network.hpp"

#include <fmt/format.h>

#include <cmath>

#include "libmocap/base/error.hpp"
#include "libmodels/motion_cell/packed_cell.hpp"
#include "libmodels/motion_cell/scan.hpp"
#include "libmodels/nn/losses.hpp"

namespace mocap::motion_cell {
namespace {

using torch::Tensor;

void expect(const Tensor& t, at::IntArrayRef sizes, const char* name) {
  if (!t.defined() || t.sizes() != sizes)
    throw Error(Exit::internal, {},
                fmt::format("motion cell: {} has {} values, expected {}", name, t.defined() ? t.numel() : 0,
                            c10::multiply_integers(sizes)));
}

// (B, N l, D) -> (N B, l D), time-major.
Tensor to_words(const Tensor& x, std::int64_t words) {
  const std::int64_t batch = x.size(0);
  return x.reshape({batch, words, -1}).transpose(0, 1).reshape({words * batch, -1});
}

Tensor from_words(const Tensor& y, std::int64_t batch, at::IntArrayRef sizes) {
  return y.reshape({-1, batch, y.size(1)}).transpose(0, 1).reshape(sizes);
}

// Frames of overlapping words, (N B, (l + o) D) -> (N B, l D).
Tensor joined(const Tensor& written, std::int64_t batch, const MotionCellConfig& c) {
  if (c.overlap == 0) return written;
  const Tensor words = written.view({-1, batch, c.word_length + c.overlap, c.features()});
  const std::int64_t n = words.size(0);
  const Tensor first = words.narrow(2, 0, c.overlap), ahead = words.narrow(2, c.word_length, c.overlap);
  const Tensor before = torch::cat({first.narrow(0, 0, 1), ahead.narrow(0, 0, n - 1)}, 0);  // the first word has none before it
  Tensor share = torch::empty({c.overlap, 1}, written.scalar_type());
  for (int k = 0; k < c.overlap; ++k) share[k][0] = fade_in(k, c.overlap);
  return torch::cat({before + share * (first - before), words.narrow(2, c.overlap, c.word_length - c.overlap)}, 2).reshape({n * batch, c.word_features()});
}

}  // namespace

MotionCell::MotionCell(const MotionCellConfig& config, std::uint64_t seed) : config_(config) {
  config.validate();
  const int e = config.word, p = config.width, z = config.latent, state = 2 * config.hidden, a = config.control;
  std::uint64_t part = 0;
  const auto mlp = [&](const char* name, const std::vector<int>& sizes, bool activate_last) {
    Random random(seed, stream_of(++part, 0));
    return register_module(name, std::make_shared<nn::Mlp>(sizes, activate_last, random));
  };
  const auto gru = [&](const char* name, int in) {
    Random random(seed, stream_of(++part, 0));
    return register_module(name, std::make_shared<nn::GruCell>(in, config.hidden, random));
  };
  if (!config.single_layer) {
    word_encoder = mlp("word_encoder", {config.word_features(), p, p, e}, true);
    word_decoder = mlp("word_decoder", {e, p, p, config.written()}, false);
  }
  word_features = mlp("word_features", {config.decoded(), p, p, e}, true);
  latent_features = mlp("latent_features", {z, p, p, e}, true);
  control_features = mlp("control_features", {config.attribute_total(), a}, true);
  posterior_mu = mlp("posterior_mu", {e + state + a, p, p, p, p, z}, false);
  posterior_sigma = mlp("posterior_sigma", {e + state + a, p, p, p, p, z}, false);
  prior_mu = mlp("prior_mu", {state + a, p, p, p, p, z}, false);
  prior_sigma = mlp("prior_sigma", {state + a, p, p, p, p, z}, false);
  decoder = mlp("decoder", {e + state + a, p, p, config.decoded()}, !config.single_layer);
  gru_1 = gru("gru_1", 2 * e);
  gru_2 = gru("gru_2", config.hidden);
  auto initial = std::make_shared<torch::nn::Module>();
  Random random(seed, stream_of(++part, 0));
  const std::int64_t rows = config.attribute_combinations();
  initial_mu = initial->register_parameter("mu", nn::normal_tensor({rows, state}, random).mul_(0.1));
  initial_log_sigma =
      initial->register_parameter("log_sigma", torch::full({rows, state}, std::log(kInitialStateSigma)));
  register_module("initial_state", initial);
}

std::int64_t MotionCell::parameter_count() const {
  std::int64_t count = 0;
  for (const Tensor& p : parameters()) count += p.numel();
  return count;
}

std::int64_t MotionCell::parameter_count(const MotionCellConfig& c) {
  const auto mlp = [](std::initializer_list<std::int64_t> sizes) {
    std::int64_t count = 0;
    for (const auto* in = sizes.begin(); in + 1 != sizes.end(); ++in) count += (in[0] + 1) * in[1];
    return count;
  };
  const std::int64_t e = c.word, p = c.width, z = c.latent, h = c.hidden, a = c.control;
  const std::int64_t frames = c.word_length * (std::int64_t{c.joints} * c.rotation_values + c.root_values);
  const std::int64_t outside = c.single_layer ? 0 : mlp({frames, p, p, e}) + mlp({e, p, p, frames / c.word_length * (c.word_length + c.overlap)}), w = c.decoded();
  return outside + mlp({w, p, p, e}) + mlp({z, p, p, e}) + mlp({c.attribute_total(), a}) + 2 * mlp({e + 2 * h + a, p, p, p, p, z}) +
         2 * mlp({2 * h + a, p, p, p, p, z}) + mlp({e + 2 * h + a, p, p, w}) + 3 * h * (2 * e + h + 2) + 3 * h * (2 * h + 2) + 2 * std::int64_t{c.attribute_combinations()} * 2 * h;
}

std::shared_ptr<const PackedCell> MotionCell::pack(bool training) const {
  auto packed = std::make_shared<PackedCell>();
  if (initial_mu.scalar_type() == torch::kDouble)
    packed->double_ = std::make_unique<CellWeights<double>>(*this, training);
  else
    packed->single = std::make_unique<CellWeights<float>>(*this, training);
  return packed;
}

Tensor MotionCell::autoencode(const Tensor& x) const {
  if (config_.single_layer) return x;
  const std::int64_t words = x.size(1) / config_.word_length;
  return from_words(word_decoder->forward(word_encoder->forward(to_words(x, words))).narrow(1, 0, config_.word_features()), x.size(0), x.sizes());
}

CellOutput MotionCell::forward(const CellInput& input, std::shared_ptr<const PackedCell> packed) const {
  const MotionCellConfig& c = config_;
  if (!input.x.defined() || input.x.dim() != 3 || input.x.size(0) < 1 || input.x.size(1) < c.word_length)
    throw Error(Exit::internal, {},
                "motion cell: x is empty or not (clips, frames, features), expected at least one word");
  const std::int64_t batch = input.x.size(0), words = input.x.size(1) / c.word_length;
  const std::int64_t attributes = static_cast<std::int64_t>(c.attribute_classes.size());
  const bool changing = input.classes.dim() == 3;
  expect(input.x, {batch, words * c.word_length, c.features()}, "x");
  if (changing)
    expect(input.classes, {batch, words, attributes}, "classes");
  else
    expect(input.classes, {batch, attributes}, "classes");
  expect(input.posterior_noise, {words, batch, c.latent}, "posterior_noise");
  expect(input.initial_noise, {batch, 2 * c.hidden}, "initial_noise");
  if (input.replace.defined()) expect(input.replace, {words, batch}, "replace");

  // One-hots, a row per clip, or per word in time-major order; and the initial state's row by the first word's classes.
  const Tensor classes = (changing ? input.classes.transpose(0, 1) : input.classes)
                             .to(torch::kLong)
                             .reshape({-1, attributes})
                             .contiguous();
  const Tensor one_hot = torch::zeros({classes.size(0), c.attribute_total()}),
               first_rows = torch::empty({batch}, torch::kLong);
  for (std::int64_t r = 0; r < classes.size(0); ++r) {
    const std::span row(classes.data_ptr<std::int64_t>() + r * attributes, static_cast<std::size_t>(attributes));
    const std::int64_t combined = c.combination(row);
    if (r < batch) first_rows.data_ptr<std::int64_t>()[r] = combined;
    std::int64_t offset = r * c.attribute_total();
    for (std::int64_t i = 0; i < attributes; ++i) {
      one_hot.data_ptr<float>()[offset + row[i]] = 1;
      offset += c.attribute_classes[i];
    }
  }
  const auto type = initial_mu.scalar_type();
  const Tensor control = control_features->forward(one_hot.to(type));
  const Tensor h0 = initial_mu.index_select(0, first_rows) +
                    initial_log_sigma.index_select(0, first_rows).exp() * input.initial_noise;

  const Tensor frames = to_words(input.x, words), features = word_features->forward(c.single_layer ? frames : word_encoder->forward(frames));
  const ScanOutput out = scan(*this, packed ? std::move(packed) : pack(), features, control, h0,
                              input.posterior_noise.reshape({words * batch, c.latent}), input.replace);
  CellOutput result;
  result.y = from_words(c.single_layer ? out.words : joined(word_decoder->forward(out.words), batch, c), batch, input.x.sizes());
  result.kl = nn::gaussian_kl(out.mu_q, out.sigma_q, out.mu_p, out.sigma_p).reshape({words, batch}).transpose(0, 1);
  result.words = from_words(out.words, batch, {batch, words, c.decoded()});
  return result;
}

}  // namespace mocap::motion_cell
