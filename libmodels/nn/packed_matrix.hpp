// Small-batch matrix products with weights packed once and used many times.
//
// A recurrent step multiplies a few dozen rows by megabytes of weights. A BLAS call repacks those weights every time;
// here they are packed once per optimiser step (or once per sampler) and then stream through the cache in order, which
// also makes the one-row product of real-time sampling run at memory speed.
//
// Every element of a product is one chain of fused multiply-adds in the order of the inner index. So a row's result
// does not depend on the other rows, on their number, or on which of avx2 and avx512 ran (tested); `base` without a
// hardware fused multiply-add rounds twice and differs in the last bits. float and double; double is a plain loop, for
// tests.
#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>

namespace mocap::nn {

// The instruction sets the kernels of this room are built for; all but `base` need x86-64.
enum class Isa { base, avx2, avx512 };
Isa best_isa();            // of this processor, not above what ATEN_CPU_CAPABILITY (default, avx2, avx512) allows
void limit_isa(Isa most);  // for tests: from now on best_isa() is not above `most`
const char* isa_name(Isa isa);

// What a product starts from: y = x m, y = bias + x m, y = y + x m.
enum class Start { zero, bias, accumulate };

// A K x N matrix in column panels of 32, each panel's rows in order.
template <class T>
class PackedMatrix {
 public:
  static constexpr int kPanel = 32;

  // Packs m(k, n) = data[k * k_stride + n * n_stride]. Memory is kept when the size is unchanged.
  void pack(const T* data, std::int64_t k_stride, std::int64_t n_stride, int k, int n);

  int k() const { return k_; }
  int n() const { return n_; }

  // x (rows, k) with row stride ldx, y (rows, n) with row stride ldy; bias (n). x and y must not overlap.
  // Cost: 2 rows k n flop, at more than 0.9 of one core's peak from 16 rows on. Thread-safe.
  void multiply(int rows, const T* x, std::int64_t ldx, T* y, std::int64_t ldy, Start start = Start::zero,
                const T* bias = nullptr) const {
    multiply_as(best_isa(), rows, x, ldx, 1, y, ldy, start, bias);
  }
  // The same with x(r, k) = x[r * x_row_stride + k * x_k_stride] and the instruction set named.
  void multiply_as(Isa isa, int rows, const T* x, std::int64_t x_row_stride, std::int64_t x_k_stride, T* y,
                   std::int64_t ldy, Start start, const T* bias) const;

 private:
  struct Free {
    void operator()(T* p) const;
  };
  std::unique_ptr<T[], Free> data_;
  std::size_t capacity_ = 0;
  int k_ = 0, n_ = 0;
};

// The gradient of a layer's weights: dw (out, in) += or = d^T x over `rows` samples, d (rows, out) the gradient of the
// layer's pre-activations, x (rows, in) its inputs. One chain of additions per element, in the order of the rows.
template <class T>
void weight_gradient(int rows, const T* d, std::int64_t ldd, int out, const T* x, std::int64_t ldx, int in, T* dw,
                     std::int64_t lddw, Start start = Start::zero);

extern template class PackedMatrix<float>;
extern template class PackedMatrix<double>;

}  // namespace mocap::nn
