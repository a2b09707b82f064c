// Element-wise passes of the networks on row-major arrays: one pass over memory each, vectorised for the processor.
//
// exp, tanh, ... in float are polynomials of the project's own, without fused operations: the same bits on every x86
// processor, relative error of exp below 3e-7 (tested). In double they are the C library's. ld = row stride.
#pragma once
#include <cstdint>

namespace mocap::nn {

// y = x for x > 0, exp(x) - 1 otherwise, in place. Clevert et al. 2016, alpha = 1.
template <class T>
void elu(int rows, int columns, T* y, std::int64_t ld);

// dy becomes the gradient before the activation; y is the activation's output.
template <class T>
void elu_backward(int rows, int columns, const T* y, std::int64_t ldy, T* dy, std::int64_t ldd);

// GRU gates in PyTorch's order r, z, n:
//   r = sigma(gi_r + gh_r), z = sigma(gi_z + gh_z), n = tanh(gi_n + r gh_n), h' = (1 - z) n + z h
// gi = W_ih x + b_ih and gh = W_hh h + b_hh are (rows, 3H) without gaps; `gates` (rows, 4H) receives r, z, n, gh_n for
// the backward pass, or is null.
template <class T>
void gru_gates(int rows, int hidden, const T* gi, const T* gh, const T* h, std::int64_t ldh, T* gates, T* h_next,
               std::int64_t ldn);

// From dh' (rows, H): d (rows, 4H) receives the gradients of r, z, n before their activations and of gh_n (so gi's are
// columns [0, 3H), gh's are [0, 2H) and [3H, 4H)); dh' becomes dh' z, the direct part of the gradient of h.
// `d` may be `gates` itself.
template <class T>
void gru_gates_backward(int rows, int hidden, const T* gates, const T* h, std::int64_t ldh, T* dh, std::int64_t ldd,
                        T* d);

// LSTM gates in PyTorch's order i, f, g, o:
//   i = sigma(.), f = sigma(.), g = tanh(.), o = sigma(.), c' = f c + i g, h' = o tanh(c')
// gates (rows, 4H) without gaps: on entry the sums before the activations, afterwards i, f, g, o. c' may be c, h' any
// array that is not the gates.
template <class T>
void lstm_gates(int rows, int hidden, T* gates, const T* c, std::int64_t ldc, T* c_next, std::int64_t ldcn, T* h_next,
                std::int64_t ldhn);

// From dh' and dc' (rows, H): d (rows, 4H) receives the gradients before the activations; dc' becomes that of c.
// `d` may be `gates` itself.
template <class T>
void lstm_gates_backward(int rows, int hidden, const T* gates, const T* c, std::int64_t ldc, const T* c_next,
                         std::int64_t ldcn, const T* dh, std::int64_t lddh, T* dc, std::int64_t lddc, T* d);

// sigma = softplus(s) + floor.
template <class T>
void softplus(std::int64_t count, const T* s, T floor, T* sigma);

// ds = dsigma * (1 - exp(-(sigma - floor))), in place.
template <class T>
void softplus_backward(std::int64_t count, const T* sigma, T floor, T* dsigma);

// out(columns) += or = sum of the rows, in their order.
template <class T>
void column_sum(int rows, int columns, const T* x, std::int64_t ld, T* out, bool accumulate = false);

}  // namespace mocap::nn
