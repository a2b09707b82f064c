// Fully connected and GRU layers on raw row-major arrays, forward and backward, with packed weights: what the
// hand-written recurrent passes are put together from. No autograd here; nn/mlp.hpp and nn/gru.hpp wrap it.
#pragma once
#include <cstdint>
#include <vector>

#include "libmodels/nn/packed_matrix.hpp"

namespace mocap::nn {

// Rows of an array with a row stride.
template <class T>
struct View {
  T* data = nullptr;
  std::int64_t ld = 0;
  View from_row(std::int64_t row) const { return {data + row * ld, ld}; }
  View from_column(std::int64_t column) const { return {data + column, ld}; }
  operator View<const T>() const { return {data, ld}; }
};

// y = x W^T + b. W (out, in) row-major with row stride ld, may be a range of columns of a wider matrix; b may be null.
template <class T>
struct PackedLinear {
  PackedMatrix<T> apply;     // x -> x W^T
  PackedMatrix<T> gradient;  // d -> d W; only when packed for training
  std::vector<T> bias;

  void pack(const T* weight, std::int64_t ld, int out, int in, const T* bias_values, bool training);
  int in() const { return apply.k(); }
  int out() const { return apply.n(); }
  // Starts from the bias where there is one, unless told to accumulate.
  void forward(int rows, View<const T> x, View<T> y, Start start = Start::bias) const;
  void backward(int rows, View<const T> d, View<T> dx, Start start = Start::zero) const;
};

// Fully connected layers with ELU between them, and after the last one if activate_last.
template <class T>
struct PackedMlp {
  std::vector<PackedLinear<T>> layers;
  bool activate_last = true;

  // y[i] receives the output of layer i.
  void forward(int rows, View<const T> x, const std::vector<View<T>>& y) const;
  // On entry d.back() holds the gradient of the output; afterwards every d[i] holds that of layer i before its
  // activation, and dx (unless null) that of x.
  void backward(int rows, const std::vector<View<T>>& y, const std::vector<View<T>>& d, View<T> dx,
                Start start = Start::zero) const;
};

// GRU cell, gate order r, z, n as in PyTorch: see gru_gates in pointwise.hpp.
template <class T>
struct PackedGru {
  PackedLinear<T> input;  // W_ih, b_ih
  PackedLinear<T> state;  // W_hh, b_hh; its gradient is kept in two parts, as gh's gates are (pointwise.hpp)
  PackedMatrix<T> state_gradient_rz, state_gradient_n;

  void pack(const T* w_ih, const T* w_hh, const T* b_ih, const T* b_hh, int hidden, int in, bool training);
  int hidden() const { return state.in(); }
  // h_next from x and h. gates (rows, 4H) or null; scratch 6H values a row.
  void forward(int rows, View<const T> x, View<const T> h, View<T> h_next, T* gates, T* scratch) const;
  // dh: on entry the gradient of h_next, afterwards that of h. d (rows, 4H) receives the gate gradients; dx that of x.
  void backward(int rows, const T* gates, View<const T> h, View<T> dh, T* d, View<T> dx, Start start) const;
};

// Gradients of a GRU's parameters from the gate gradients of `rows` samples; arrays shaped like the parameters.
template <class T>
void gru_weight_gradients(int rows, int hidden, int in, const T* d, View<const T> x, View<const T> h, T* dw_ih,
                          T* dw_hh, T* db_ih, T* db_hh);

}  // namespace mocap::nn
