#include "libmodels/motion_cell/scan.hpp"

#include <algorithm>
#include <utility>

#include "libmodels/motion_cell/packed_cell.hpp"
#include "libmodels/nn/pointwise.hpp"

namespace mocap::motion_cell {
namespace {

using nn::Start;
using nn::View;
using nn::view;
using nn::views;
using torch::Tensor;
using torch::autograd::AutogradContext;
using torch::autograd::variable_list;

// Everything the backward pass reads. R = N B rows.
struct Kept {
  std::shared_ptr<const PackedCell> weights;
  std::int64_t words = 0, batch = 0;
  Tensor word_features, control, noise;             // inputs
  Tensor replace;                                   // (R) 0 or 1, or undefined
  Tensor h;                                         // (N + 1) B rows of both states
  Tensor first;                                     // (R, 5 width) first layers, activated
  std::vector<Tensor> qm, qs, pm, ps, dec, fz, fw;  // further layers; the last of qs, ps is before the softplus
  Tensor sigma_q, sigma_p, z;
  Tensor cell_input;        // (R, 2 word): [f_w, f_z(z)]
  Tensor gates_1, gates_2;  // (R, 4 hidden)
};

template <class T>
T* row(const Tensor& t, std::int64_t r) {
  return t.data_ptr<T>() + r * t.stride(0);
}

template <class T>
class Scan {
 public:
  explicit Scan(Kept& kept)
      : k(kept),
        w(kept.weights->template as<T>()),
        B(static_cast<int>(k.batch)),
        R(static_cast<int>(k.words * k.batch)),
        P(w.width),
        H(w.hidden) {}

  void forward(const Tensor& h0) {
    allocate();
    std::copy_n(h0.data_ptr<T>(), h0.numel(), k.h.data_ptr<T>());
    const View<T> first = view<T>(k.first), h = view<T>(k.h);
    start_first_layers();
    w.posterior_word.forward(R, view<T>(k.word_features), first, Start::accumulate);
    const Tensor scratch = buffer(B, 6 * H);
    for (std::int64_t n = 0; n < k.words; ++n) {
      const std::int64_t r = n * B;
      const View<T> first_n = first.from_row(r), h_n = h.from_row(r), h_next = h.from_row(r + B);
      w.first_state.forward(B, h_n, first_n, Start::accumulate);
      nn::elu(B, 4 * P, first_n.data, first_n.ld);
      w.posterior_mu.forward(B, first_n, views<T>(k.qm, r));
      w.posterior_sigma.forward(B, first_n.from_column(P), views<T>(k.qs, r));
      reparameterize(r);
      w.latent_features.forward(B, view<T>(k.z).from_row(r), views<T>(k.fz, r));
      w.decoder_latent.forward(B, view<T>(k.fz.back()).from_row(r), first_n.from_column(4 * P), Start::accumulate);
      if (k.replace.defined()) {
        decode(r, B);
        w.word_features.forward(B, view<T>(k.dec.back()).from_row(r), views<T>(k.fw, r));
        put_replaced_features(r);
      }
      w.gru_1.forward(B, view<T>(k.cell_input).from_row(r), h_n, h_next, row<T>(k.gates_1, r), scratch.data_ptr<T>());
      w.gru_2.forward(B, h_next, h_n.from_column(H), h_next.from_column(H), row<T>(k.gates_2, r),
                      scratch.data_ptr<T>());
    }
    if (!k.replace.defined()) decode(0, R);
    w.prior_mu.forward(R, first.from_column(2 * P), views<T>(k.pm));
    w.prior_sigma.forward(R, first.from_column(3 * P), views<T>(k.ps));
    nn::softplus<T>(k.sigma_p.numel(), k.ps.back().data_ptr<T>(), kFloor, k.sigma_p.data_ptr<T>());
  }

  // Gradients in the order of the arguments of ScanFunction::forward.
  variable_list backward(const variable_list& grads) {
    Gradients g(*this);
    const View<T> first = view<T>(k.first), dfirst = view<T>(g.first), h = view<T>(k.h);
    g.dec.back().copy_(grads[0]);
    Tensor dmu_q = grads[1].contiguous(), dsigma_q = grads[2].contiguous();
    g.pm.back().copy_(grads[3]);
    g.ps.back().copy_(grads[4]);

    nn::softplus_backward<T>(k.sigma_p.numel(), k.sigma_p.data_ptr<T>(), kFloor, row<T>(g.ps.back(), 0));
    w.prior_mu.backward(R, views<T>(k.pm), views<T>(g.pm), dfirst.from_column(2 * P));
    w.prior_sigma.backward(R, views<T>(k.ps), views<T>(g.ps), dfirst.from_column(3 * P));
    if (!k.replace.defined()) decode_backward(g, 0, R);

    for (std::int64_t n = k.words; n-- > 0;) {
      const std::int64_t r = n * B;
      const View<T> h_n = h.from_row(r), dfirst_n = dfirst.from_row(r), dh = view<T>(g.h),
                    dinput = view<T>(g.cell_input);
      w.gru_2.backward(B, row<T>(k.gates_2, r), h_n.from_column(H), dh.from_column(H), row<T>(g.gates_2, r), dh,
                       Start::accumulate);
      w.gru_1.backward(B, row<T>(k.gates_1, r), h_n, dh, row<T>(g.gates_1, r), dinput, Start::zero);
      split_feature_gradient(g, r);
      if (k.replace.defined()) {
        w.word_features.backward(B, views<T>(k.fw, r), views<T>(g.fw, r), view<T>(g.dec.back()).from_row(r),
                                 Start::accumulate);
        decode_backward(g, r, B);
      }
      const View<T> dfz = view<T>(g.fz.back()).from_row(r), dz = view<T>(g.z);
      copy_rows(B, w.word, dinput.from_column(w.word), dfz);
      w.decoder_latent.backward(B, dfirst_n.from_column(4 * P), dfz, Start::accumulate);
      w.latent_features.backward(B, views<T>(k.fz, r), views<T>(g.fz, r), dz);
      reparameterize_backward(g, r, row<T>(dmu_q, r), row<T>(dsigma_q, r));
      w.posterior_mu.backward(B, views<T>(k.qm, r), views<T>(g.qm, r), dfirst_n);
      w.posterior_sigma.backward(B, views<T>(k.qs, r), views<T>(g.qs, r), dfirst_n.from_column(P));
      nn::elu_backward<T>(B, 4 * P, first.from_row(r).data, first.ld, dfirst_n.data, dfirst_n.ld);
      w.first_state.backward(B, dfirst_n, dh, Start::accumulate);
    }
    w.posterior_word.backward(R, dfirst, view<T>(g.word_features), Start::accumulate);
    return collect(g);
  }

 private:
  static constexpr T kFloor = static_cast<T>(kSigmaFloor);

  struct Gradients {
    Tensor word_features, h, first, z, cell_input, gates_1, gates_2;
    std::vector<Tensor> qm, qs, pm, ps, dec, fz, fw;
    explicit Gradients(const Scan& s)
        : word_features(at::empty_like(s.k.word_features)),
          h(at::zeros({s.B, 2 * s.H}, s.k.h.options())),
          first(at::empty_like(s.k.first)),
          z(s.buffer(s.B, s.w.latent)),
          cell_input(s.buffer(s.B, 2 * s.w.word)),
          gates_1(at::empty_like(s.k.gates_1)),
          gates_2(at::empty_like(s.k.gates_2)),
          qm(like(s.k.qm)),
          qs(like(s.k.qs)),
          pm(like(s.k.pm)),
          ps(like(s.k.ps)),
          dec(like(s.k.dec)),
          fw(like(s.k.fw)) {
      for (const Tensor& t : s.k.fz) fz.push_back(at::empty(t.sizes(), t.options()));
    }
    static std::vector<Tensor> like(const std::vector<Tensor>& tensors) {
      std::vector<Tensor> all;
      for (const Tensor& t : tensors) all.push_back(at::empty_like(t));
      return all;
    }
  };

  Tensor buffer(std::int64_t rows, std::int64_t columns) const {
    return at::empty({rows, columns}, k.word_features.options());
  }

  void allocate() {
    k.h = buffer(R + B, 2 * H);
    k.first = buffer(R, 5 * P);
    k.qm = nn::layer_buffers(w.posterior_mu, R);
    k.qs = nn::layer_buffers(w.posterior_sigma, R);
    k.pm = nn::layer_buffers(w.prior_mu, R);
    k.ps = nn::layer_buffers(w.prior_sigma, R);
    k.dec = nn::layer_buffers(w.decoder, R);
    k.fz = nn::layer_buffers(w.latent_features, R);
    k.sigma_q = buffer(R, w.latent);
    k.sigma_p = buffer(R, w.latent);
    k.z = buffer(R, w.latent);
    k.gates_1 = buffer(R, 4 * H);
    k.gates_2 = buffer(R, 4 * H);
    k.cell_input = buffer(R, 2 * w.word);
    k.fz.back() = k.cell_input.narrow(1, w.word, w.word);
    if (k.replace.defined())
      k.fw = nn::layer_buffers(w.word_features, R);
    else
      copy_rows(R, w.word, view<T>(k.word_features), view<T>(k.cell_input));
  }

  static void copy_rows(int rows, int columns, View<const T> from, View<T> to) {
    for (int i = 0; i < rows; ++i) std::copy_n(from.data + i * from.ld, columns, to.data + i * to.ld);
  }

  // The control part and bias of the first layers, the same for all words of a clip unless attributes change.
  void start_first_layers() {
    const std::int64_t rows = k.control.size(0);
    if (rows == R) return w.first_control.forward(R, view<T>(k.control), view<T>(k.first));
    const Tensor constant = buffer(rows, 5 * P);
    w.first_control.forward(B, view<T>(k.control), view<T>(constant));
    for (std::int64_t r = 0; r < R; r += B) std::copy_n(constant.data_ptr<T>(), constant.numel(), row<T>(k.first, r));
  }

  void reparameterize(std::int64_t r) {
    const std::int64_t count = static_cast<std::int64_t>(B) * w.latent;
    const T *mu = row<T>(k.qm.back(), r), *noise = row<T>(k.noise, r);
    T *sigma = row<T>(k.sigma_q, r), *z = row<T>(k.z, r);
    nn::softplus<T>(count, row<T>(k.qs.back(), r), kFloor, sigma);
    for (std::int64_t i = 0; i < count; ++i) z[i] = mu[i] + sigma[i] * noise[i];
  }

  void reparameterize_backward(const Gradients& g, std::int64_t r, const T* dmu_kl, const T* dsigma_kl) {
    const std::int64_t count = static_cast<std::int64_t>(B) * w.latent;
    const T *dz = g.z.template data_ptr<T>(), *noise = row<T>(k.noise, r);
    T *dmu = row<T>(g.qm.back(), r), *dsigma = row<T>(g.qs.back(), r);
    for (std::int64_t i = 0; i < count; ++i) {
      dmu[i] = dmu_kl[i] + dz[i];
      dsigma[i] = dsigma_kl[i] + dz[i] * noise[i];
    }
    nn::softplus_backward<T>(count, row<T>(k.sigma_q, r), kFloor, dsigma);
  }

  void decode(std::int64_t r, int rows) {
    const View<T> first = view<T>(k.first).from_row(r).from_column(4 * P);
    nn::elu(rows, P, first.data, first.ld);
    w.decoder.forward(rows, first, views<T>(k.dec, r));
  }

  void decode_backward(const Gradients& g, std::int64_t r, int rows) {
    const View<T> first = view<T>(k.first).from_row(r).from_column(4 * P),
                  dfirst = view<T>(g.first).from_row(r).from_column(4 * P);
    w.decoder.backward(rows, views<T>(k.dec, r), views<T>(g.dec, r), dfirst);
    nn::elu_backward<T>(rows, P, first.data, first.ld, dfirst.data, dfirst.ld);
  }

  void put_replaced_features(std::int64_t r) {
    const T* replace = k.replace.data_ptr<T>() + r;
    for (int b = 0; b < B; ++b)
      std::copy_n(row<T>(replace[b] != 0 ? k.fw.back() : k.word_features, r + b), w.word, row<T>(k.cell_input, r + b));
  }

  // The gradient of the GRU's f_w goes to the network's own word where that was used, otherwise to the input's.
  void split_feature_gradient(const Gradients& g, std::int64_t r) {
    for (int b = 0; b < B; ++b) {
      const T* d = row<T>(g.cell_input, b);
      T* given = row<T>(g.word_features, r + b);
      if (!k.replace.defined()) {
        std::copy_n(d, w.word, given);
        continue;
      }
      const bool replaced = k.replace.data_ptr<T>()[r + b] != 0;
      T* own = row<T>(g.fw.back(), r + b);
      std::copy_n(d, w.word, replaced ? own : given);
      std::fill_n(replaced ? given : own, w.word, T(0));
    }
  }

  variable_list collect(const Gradients& g) {
    const std::int64_t state = 2 * H;
    const Tensor h = k.h.narrow(0, 0, R);
    // First layers: one product for all five networks with h, then cut into their parts.
    const Tensor by_state = gradient_of(g.first, 5 * P, view<T>(h), state);
    const Tensor by_word = gradient_of(g.first, 2 * P, view<T>(k.word_features), w.word);
    const Tensor by_latent = gradient_of(g.first.narrow(1, 4 * P, P), P, view<T>(k.fz.back()), w.word);
    Tensor dcontrol_rows = g.first;
    if (k.control.size(0) != R) {
      dcontrol_rows = at::zeros({B, 5 * P}, g.first.options());
      for (std::int64_t r = 0; r < R; r += B)
        nn::column_sum<T>(1, B * 5 * P, row<T>(g.first, r), 0, dcontrol_rows.data_ptr<T>(), true);
    }
    const int rows = static_cast<int>(dcontrol_rows.size(0));
    const Tensor dcontrol = at::empty_like(k.control), by_control = buffer(5 * P, w.control), bias = buffer(1, 5 * P);
    w.first_control.backward(rows, view<T>(dcontrol_rows), view<T>(dcontrol));
    nn::weight_gradient<T>(rows, dcontrol_rows.data_ptr<T>(), 5 * P, 5 * P, k.control.data_ptr<T>(), w.control,
                           w.control, by_control.data_ptr<T>(), w.control);
    nn::column_sum<T>(rows, 5 * P, dcontrol_rows.data_ptr<T>(), 5 * P, bias.data_ptr<T>());

    variable_list out{g.word_features, dcontrol, g.h};
    const auto network = [&](int part, const Tensor& own, const std::vector<Tensor>& y, const std::vector<Tensor>& d) {
      const auto rows_of = [&](const Tensor& t) { return t.narrow(0, part * P, P); };
      std::vector<Tensor> columns;
      if (own.defined()) columns.push_back(own);
      columns.push_back(rows_of(by_state));
      columns.push_back(rows_of(by_control));
      out.push_back(torch::cat(columns, 1));
      out.push_back(bias.reshape({-1}).narrow(0, part * P, P).clone());
      nn::append_layer_gradients<T>(R, view<T>(k.first).from_column(part * P), y, d, P, out);
    };
    network(0, by_word.narrow(0, 0, P), k.qm, g.qm);
    network(1, by_word.narrow(0, P, P), k.qs, g.qs);
    network(2, {}, k.pm, g.pm);
    network(3, {}, k.ps, g.ps);
    network(4, by_latent, k.dec, g.dec);
    nn::append_layer_gradients<T>(R, view<T>(k.z), k.fz, g.fz, w.latent, out);
    gru(g.gates_1, view<T>(k.cell_input), 2 * w.word, view<T>(h), out);
    gru(g.gates_2, view<T>(k.h).from_row(B), H, view<T>(h).from_column(H), out);
    if (k.replace.defined()) nn::append_layer_gradients<T>(R, view<T>(k.dec.back()), k.fw, g.fw, k.dec.back().size(1), out);
    return out;
  }

  Tensor gradient_of(const Tensor& d, int columns, View<const T> x, std::int64_t in) const {
    const Tensor dw = buffer(columns, in);
    nn::weight_gradient<T>(R, d.data_ptr<T>(), d.stride(0), columns, x.data, x.ld, static_cast<int>(in),
                           dw.data_ptr<T>(), in);
    return dw;
  }

  void gru(const Tensor& d, View<const T> x, int in, View<const T> h, variable_list& out) const {
    const auto options = d.options();
    const Tensor dw_ih = at::empty({3 * H, in}, options), dw_hh = at::empty({3 * H, H}, options),
                 db_ih = at::empty({3 * H}, options), db_hh = at::empty({3 * H}, options);
    nn::gru_weight_gradients<T>(R, H, in, d.data_ptr<T>(), x, h, dw_ih.data_ptr<T>(), dw_hh.data_ptr<T>(),
                                db_ih.data_ptr<T>(), db_hh.data_ptr<T>());
    for (const Tensor& t : {dw_ih, dw_hh, db_ih, db_hh}) out.push_back(t);
  }

  Kept& k;
  const CellWeights<T>& w;
  const int B, R, P, H;
};

struct ScanFunction : torch::autograd::Function<ScanFunction> {
  // `parameters` tell autograd what the result depends on; their values are read from the packed copy.
  static variable_list forward(AutogradContext* ctx, const Tensor& word_features, const Tensor& control,
                               const Tensor& h0, at::TensorList, std::shared_ptr<const PackedCell> packed,
                               const Tensor* noise, const Tensor* replace) {
    auto tape = c10::make_intrusive<nn::Tape<Kept>>();
    Kept& k = tape->kept;
    k.weights = std::move(packed);
    k.batch = h0.size(0);
    k.words = word_features.size(0) / k.batch;
    k.word_features = word_features.detach().contiguous();
    k.control = control.detach().contiguous();
    k.noise = noise->detach().contiguous();
    if (replace->defined()) k.replace = replace->to(word_features.scalar_type()).reshape({-1}).contiguous();
    const Tensor h = h0.detach().contiguous();
    if (h.scalar_type() == torch::kDouble)
      Scan<double>(k).forward(h);
    else
      Scan<float>(k).forward(h);
    ctx->saved_data["tape"] = c10::IValue::make_capsule(tape);
    // Handles of their own: the tape must not own the graph that owns it.
    return {k.dec.back().variable_data(), k.qm.back().variable_data(), k.sigma_q.variable_data(),
            k.pm.back().variable_data(), k.sigma_p.variable_data()};
  }

  static variable_list backward(AutogradContext* ctx, variable_list grads) {
    const auto holder = ctx->saved_data["tape"].toCapsule();
    Kept& k = static_cast<nn::Tape<Kept>&>(*holder).kept;
    variable_list out =
        k.h.scalar_type() == torch::kDouble ? Scan<double>(k).backward(grads) : Scan<float>(k).backward(grads);
    out.resize(out.size() + 3);  // packed, noise, replace have no gradient
    return out;
  }
};

}  // namespace

ScanOutput scan(const MotionCell& cell, std::shared_ptr<const PackedCell> packed, const Tensor& word_features,
                const Tensor& control, const Tensor& h0, const Tensor& noise, const Tensor& replace) {
  // The order in which Scan::collect returns their gradients.
  std::vector<Tensor> parameters;
  const auto add = [&](const nn::Mlp& mlp) {
    for (const Tensor& p : mlp.interleaved_parameters()) parameters.push_back(p);
  };
  for (const auto* mlp : {&cell.posterior_mu, &cell.posterior_sigma, &cell.prior_mu, &cell.prior_sigma, &cell.decoder,
                          &cell.latent_features})
    add(**mlp);
  for (const auto* gru : {&cell.gru_1, &cell.gru_2})
    for (const Tensor& p : {(*gru)->weight_ih, (*gru)->weight_hh, (*gru)->bias_ih, (*gru)->bias_hh})
      parameters.push_back(p);
  if (replace.defined()) add(*cell.word_features);
  variable_list out =
      ScanFunction::apply(word_features, control, h0, at::TensorList(parameters), std::move(packed), &noise, &replace);
  return {out[0], out[1], out[2], out[3], out[4]};
}

}  // namespace mocap::motion_cell
