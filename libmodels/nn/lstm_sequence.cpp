#include "libmodels/nn/lstm_sequence.hpp"

#include <fmt/format.h>

#include "libmocap/base/error.hpp"
#include "libmodels/nn/mlp.hpp"

namespace mocap::nn {
namespace {

using torch::Tensor;
using torch::autograd::AutogradContext;
using torch::autograd::variable_list;

struct Kept {
  std::shared_ptr<const PackedLstmCell> cell;
  std::int64_t batch = 0;
  Tensor x, states, gates;  // (R, in), (B + R, 2H): s0 first, (R, 4H)
};

template <class T>
T* row(const Tensor& t, std::int64_t r) {
  return t.data_ptr<T>() + r * t.stride(0);
}

template <class T>
void forward(Kept& k, const Tensor& s0) {
  const PackedLstm<T>& cell = k.cell->template as<T>();
  const std::int64_t R = k.x.size(0), H = cell.hidden();
  const int B = static_cast<int>(k.batch);
  k.states = at::empty({R + B, 2 * H}, k.x.options());
  k.gates = at::empty({R, 4 * H}, k.x.options());
  k.states.narrow(0, 0, B).copy_(s0);
  cell.input.forward(static_cast<int>(R), view<T>(k.x), view<T>(k.gates));
  const View<T> states = view<T>(k.states);
  for (std::int64_t r = 0; r < R; r += B) {
    const View<T> s = states.from_row(r), next = states.from_row(r + B);
    cell.advance(B, s, s.from_column(H), next, next.from_column(H), row<T>(k.gates, r));
  }
}

// Gradients of x, s0, W_ih, W_hh, bias; the last three only if asked for.
template <class T>
variable_list backward(const Kept& k, const Tensor& grad, bool weights) {
  const PackedLstm<T>& cell = k.cell->template as<T>();
  const std::int64_t R = k.x.size(0), H = cell.hidden(), in = k.x.size(1), seen = cell.state.in();
  const int B = static_cast<int>(k.batch);
  const Tensor ds = at::zeros({B, 2 * H}, k.x.options()), d = at::empty_like(k.gates), dx = at::empty_like(k.x);
  const View<T> states = view<T>(k.states), dstate = view<T>(ds);
  for (std::int64_t r = R - B; r >= 0; r -= B) {
    ds.add_(grad.narrow(0, r, B));
    cell.retreat(B, row<T>(k.gates, r), states.from_row(r).from_column(H), states.from_row(r + B).from_column(H), dstate, dstate.from_column(H), row<T>(d, r));
  }
  cell.input.backward(static_cast<int>(R), view<T>(d), view<T>(dx));
  if (!weights) return {dx, ds, Tensor(), Tensor(), Tensor()};
  const Tensor dw_ih = at::empty({4 * H, in}, k.x.options()), dw_hh = at::empty({4 * H, seen}, k.x.options()), db = at::empty({4 * H}, k.x.options());
  lstm_weight_gradients<T>(static_cast<int>(R), static_cast<int>(H), static_cast<int>(in), static_cast<int>(seen), d.data_ptr<T>(), view<T>(k.x), states, dw_ih.data_ptr<T>(), dw_hh.data_ptr<T>(), db.data_ptr<T>());
  return {dx, ds, dw_ih, dw_hh, db};
}

struct LstmSequence : torch::autograd::Function<LstmSequence> {
  // The parameters tell autograd what the result depends on; their values are read from the packed copy.
  static Tensor forward(AutogradContext* ctx, const Tensor& x, const Tensor& s0, const Tensor&, const Tensor&, const Tensor&, std::shared_ptr<const PackedLstmCell> packed) {
    auto tape = c10::make_intrusive<Tape<Kept>>();
    Kept& k = tape->kept;
    k.cell = std::move(packed);
    k.batch = s0.size(0);
    k.x = x.detach().contiguous();
    if (k.x.scalar_type() == torch::kDouble)
      nn::forward<double>(k, s0.detach());
    else
      nn::forward<float>(k, s0.detach());
    ctx->saved_data["tape"] = c10::IValue::make_capsule(tape);
    return k.states.narrow(0, k.batch, k.x.size(0)).variable_data();
  }

  static variable_list backward(AutogradContext* ctx, variable_list grads) {
    const auto holder = ctx->saved_data["tape"].toCapsule();
    const Kept& k = static_cast<const Tape<Kept>&>(*holder).kept;
    const bool weights = ctx->needs_input_grad({torch::autograd::IndexRange{2, 5}});  // not where a network is held fixed and only looked through
    variable_list out = k.x.scalar_type() == torch::kDouble ? nn::backward<double>(k, grads[0], weights) : nn::backward<float>(k, grads[0], weights);
    out.emplace_back();  // packed
    return out;
  }
};

}  // namespace

PackedLstmCell::PackedLstmCell(const LstmCell& cell, bool training) {
  if (cell.weight_ih.scalar_type() == torch::kDouble)
    double_ = std::make_unique<PackedLstm<double>>(cell.pack<double>(training));
  else
    single_ = std::make_unique<PackedLstm<float>>(cell.pack<float>(training));
}
template <>
const PackedLstm<float>& PackedLstmCell::as() const {
  return *single_;
}
template <>
const PackedLstm<double>& PackedLstmCell::as() const {
  return *double_;
}

Tensor lstm_sequence(const LstmCell& cell, const Tensor& x, const Tensor& s0, std::shared_ptr<const PackedLstmCell> packed) {
  if (x.dim() != 2 || s0.dim() != 2 || s0.size(1) != 2 * cell.hidden() || x.size(1) != cell.in() || s0.size(0) < 1 || x.size(0) % s0.size(0) != 0)
    throw Error(Exit::internal, {}, fmt::format("lstm: x of {} and state of {} values, expected rows of {} and {}, a multiple of the state's", x.numel(), s0.numel(), cell.in(), 2 * cell.hidden()));
  if (!packed) packed = std::make_shared<PackedLstmCell>(cell);
  return LstmSequence::apply(x, s0, cell.weight_ih, cell.weight_hh, cell.bias, std::move(packed));
}

}  // namespace mocap::nn
