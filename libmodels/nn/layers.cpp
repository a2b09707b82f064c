#include "libmodels/nn/layers.hpp"

#include <algorithm>
#include <cstddef>

#include "libmodels/nn/pointwise.hpp"

namespace mocap::nn {

template <class T>
void PackedLinear<T>::pack(const T* weight, std::int64_t ld, int out, int in, const T* bias_values, bool training) {
  apply.pack(weight, 1, ld, in, out);
  if (training) gradient.pack(weight, ld, 1, out, in);
  if (bias_values)
    bias.assign(bias_values, bias_values + out);
  else
    bias.clear();
}

template <class T>
void PackedLinear<T>::forward(int rows, View<const T> x, View<T> y, Start start) const {
  if (start == Start::bias && bias.empty()) start = Start::zero;
  apply.multiply(rows, x.data, x.ld, y.data, y.ld, start, bias.data());
}

template <class T>
void PackedLinear<T>::backward(int rows, View<const T> d, View<T> dx, Start start) const {
  gradient.multiply(rows, d.data, d.ld, dx.data, dx.ld, start);
}

template <class T>
void PackedMlp<T>::forward(int rows, View<const T> x, const std::vector<View<T>>& y) const {
  for (std::size_t i = 0; i < layers.size(); ++i) {
    layers[i].forward(rows, i == 0 ? x : View<const T>(y[i - 1]), y[i]);
    if (i + 1 < layers.size() || activate_last) elu(rows, layers[i].out(), y[i].data, y[i].ld);
  }
}

template <class T>
void PackedMlp<T>::backward(int rows, const std::vector<View<T>>& y, const std::vector<View<T>>& d, View<T> dx,
                            Start start) const {
  for (std::size_t i = layers.size(); i-- > 0;) {
    if (i + 1 < layers.size() || activate_last)
      elu_backward<T>(rows, layers[i].out(), y[i].data, y[i].ld, d[i].data, d[i].ld);
    if (i > 0)
      layers[i].backward(rows, d[i], d[i - 1]);
    else if (dx.data)
      layers[i].backward(rows, d[i], dx, start);
  }
}

template <class T>
void PackedGru<T>::pack(const T* w_ih, const T* w_hh, const T* b_ih, const T* b_hh, int hidden, int in, bool training) {
  input.pack(w_ih, in, 3 * hidden, in, b_ih, training);
  state.pack(w_hh, hidden, 3 * hidden, hidden, b_hh, false);
  if (training) {
    state_gradient_rz.pack(w_hh, hidden, 1, 2 * hidden, hidden);
    state_gradient_n.pack(w_hh + 2 * static_cast<std::ptrdiff_t>(hidden) * hidden, hidden, 1, hidden, hidden);
  }
}

template <class T>
void PackedGru<T>::forward(int rows, View<const T> x, View<const T> h, View<T> h_next, T* gates, T* scratch) const {
  const int width = 3 * hidden();
  T *gi = scratch, *gh = scratch + static_cast<std::ptrdiff_t>(rows) * width;
  input.forward(rows, x, {gi, width});
  state.forward(rows, h, {gh, width});
  gru_gates<T>(rows, hidden(), gi, gh, h.data, h.ld, gates, h_next.data, h_next.ld);
}

template <class T>
void PackedGru<T>::backward(int rows, const T* gates, View<const T> h, View<T> dh, T* d, View<T> dx,
                            Start start) const {
  const int n = hidden();
  const std::int64_t ld = 4 * static_cast<std::int64_t>(n);
  gru_gates_backward<T>(rows, n, gates, h.data, h.ld, dh.data, dh.ld, d);
  state_gradient_rz.multiply(rows, d, ld, dh.data, dh.ld, Start::accumulate);
  state_gradient_n.multiply(rows, d + 3 * n, ld, dh.data, dh.ld, Start::accumulate);
  if (dx.data) input.backward(rows, {d, ld}, dx, start);
}

template <class T>
void gru_weight_gradients(int rows, int hidden, int in, const T* d, View<const T> x, View<const T> h, T* dw_ih,
                          T* dw_hh, T* db_ih, T* db_hh) {
  const std::int64_t ld = 4 * static_cast<std::int64_t>(hidden);
  weight_gradient<T>(rows, d, ld, 3 * hidden, x.data, x.ld, in, dw_ih, in);
  weight_gradient<T>(rows, d, ld, 2 * hidden, h.data, h.ld, hidden, dw_hh, hidden);
  weight_gradient<T>(rows, d + 3 * hidden, ld, hidden, h.data, h.ld, hidden,
                     dw_hh + 2 * static_cast<std::ptrdiff_t>(hidden) * hidden, hidden);
  column_sum<T>(rows, 3 * hidden, d, ld, db_ih);
  std::copy_n(db_ih, 2 * hidden, db_hh);
  column_sum<T>(rows, hidden, d + 3 * hidden, ld, db_hh + 2 * hidden);
}

#define MOCAP_INSTANTIATE(T)       \
  template struct PackedLinear<T>; \
  template struct PackedMlp<T>;    \
  template struct PackedGru<T>;    \
  template void gru_weight_gradients(int, int, int, const T*, View<const T>, View<const T>, T*, T*, T*, T*);
MOCAP_INSTANTIATE(float)
MOCAP_INSTANTIATE(double)

}  // namespace mocap::nn
