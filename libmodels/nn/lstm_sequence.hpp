// An LSTM over whole sequences, as a differentiable operation: what the models whose inputs are known beforehand are made of.
#pragma once
#include <torch/torch.h>

#include <memory>

#include "libmodels/nn/lstm.hpp"

namespace mocap::nn {

// The weights of a cell laid out for the recurrence, float or double as they are. Immutable: shared by the shards of a step.
class PackedLstmCell {
 public:
  explicit PackedLstmCell(const LstmCell& cell, bool training = true);
  template <class T>
  const PackedLstm<T>& as() const;

 private:
  std::unique_ptr<PackedLstm<float>> single_;
  std::unique_ptr<PackedLstm<double>> double_;
};

// x (T B, in): frame t of sequence b in row t B + b. s0 (B, 2H): h, then c, before frame 0. -> (T B, 2H): h, then c, after every frame.
// Differentiable once with respect to x, s0 and the cell's parameters; `packed`: of the cell since its parameters last changed.
// On the caller's thread; a sequence's states do not depend on the others, and are the same bits on any x86-64 processor with fused multiply-add.
// Cost: 2 T B (in + H) 4H flop forward (2H where the gates see the memory), twice that backward. Error(internal) where shapes disagree.
torch::Tensor lstm_sequence(const LstmCell& cell, const torch::Tensor& x, const torch::Tensor& s0, std::shared_ptr<const PackedLstmCell> packed = nullptr);

}  // namespace mocap::nn
