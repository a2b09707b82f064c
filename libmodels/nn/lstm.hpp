// One LSTM cell (Hochreiter and Schmidhuber 1997 with forget gates; PyTorch's gate order i, f, g, o, its two biases as
// one, since only their sum matters), or the cell of Wang, Chai, Xia 2018, eq. 27, whose gates see the memory as well:
//   (i, f, g, o) = W (C_{t-1}, h_{t-1}, x_t) + b,   C_t = f C_{t-1} + i g,   h_t = o tanh(C_t)
// (They print tanh(x) = (1 - e^-x) / (1 + e^-x), which is tanh(x / 2); here it is tanh.)
// No autograd of its own: a scan over PackedLstm is what trains it, lstm_sequence (lstm_sequence.hpp) for one.
#pragma once
#include <torch/torch.h>

#include "libmocap/base/random.hpp"
#include "libmodels/nn/layers.hpp"

namespace mocap::nn {

// On raw row-major arrays, as PackedGru in layers.hpp.
template <class T>
struct PackedLstm {
  PackedLinear<T> input;  // W_ih, bias
  PackedLinear<T> state;  // W_hh

  int hidden() const { return state.out() / 4; }
  bool sees_memory() const { return state.in() == 2 * hidden(); }  // then the columns of c follow those of h in every array
  // h' and c' from x, h and c; h' may be h, c' may be c. gates (rows, 4H) receives i, f, g, o.
  void forward(int rows, View<const T> x, View<const T> h, View<const T> c, View<T> h_next, View<T> c_next, T* gates) const;
  // dh, dc: on entry the gradients of h' and c', afterwards those of h and c. d (rows, 4H) receives the gradients of the
  // gates before their activations; dx that of x.
  void backward(int rows, const T* gates, View<const T> c, View<const T> c_next, View<T> dh, View<T> dc, T* d, View<T> dx, Start start) const;
  // The parts of the two that belong to a step of the recurrence alone. On entry `gates` holds W_ih x + b.
  void advance(int rows, View<const T> h, View<const T> c, View<T> h_next, View<T> c_next, T* gates) const;
  void retreat(int rows, const T* gates, View<const T> c, View<const T> c_next, View<T> dh, View<T> dc, T* d) const;
};

// Gradients of the parameters from the gate gradients of `rows` samples; arrays shaped like the parameters. `seen`: columns of W_hh.
template <class T>
void lstm_weight_gradients(int rows, int hidden, int in, int seen, const T* d, View<const T> x, View<const T> h, T* dw_ih, T* dw_hh, T* dbias);

class LstmCell : public torch::nn::Module {
 public:
  // Weights uniform on +-1/sqrt(hidden), PyTorch's default; biases 0 but 1 for the forget gate (Jozefowicz et al. 2015).
  // sees_memory: the cell of eq. 27; W_hh has the columns of h, then those of c.
  LstmCell(int in, int hidden, Random& random, bool sees_memory = false);

  int in() const { return static_cast<int>(weight_ih.size(1)); }
  int hidden() const { return static_cast<int>(weight_ih.size(0)) / 4; }

  template <class T>
  PackedLstm<T> pack(bool training) const;

  torch::Tensor weight_ih, weight_hh, bias;  // (4H, in), (4H, H or 2H), (4H)
};

}  // namespace mocap::nn
