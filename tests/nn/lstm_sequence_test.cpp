#include "libmodels/nn/lstm_sequence.hpp"

#include <gtest/gtest.h>

#include "libmocap/base/error.hpp"
#include "libmodels/nn/mlp.hpp"
#include "tests/nn/gradient_check.hpp"

namespace mocap::nn {
namespace {

using torch::Tensor;

Tensor noise(at::IntArrayRef sizes, std::uint64_t stream) {
  Random random(5, stream);
  return normal_tensor(sizes, random).to(torch::kDouble);
}

LstmCell double_cell(int in, int hidden, bool sees_memory) {
  Random random(1, 2);
  LstmCell cell(in, hidden, random, sees_memory);
  cell.to(torch::kDouble);
  return cell;
}

// Eq. 27 word for word, one vector at a time.
Tensor by_definition(const LstmCell& cell, const Tensor& x, const Tensor& s0, bool sees_memory) {
  const std::int64_t b = s0.size(0), h = cell.hidden();
  Tensor hidden = s0.narrow(1, 0, h), memory = s0.narrow(1, h, h);
  std::vector<Tensor> out;
  for (std::int64_t r = 0; r < x.size(0); r += b) {
    const Tensor seen = sees_memory ? torch::cat({hidden, memory}, 1) : hidden;
    const auto gates = (x.narrow(0, r, b).matmul(cell.weight_ih.t()) + seen.matmul(cell.weight_hh.t()) + cell.bias).chunk(4, 1);
    memory = gates[1].sigmoid() * memory + gates[0].sigmoid() * gates[2].tanh();
    hidden = gates[3].sigmoid() * memory.tanh();
    out.push_back(torch::cat({hidden, memory}, 1));
  }
  return torch::cat(out);
}

class Cells : public testing::TestWithParam<bool> {};

TEST_P(Cells, SequencesAndGradientsFollowTheDefinition) {
  const LstmCell cell = double_cell(5, 7, GetParam());
  EXPECT_EQ(cell.weight_hh.size(1), GetParam() ? 14 : 7);
  const Tensor x = noise({12, 5}, 1).set_requires_grad(true), s0 = noise({3, 14}, 2).set_requires_grad(true), weight = noise({12, 14}, 3);
  const Tensor a = lstm_sequence(cell, x, s0), b = by_definition(cell, x, s0, GetParam());
  EXPECT_LT((a - b).abs().max().item<double>(), 1e-14);
  const std::vector<Tensor> inputs{x, s0, cell.weight_ih, cell.weight_hh, cell.bias};
  const auto ga = torch::autograd::grad({(a * weight).sum()}, inputs), gb = torch::autograd::grad({(b * weight).sum()}, inputs);
  for (std::size_t i = 0; i < ga.size(); ++i) EXPECT_LT((ga[i] - gb[i]).abs().max().item<double>(), 1e-13) << i;
  const auto held_fixed = torch::autograd::grad({(lstm_sequence(cell, x, s0) * weight).sum()}, {x, s0});
  for (std::size_t i = 0; i < 2; ++i) EXPECT_TRUE(torch::equal(held_fixed[i], ga[i]));
  EXPECT_TRUE(torch::equal(torch::autograd::grad({(lstm_sequence(cell, x, s0) * weight).sum()}, {cell.weight_hh})[0], ga[3]));
}

TEST_P(Cells, FiniteDifferences) {
  const LstmCell cell = double_cell(3, 4, GetParam());
  const Tensor weight = noise({10, 8}, 3);
  expect_gradients([&](const std::vector<Tensor>& in) { return (lstm_sequence(cell, in[0], in[1]) * weight).sum(); }, {noise({10, 3}, 1), noise({2, 8}, 2)});
}

TEST_P(Cells, PiecesCarryTheState) {
  Random random(3, 1);
  const LstmCell cell(6, 16, random, GetParam());
  const torch::NoGradGuard no_grad;
  const Tensor x = noise({40, 6}, 4).to(torch::kFloat), s0 = noise({2, 32}, 5).to(torch::kFloat);
  const Tensor whole = lstm_sequence(cell, x, s0), first = lstm_sequence(cell, x.narrow(0, 0, 14), s0), rest = lstm_sequence(cell, x.narrow(0, 14, 26), first.narrow(0, 12, 2));
  EXPECT_TRUE(torch::equal(whole, torch::cat({first, rest})));
  // One sequence of the batch alone.
  const Tensor alone = lstm_sequence(cell, x.view({20, 2, 6}).select(1, 1), s0.narrow(0, 1, 1));
  EXPECT_TRUE(torch::equal(whole.view({20, 2, 32}).select(1, 1), alone));
}

INSTANTIATE_TEST_SUITE_P(Both, Cells, testing::Bool(), [](const auto& info) { return info.param ? "SeesMemory" : "Standard"; });

TEST(LstmSequence, EqualsPyTorchs) {
  const LstmCell ours = double_cell(5, 8, false);
  torch::nn::LSTM theirs(5, 8);
  theirs->to(torch::kDouble);
  {
    const torch::NoGradGuard guard;
    for (auto& p : theirs->named_parameters()) p.value().copy_(p.key() == "weight_ih_l0" ? ours.weight_ih : p.key() == "weight_hh_l0" ? ours.weight_hh : p.key() == "bias_ih_l0" ? ours.bias : torch::zeros_like(p.value()));
  }
  const Tensor x = noise({6, 3, 5}, 1), h = noise({3, 8}, 2), c = noise({3, 8}, 3);
  const auto [out, last] = theirs->forward(x, std::make_tuple(h.unsqueeze(0), c.unsqueeze(0)));
  const Tensor states = lstm_sequence(ours, x.view({18, 5}), torch::cat({h, c}, 1));
  EXPECT_LT((states.narrow(1, 0, 8).reshape({6, 3, 8}) - out).abs().max().item<double>(), 1e-14);
  EXPECT_LT((states.narrow(0, 15, 3).narrow(1, 8, 8) - std::get<1>(last)[0]).abs().max().item<double>(), 1e-14);
}

TEST(LstmSequence, ShapesAreChecked) {
  const LstmCell cell = double_cell(5, 7, false);
  EXPECT_THROW(lstm_sequence(cell, noise({12, 4}, 1), noise({3, 14}, 2)), Error);
  EXPECT_THROW(lstm_sequence(cell, noise({12, 5}, 1), noise({3, 13}, 2)), Error);
  EXPECT_THROW(lstm_sequence(cell, noise({11, 5}, 1), noise({3, 14}, 2)), Error);
}

}  // namespace
}  // namespace mocap::nn
