#include "libmodels/baselines/scan.hpp"

#include <algorithm>

#include "libmodels/baselines/packed_network.hpp"

namespace mocap::baselines {
namespace {

using nn::Start;
using nn::View;
using nn::view;
using nn::views;
using torch::Tensor;
using torch::autograd::AutogradContext;
using torch::autograd::variable_list;

// Everything the backward pass reads. R = T B rows.
struct Kept {
  std::shared_ptr<const PackedNetwork> weights;
  std::int64_t frames = 0, batch = 0;
  Tensor input;                           // (R, D + A): u and the one-hots
  std::vector<Tensor> encoded, decoded;   // outputs of the layers
  Tensor state;                           // (R + B, state)
  Tensor gates_1, gates_2;                // (R, 4 hidden)
  Tensor y;                               // (R, D)
  Tensor replace;                         // (R) bool or undefined
};

template <class T>
T* row(const Tensor& t, std::int64_t r) {
  return t.data_ptr<T>() + r * t.stride(0);
}

template <class T>
class Scan {
 public:
  explicit Scan(Kept& kept) : k(kept), w(kept.weights->template as<T>()), B(static_cast<int>(k.batch)), R(static_cast<int>(k.frames * k.batch)), D(w.features), H(w.hidden) {}

  void forward(const Tensor& x, const Tensor& control, const Tensor& s0, const Tensor& u0, const Tensor& noise) {
    k.input = buffer(R, w.input);
    k.state = buffer(R + B, w.state);
    k.y = buffer(R, D);
    k.encoded = nn::layer_buffers(w.encoder, R);
    k.decoded = nn::layer_buffers(w.decoder, R);
    k.gates_1 = buffer(R, 4 * H);
    k.gates_2 = buffer(R, 4 * H);
    std::copy_n(s0.data_ptr<T>(), s0.numel(), k.state.data_ptr<T>());
    const Tensor scratch = buffer(B, 6 * H);
    const bool changing = control.size(0) == R && k.frames > 1;
    for (std::int64_t t = 0; t < k.frames; ++t) {
      const std::int64_t r = t * B;
      for (int b = 0; b < B; ++b) {
        T* u = row<T>(k.input, r + b);
        if (t == 0)
          std::copy_n(row<T>(u0, b), D, u);
        else if (own(r + b))
          w.feed_back(1, view<T>(k.y).from_row(r + b - B), {u, D});
        else
          std::copy_n(row<T>(x, r + b - B), D, u);
        if (noise.defined()) {
          const T* add = noise.data_ptr<T>() + (r + b) * D;
          for (int c = 0; c < D; ++c) u[c] += add[c];
        }
        std::copy_n(row<T>(control, changing ? r + b : b), w.input - D, u + D);
      }
      w.frame(B, {view<T>(k.input).from_row(r), views<T>(k.encoded, r), view<T>(k.state).from_row(r), view<T>(k.state).from_row(r + B), row<T>(k.gates_1, r), row<T>(k.gates_2, r), scratch.data_ptr<T>(),
                  views<T>(k.decoded, r), view<T>(k.y).from_row(r)});
    }
  }

  // Gradients of s0, u0 and the parameters in the order of layers().
  variable_list backward(const Tensor& grad) {
    const Tensor dy = grad.clone(at::MemoryFormat::Contiguous), d_1 = at::empty_like(k.gates_1), d_2 = at::empty_like(k.gates_2);
    const Tensor du0 = buffer(B, D), ds = at::zeros({B, w.state}, k.state.options()), du = buffer(B, D), dinput = buffer(B, w.input);
    std::vector<Tensor> dencoded, ddecoded;
    for (const Tensor& t : k.encoded) dencoded.push_back(at::empty_like(t));
    for (const Tensor& t : k.decoded) ddecoded.push_back(at::empty_like(t));
    const View<T> state = view<T>(k.state), dstate = view<T>(ds);
    for (std::int64_t t = k.frames; t-- > 0;) {
      const std::int64_t r = t * B;
      w.head_backward(B, view<T>(k.input).from_row(r), views<T>(k.decoded, r).back(), view<T>(dy).from_row(r), views<T>(ddecoded, r).back(), view<T>(du));
      w.decoder.backward(B, views<T>(k.decoded, r), views<T>(ddecoded, r), dstate.from_column(H), Start::accumulate);
      const View<T> s = state.from_row(r), next = state.from_row(r + B), dh_2 = dstate.from_column(H), dx = view<T>(dinput);
      if (w.arch == Arch::erd) {
        const View<T> de = views<T>(dencoded, r).back(), dc_1 = dstate.from_column(2 * H), dc_2 = dstate.from_column(3 * H);
        w.lstm_2.backward(B, row<T>(k.gates_2, r), s.from_column(3 * H), next.from_column(3 * H), dh_2, dc_2, row<T>(d_2, r), dstate, Start::accumulate);
        w.lstm_1.backward(B, row<T>(k.gates_1, r), s.from_column(2 * H), next.from_column(2 * H), dstate, dc_1, row<T>(d_1, r), de, Start::zero);
        w.encoder.backward(B, views<T>(k.encoded, r), views<T>(dencoded, r), dx);
      } else {
        w.gru_2.backward(B, row<T>(k.gates_2, r), s.from_column(H), dh_2, row<T>(d_2, r), dstate, Start::accumulate);
        w.gru_1.backward(B, row<T>(k.gates_1, r), s, dstate, row<T>(d_1, r), dx, Start::zero);
      }
      for (int b = 0; b < B; ++b) {
        T* d = row<T>(du, b);
        const T* through = row<T>(dinput, b);
        for (int c = 0; c < D; ++c) d[c] += through[c];
        if (t == 0)
          std::copy_n(d, D, row<T>(du0, b));
        else if (own(r + b))
          w.feed_back_backward(1, view<T>(k.y).from_row(r + b - B), {d, D}, view<T>(dy).from_row(r + b - B));
      }
    }
    variable_list out{ds, du0};
    const View<T> next = view<T>(k.state).from_row(B);
    if (w.arch == Arch::erd) {
      nn::append_layer_gradients<T>(R, view<T>(k.input), k.encoded, dencoded, w.input, out);
      lstm(d_1, view<T>(k.encoded.back()), static_cast<int>(k.encoded.back().size(1)), state, out);
      lstm(d_2, next, H, state.from_column(H), out);
    } else {
      gru(d_1, view<T>(k.input), w.input, state, out);
      gru(d_2, next, H, state.from_column(H), out);
    }
    nn::append_layer_gradients<T>(R, next.from_column(H), k.decoded, ddecoded, H, out);
    return out;
  }

 private:
  Tensor buffer(std::int64_t rows, std::int64_t columns) const { return at::empty({rows, columns}, at::TensorOptions(c10::CppTypeToScalarType<T>::value)); }
  bool own(std::int64_t r) const { return k.replace.defined() && k.replace.data_ptr<bool>()[r]; }

  void gru(const Tensor& d, View<const T> x, int in, View<const T> h, variable_list& out) const {
    const Tensor dw_ih = buffer(3 * H, in), dw_hh = buffer(3 * H, H), db_ih = at::empty({3 * H}, d.options()), db_hh = at::empty({3 * H}, d.options());
    nn::gru_weight_gradients<T>(R, H, in, d.data_ptr<T>(), x, h, dw_ih.data_ptr<T>(), dw_hh.data_ptr<T>(), db_ih.data_ptr<T>(), db_hh.data_ptr<T>());
    for (const Tensor& t : {dw_ih, dw_hh, db_ih, db_hh}) out.push_back(t);
  }

  void lstm(const Tensor& d, View<const T> x, int in, View<const T> h, variable_list& out) const {
    const Tensor dw_ih = buffer(4 * H, in), dw_hh = buffer(4 * H, H), db = at::empty({4 * H}, d.options());
    nn::lstm_weight_gradients<T>(R, H, in, H, d.data_ptr<T>(), x, h, dw_ih.data_ptr<T>(), dw_hh.data_ptr<T>(), db.data_ptr<T>());
    for (const Tensor& t : {dw_ih, dw_hh, db}) out.push_back(t);
  }

  Kept& k;
  const NetworkWeights<T>& w;
  const int B, R, D, H;
};

struct ScanFunction : torch::autograd::Function<ScanFunction> {
  // `parameters` tell autograd what the result depends on; their values are read from the packed copy.
  static Tensor forward(AutogradContext* ctx, const Tensor& s0, const Tensor& u0, at::TensorList, std::shared_ptr<const PackedNetwork> packed, const Tensor* x, const Tensor* control,
                        const Tensor* noise, const Tensor* replace) {
    auto tape = c10::make_intrusive<nn::Tape<Kept>>();
    Kept& k = tape->kept;
    k.weights = std::move(packed);
    k.batch = s0.size(0);
    k.frames = x->size(0) / k.batch;
    if (replace->defined()) k.replace = replace->to(torch::kBool).reshape({-1}).contiguous();
    const Tensor rows = x->contiguous(), one_hot = control->contiguous(), s = s0.detach().contiguous(), u = u0.detach().contiguous(), add = noise->defined() ? noise->contiguous() : Tensor();
    if (s.scalar_type() == torch::kDouble)
      Scan<double>(k).forward(rows, one_hot, s, u, add);
    else
      Scan<float>(k).forward(rows, one_hot, s, u, add);
    ctx->saved_data["tape"] = c10::IValue::make_capsule(tape);
    return k.y.variable_data();  // a handle of its own: the tape must not own the graph that owns it
  }

  static variable_list backward(AutogradContext* ctx, variable_list grads) {
    const auto holder = ctx->saved_data["tape"].toCapsule();
    Kept& k = static_cast<nn::Tape<Kept>&>(*holder).kept;
    variable_list out = k.y.scalar_type() == torch::kDouble ? Scan<double>(k).backward(grads[0]) : Scan<float>(k).backward(grads[0]);
    out.resize(out.size() + 5);  // packed, x, control, noise, replace have no gradient
    return out;
  }
};

}  // namespace

Tensor scan(const Network& n, std::shared_ptr<const PackedNetwork> packed, const Tensor& x, const Tensor& control, const Tensor& s0, const Tensor& u0, const Tensor& noise, const Tensor& replace) {
  // The order in which Scan::backward returns their gradients.
  std::vector<Tensor> parameters;
  const auto add = [&](const nn::Mlp& mlp) {
    for (const Tensor& p : mlp.interleaved_parameters()) parameters.push_back(p);
  };
  if (n.config().arch == Arch::erd) {
    add(*n.encoder);
    for (const auto& cell : {n.lstm_1, n.lstm_2})
      for (const Tensor& p : {cell->weight_ih, cell->weight_hh, cell->bias}) parameters.push_back(p);
  } else {
    for (const auto& cell : {n.gru_1, n.gru_2})
      for (const Tensor& p : {cell->weight_ih, cell->weight_hh, cell->bias_ih, cell->bias_hh}) parameters.push_back(p);
  }
  add(*n.decoder);
  return ScanFunction::apply(s0, u0, at::TensorList(parameters), std::move(packed), &x, &control, &noise, &replace);
}

}  // namespace mocap::baselines
