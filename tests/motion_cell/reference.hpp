// Algorithm 1 of Ghorbani et al. 2020 word by word in plain LibTorch operations: the oracle of the hand-written scan.
#pragma once
#include <torch/torch.h>

#include <vector>

#include "libmocap/base/random.hpp"
#include "libmodels/motion_cell/network.hpp"
#include "libmodels/nn/mlp.hpp"

namespace mocap::motion_cell {

inline torch::Tensor plain(const nn::Mlp& mlp, torch::Tensor x) {
  for (int i = 0; i < mlp.layer_count(); ++i) {
    x = torch::linear(x, mlp.weight(i), mlp.bias(i));
    if (i + 1 < mlp.layer_count() || mlp.activate_last()) x = torch::elu(x);
  }
  return x;
}

inline torch::Tensor plain(const nn::GruCell& g, const torch::Tensor& x, const torch::Tensor& h) {
  return torch::gru_cell(x, h, g.weight_ih, g.weight_hh, g.bias_ih, g.bias_hh);
}

inline CellOutput reference_forward(const MotionCell& cell, const CellInput& in) {
  const MotionCellConfig& c = cell.config();
  const std::int64_t batch = in.x.size(0), words = in.x.size(1) / c.word_length;
  const auto type = in.x.scalar_type();
  const auto classes_at = [&](std::int64_t n) { return in.classes.dim() == 3 ? in.classes.select(1, n) : in.classes; };
  torch::Tensor row = torch::zeros({batch}, torch::kLong);
  for (std::size_t i = 0; i < c.attribute_classes.size(); ++i)
    row = row * c.attribute_classes[i] + classes_at(0).select(1, static_cast<std::int64_t>(i));
  torch::Tensor h = cell.initial_mu.index({row}) + cell.initial_log_sigma.index({row}).exp() * in.initial_noise;

  std::vector<torch::Tensor> ys, kls, ws;
  torch::Tensor ahead;
  for (std::int64_t n = 0; n < words; ++n) {
    std::vector<torch::Tensor> parts;
    for (std::size_t i = 0; i < c.attribute_classes.size(); ++i)
      parts.push_back(
          torch::one_hot(classes_at(n).select(1, static_cast<std::int64_t>(i)), c.attribute_classes[i]).to(type));
    const torch::Tensor a = plain(*cell.control_features, torch::cat(parts, 1));
    torch::Tensor w = in.x.slice(1, n * c.word_length, (n + 1) * c.word_length).reshape({batch, -1});
    if (!c.single_layer) w = plain(*cell.word_encoder, w);
    torch::Tensor f = plain(*cell.word_features, w);
    const torch::Tensor fha = torch::cat({f, h, a}, 1), ha = torch::cat({h, a}, 1);
    const auto sigma = [](const torch::Tensor& s) { return torch::log(1 + torch::exp(s)) + kSigmaFloor; };
    const torch::Tensor mu_q = plain(*cell.posterior_mu, fha), sigma_q = sigma(plain(*cell.posterior_sigma, fha));
    const torch::Tensor mu_p = plain(*cell.prior_mu, ha), sigma_p = sigma(plain(*cell.prior_sigma, ha));
    const torch::Tensor z = plain(*cell.latent_features, mu_q + sigma_q * in.posterior_noise[n]);
    const torch::Tensor own = plain(*cell.decoder, torch::cat({z, h, a}, 1));
    if (in.replace.defined()) f = torch::where(in.replace[n].unsqueeze(1), plain(*cell.word_features, own), f);
    const torch::Tensor h1 = plain(*cell.gru_1, torch::cat({f, z}, 1), h.slice(1, 0, c.hidden));
    h = torch::cat({h1, plain(*cell.gru_2, h1, h.slice(1, c.hidden))}, 1);
    const torch::Tensor written = (c.single_layer ? own : plain(*cell.word_decoder, own)).reshape({batch, c.word_length + c.overlap, -1});
    torch::Tensor y = written.narrow(1, 0, c.word_length).clone();
    for (int k = 0; k < c.overlap && n > 0; ++k) {
      const double u = (k + 1.0) / (c.overlap + 1);
      y = torch::cat({y.narrow(1, 0, k), (u * written.narrow(1, k, 1) + (1 - u) * ahead.narrow(1, k, 1)), y.narrow(1, k + 1, c.word_length - k - 1)}, 1);
    }
    ahead = written.narrow(1, c.word_length, c.overlap);
    ys.push_back(y);
    ws.push_back(own);
    const torch::Tensor kl =
        torch::log(sigma_p / sigma_q) + (sigma_q.square() + (mu_q - mu_p).square()) / (2 * sigma_p.square()) - 0.5;
    kls.push_back(kl.sum(1));
  }
  return {torch::cat(ys, 1), torch::stack(kls, 1), torch::stack(ws, 1)};
}

// Random inputs for a cell; replace_share < 0: teacher forcing.
inline CellInput random_input(const MotionCellConfig& c, std::int64_t batch, std::int64_t words, double replace_share,
                              bool changing = false, torch::ScalarType type = torch::kFloat) {
  Random random(11, 1);
  CellInput in;
  in.x = nn::normal_tensor({batch, words * c.word_length, c.features()}, random).to(type);
  std::vector<torch::Tensor> classes;
  for (const int count : c.attribute_classes) {
    torch::Tensor t = torch::empty(
        changing ? std::vector<std::int64_t>{batch, words} : std::vector<std::int64_t>{batch}, torch::kLong);
    for (std::int64_t i = 0; i < t.numel(); ++i)
      t.data_ptr<std::int64_t>()[i] = static_cast<std::int64_t>(random.below(count));
    classes.push_back(t);
  }
  in.classes = torch::stack(classes, -1);
  in.posterior_noise = nn::normal_tensor({words, batch, c.latent}, random).to(type);
  in.initial_noise = nn::normal_tensor({batch, 2 * c.hidden}, random).to(type);
  if (replace_share >= 0) {
    in.replace = torch::empty({words, batch}, torch::kBool);
    for (std::int64_t i = 0; i < in.replace.numel(); ++i)
      in.replace.data_ptr<bool>()[i] = random.uniform() < replace_share;
  }
  return in;
}

}  // namespace mocap::motion_cell
