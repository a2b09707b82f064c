// The recurrent part of the Motion Cell's training pass as one autograd function with a hand-written backward pass.
//
// Products with h_{n-1} of all first layers are one product; prior networks (and the decoder under teacher forcing) run
// over all words at once after the recurrence; every weight gradient is one product over all N B rows after the
// backward recurrence. Algorithm 1 step by step, in plain operations, is the oracle in tests/motion_cell.
#pragma once
#include <torch/torch.h>

#include <memory>

#include "libmodels/motion_cell/network.hpp"

namespace mocap::motion_cell {

struct ScanOutput {
  torch::Tensor words, mu_q, sigma_q, mu_p, sigma_p;  // (N B, decoded()), 4 x (N B, latent)
};

// Rows are time-major: row n B + b is word n of clip b.
// word_features  (N B, word): f_w(w).   control (B or N B, control): a.   h0 (B, 2 hidden).
// noise          (N B, latent).         replace (N, B) bool or undefined.
ScanOutput scan(const MotionCell& cell, std::shared_ptr<const PackedCell> packed, const torch::Tensor& word_features,
                const torch::Tensor& control, const torch::Tensor& h0, const torch::Tensor& noise,
                const torch::Tensor& replace);

}  // namespace mocap::motion_cell
