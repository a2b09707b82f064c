#include "libmodels/nn/gru.hpp"

#include <cmath>

#include "libmodels/nn/mlp.hpp"

namespace mocap::nn {
namespace {

using torch::Tensor;
using torch::autograd::AutogradContext;
using torch::autograd::variable_list;

template <class T>
PackedGru<T> packed(const Tensor& w_ih, const Tensor& w_hh, const Tensor& b_ih, const Tensor& b_hh, bool training) {
  PackedGru<T> gru;
  gru.pack(w_ih.contiguous().data_ptr<T>(), w_hh.contiguous().data_ptr<T>(), b_ih.data_ptr<T>(), b_hh.data_ptr<T>(),
           static_cast<int>(w_hh.size(1)), static_cast<int>(w_ih.size(1)), training);
  return gru;
}

template <class T>
struct Kept {
  PackedGru<T> gru;
  Tensor x, h, gates;
};

struct GruFunction : torch::autograd::Function<GruFunction> {
  static Tensor forward(AutogradContext* ctx, const Tensor& x, const Tensor& h, const Tensor& w_ih, const Tensor& w_hh,
                        const Tensor& b_ih, const Tensor& b_hh) {
    return x.scalar_type() == torch::kDouble ? run<double>(ctx, x, h, w_ih, w_hh, b_ih, b_hh)
                                             : run<float>(ctx, x, h, w_ih, w_hh, b_ih, b_hh);
  }

  template <class T>
  static Tensor run(AutogradContext* ctx, const Tensor& x, const Tensor& h, const Tensor& w_ih, const Tensor& w_hh,
                    const Tensor& b_ih, const Tensor& b_hh) {
    auto tape = c10::make_intrusive<Tape<Kept<T>>>();
    Kept<T>& k = tape->kept;
    k.gru = packed<T>(w_ih, w_hh, b_ih, b_hh, true);
    k.x = x.detach().contiguous();
    k.h = h.detach().contiguous();
    const std::int64_t rows = x.size(0), hidden = h.size(1);
    k.gates = at::empty({rows, 4 * hidden}, k.x.options());
    const Tensor scratch = at::empty({rows, 6 * hidden}, k.x.options()), next = at::empty_like(k.h);
    k.gru.forward(static_cast<int>(rows), view<T>(k.x), view<T>(k.h), view<T>(next), k.gates.template data_ptr<T>(),
                  scratch.data_ptr<T>());
    ctx->saved_data["tape"] = c10::IValue::make_capsule(tape);
    ctx->saved_data["double"] = std::is_same_v<T, double>;
    return next;
  }

  static variable_list backward(AutogradContext* ctx, variable_list grads) {
    return ctx->saved_data["double"].toBool() ? back<double>(ctx, grads[0]) : back<float>(ctx, grads[0]);
  }

  template <class T>
  static variable_list back(AutogradContext* ctx, const Tensor& dy) {
    const auto holder = ctx->saved_data["tape"].toCapsule();
    const Kept<T>& k = static_cast<const Tape<Kept<T>>&>(*holder).kept;
    const int rows = static_cast<int>(k.x.size(0)), in = static_cast<int>(k.x.size(1)), hidden = k.gru.hidden();
    const Tensor dh = dy.clone(at::MemoryFormat::Contiguous), d = at::empty_like(k.gates), dx = at::empty_like(k.x);
    k.gru.backward(rows, k.gates.template data_ptr<T>(), view<T>(k.h), view<T>(dh), d.data_ptr<T>(), view<T>(dx),
                   Start::zero);
    const auto empty = [&](at::IntArrayRef sizes) { return at::empty(sizes, k.x.options()); };
    const Tensor dw_ih = empty({3 * hidden, in}), dw_hh = empty({3 * hidden, hidden}), db_ih = empty({3 * hidden}),
                 db_hh = empty({3 * hidden});
    gru_weight_gradients<T>(rows, hidden, in, d.data_ptr<T>(), view<T>(k.x), view<T>(k.h), dw_ih.data_ptr<T>(),
                            dw_hh.data_ptr<T>(), db_ih.data_ptr<T>(), db_hh.data_ptr<T>());
    return {dx, dh, dw_ih, dw_hh, db_ih, db_hh};
  }
};

}  // namespace

GruCell::GruCell(int in, int hidden, Random& random) {
  const double bound = 1 / std::sqrt(static_cast<double>(hidden));
  weight_ih = register_parameter("weight_ih", uniform_tensor({3 * hidden, in}, bound, random));
  weight_hh = register_parameter("weight_hh", uniform_tensor({3 * hidden, hidden}, bound, random));
  bias_ih = register_parameter("bias_ih", uniform_tensor({3 * hidden}, bound, random));
  bias_hh = register_parameter("bias_hh", uniform_tensor({3 * hidden}, bound, random));
}

Tensor GruCell::forward(const Tensor& x, const Tensor& h) const {
  return GruFunction::apply(x, h, weight_ih, weight_hh, bias_ih, bias_hh);
}

template <class T>
PackedGru<T> GruCell::pack(bool training) const {
  return packed<T>(weight_ih, weight_hh, bias_ih, bias_hh, training);
}
template PackedGru<float> GruCell::pack(bool) const;
template PackedGru<double> GruCell::pack(bool) const;

}  // namespace mocap::nn
