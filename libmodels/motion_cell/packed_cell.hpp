// The cell's weights laid out for the hand-written recurrent passes (scan.hpp, sampler.hpp).
//
// The first layers of the posterior, prior and decoder networks all read h_{n-1} and a: side by side they form one
// product with the state. Columns: posterior mu and sigma (training only), prior mu and sigma, decoder; `width` each.
#pragma once
#include <memory>

#include "libmodels/motion_cell/network.hpp"

namespace mocap::motion_cell {

template <class T>
struct CellWeights {
  int hidden = 0, width = 0, word = 0, latent = 0, control = 0;
  nn::PackedLinear<T> first_state;     // h -> 5 width, or 3
  nn::PackedLinear<T> first_control;   // a -> the same, with the first layers' biases
  nn::PackedLinear<T> posterior_word;  // f_w(w) -> 2 width
  nn::PackedLinear<T> decoder_latent;  // f_z(z) -> width
  nn::PackedMlp<T> posterior_mu, posterior_sigma, prior_mu, prior_sigma, decoder;  // from the second layer on
  nn::PackedMlp<T> word_features, latent_features;
  nn::PackedMlp<T> word_decoder, control_features;  // for the sampler; word_decoder without layers where words are frames
  nn::PackedGru<T> gru_1, gru_2;                    // gru_1 reads [f_w(w), f_z(z)]

  CellWeights(const MotionCell& cell, bool training);
};

class PackedCell {
 public:
  std::unique_ptr<const CellWeights<float>> single;  // one of the two, by the parameters' type
  std::unique_ptr<const CellWeights<double>> double_;
  template <class T>
  const CellWeights<T>& as() const {
    if constexpr (std::is_same_v<T, float>)
      return *single;
    else
      return *double_;
  }
};

}  // namespace mocap::motion_cell
