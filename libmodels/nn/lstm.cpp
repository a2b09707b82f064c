#include "libmodels/nn/lstm.hpp"

#include <cmath>
#include <vector>

#include "libmodels/nn/mlp.hpp"
#include "libmodels/nn/pointwise.hpp"

namespace mocap::nn {

template <class T>
void PackedLstm<T>::advance(int rows, View<const T> h, View<const T> c, View<T> h_next, View<T> c_next, T* gates) const {
  state.forward(rows, h, View<T>{gates, 4 * static_cast<std::int64_t>(hidden())}, Start::accumulate);
  lstm_gates<T>(rows, hidden(), gates, c.data, c.ld, c_next.data, c_next.ld, h_next.data, h_next.ld);
}

template <class T>
void PackedLstm<T>::retreat(int rows, const T* gates, View<const T> c, View<const T> c_next, View<T> dh, View<T> dc, T* d) const {
  lstm_gates_backward<T>(rows, hidden(), gates, c.data, c.ld, c_next.data, c_next.ld, dh.data, dh.ld, dc.data, dc.ld, d);
  const View<const T> sums{d, 4 * static_cast<std::int64_t>(hidden())};
  if (!sees_memory()) {
    state.backward(rows, sums, dh);
    return;
  }
  const auto size = static_cast<std::size_t>(rows), h = static_cast<std::size_t>(hidden());
  std::vector<T> both(size * 2 * h);
  state.backward(rows, sums, View<T>{both.data(), static_cast<std::int64_t>(2 * h)});
  for (std::size_t r = 0; r < size; ++r) {
    const T* row = both.data() + r * 2 * h;
    T *to_h = dh.data + static_cast<std::int64_t>(r) * dh.ld, *to_c = dc.data + static_cast<std::int64_t>(r) * dc.ld;
    for (std::size_t i = 0; i < h; ++i) {
      to_h[i] = row[i];
      to_c[i] += row[h + i];
    }
  }
}

template <class T>
void PackedLstm<T>::forward(int rows, View<const T> x, View<const T> h, View<const T> c, View<T> h_next, View<T> c_next, T* gates) const {
  input.forward(rows, x, View<T>{gates, 4 * static_cast<std::int64_t>(hidden())});
  advance(rows, h, c, h_next, c_next, gates);
}

template <class T>
void PackedLstm<T>::backward(int rows, const T* gates, View<const T> c, View<const T> c_next, View<T> dh, View<T> dc, T* d, View<T> dx, Start start) const {
  retreat(rows, gates, c, c_next, dh, dc, d);
  if (dx.data) input.backward(rows, View<const T>{d, 4 * static_cast<std::int64_t>(hidden())}, dx, start);
}

template <class T>
void lstm_weight_gradients(int rows, int hidden, int in, int seen, const T* d, View<const T> x, View<const T> h, T* dw_ih, T* dw_hh, T* dbias) {
  const std::int64_t ld = 4 * static_cast<std::int64_t>(hidden);
  weight_gradient<T>(rows, d, ld, 4 * hidden, x.data, x.ld, in, dw_ih, in);
  weight_gradient<T>(rows, d, ld, 4 * hidden, h.data, h.ld, seen, dw_hh, seen);
  column_sum<T>(rows, 4 * hidden, d, ld, dbias);
}

LstmCell::LstmCell(int in, int hidden, Random& random, bool sees_memory) {
  const double bound = 1 / std::sqrt(static_cast<double>(hidden));
  weight_ih = register_parameter("weight_ih", uniform_tensor({4 * hidden, in}, bound, random));
  weight_hh = register_parameter("weight_hh", uniform_tensor({4 * hidden, sees_memory ? 2 * hidden : hidden}, bound, random));
  const torch::Tensor start = torch::zeros({4 * hidden});
  start.narrow(0, hidden, hidden).fill_(1);
  bias = register_parameter("bias", start);
}

template <class T>
PackedLstm<T> LstmCell::pack(bool training) const {
  PackedLstm<T> lstm;
  const int seen = static_cast<int>(weight_hh.size(1));
  const torch::Tensor w_ih = weight_ih.contiguous(), w_hh = weight_hh.contiguous();
  lstm.input.pack(w_ih.data_ptr<T>(), in(), 4 * hidden(), in(), bias.data_ptr<T>(), training);
  lstm.state.pack(w_hh.data_ptr<T>(), seen, 4 * hidden(), seen, nullptr, training);
  return lstm;
}

#define MOCAP_INSTANTIATE(T)                                \
  template struct PackedLstm<T>;                            \
  template PackedLstm<T> LstmCell::pack(bool) const;        \
  template void lstm_weight_gradients(int, int, int, int, const T*, View<const T>, View<const T>, T*, T*, T*);
MOCAP_INSTANTIATE(float)
MOCAP_INSTANTIATE(double)

}  // namespace mocap::nn
