#include "libmodels/motion_cell/packed_cell.hpp"

namespace mocap::motion_cell {

template <class T>
CellWeights<T>::CellWeights(const MotionCell& cell, bool training) {
  const torch::NoGradGuard guard;
  const MotionCellConfig& c = cell.config();
  hidden = c.hidden, width = c.width, word = c.word, latent = c.latent, control = c.control;
  const std::int64_t state = 2 * hidden;
  // Columns of each first layer's input: [f_w(w), h, a], [h, a], [f_z(z), h, a].
  const auto cut = [](const nn::Mlp& mlp, std::int64_t first, std::int64_t count) {
    return mlp.weight(0).narrow(1, first, count);
  };
  const nn::Mlp &qm = *cell.posterior_mu, &qs = *cell.posterior_sigma, &pm = *cell.prior_mu, &ps = *cell.prior_sigma,
                &dec = *cell.decoder;
  const auto pack = [&](nn::PackedLinear<T>& linear, const torch::Tensor& weight, const torch::Tensor& bias) {
    const torch::Tensor w = weight.contiguous();
    linear.pack(w.data_ptr<T>(), w.size(1), static_cast<int>(w.size(0)), static_cast<int>(w.size(1)),
                bias.defined() ? bias.data_ptr<T>() : nullptr, training);
  };
  const std::int64_t e = word;
  std::vector<torch::Tensor> by_state, by_control, biases;
  const auto beside = [&](const nn::Mlp& mlp, std::int64_t skip) {
    by_state.push_back(cut(mlp, skip, state));
    by_control.push_back(cut(mlp, skip + state, control));
    biases.push_back(mlp.bias(0));
  };
  if (training) {
    beside(qm, e);
    beside(qs, e);
    pack(posterior_word, torch::cat({cut(qm, 0, e), cut(qs, 0, e)}), {});
    posterior_mu = qm.pack<T>(1, true);
    posterior_sigma = qs.pack<T>(1, true);
  }
  beside(pm, 0);
  beside(ps, 0);
  beside(dec, e);
  pack(first_state, torch::cat(by_state), {});
  pack(first_control, torch::cat(by_control), torch::cat(biases));
  pack(decoder_latent, cut(dec, 0, e), {});
  prior_mu = pm.pack<T>(1, training);
  prior_sigma = ps.pack<T>(1, training);
  decoder = dec.pack<T>(1, training);
  word_features = cell.word_features->pack<T>(0, training);
  latent_features = cell.latent_features->pack<T>(0, training);
  if (!training) {
    if (cell.word_decoder) word_decoder = cell.word_decoder->pack<T>(0, false);
    control_features = cell.control_features->pack<T>(0, false);
  }
  gru_1 = cell.gru_1->pack<T>(training);
  gru_2 = cell.gru_2->pack<T>(training);
}

template struct CellWeights<float>;
template struct CellWeights<double>;

}  // namespace mocap::motion_cell
