#include "libmodels/nn/packed_matrix.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <new>
#include <string_view>
#include <utility>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace mocap::nn {
namespace {

constexpr int kPanel = 32;

// rows x 32 products of one panel; y is read first when accumulating, otherwise the start is `bias` (32 values) or
// zero.
template <class T>
using PanelKernel = void (*)(int k, const T* x, std::int64_t xr, std::int64_t xk, const T* panel, T* y,
                             std::int64_t ldy, bool accumulate, const T* bias);

template <class T>
void panel_base(int k, const T* x, std::int64_t, std::int64_t xk, const T* panel, T* y, std::int64_t, bool accumulate,
                const T* bias) {
  T sum[kPanel];
  for (int j = 0; j < kPanel; ++j) sum[j] = accumulate ? y[j] : bias ? bias[j] : T(0);
  for (int i = 0; i < k; ++i) {
    const T a = x[i * xk];
    const T* w = panel + static_cast<std::ptrdiff_t>(i) * kPanel;
    for (int j = 0; j < kPanel; ++j) {
#if defined(FP_FAST_FMA) && defined(FP_FAST_FMAF)
      sum[j] = std::fma(a, w[j], sum[j]);
#else
      sum[j] += a * w[j];
#endif
    }
  }
  for (int j = 0; j < kPanel; ++j) y[j] = sum[j];
}

#if defined(__x86_64__)
template <int R>
__attribute__((target("avx512f"))) void panel_avx512(int k, const float* x, std::int64_t xr, std::int64_t xk,
                                                     const float* panel, float* y, std::int64_t ldy, bool accumulate,
                                                     const float* bias) {
  __m512 sum[R][2];
  for (int r = 0; r < R; ++r)
    for (int v = 0; v < 2; ++v)
      sum[r][v] = accumulate ? _mm512_loadu_ps(y + r * ldy + 16 * v)
                  : bias     ? _mm512_loadu_ps(bias + 16 * v)
                             : _mm512_setzero_ps();
  for (int i = 0; i < k; ++i, panel += kPanel, x += xk) {
    const __m512 w0 = _mm512_load_ps(panel), w1 = _mm512_load_ps(panel + 16);
#pragma GCC unroll 16
    for (int r = 0; r < R; ++r) {
      const __m512 a = _mm512_set1_ps(x[r * xr]);
      sum[r][0] = _mm512_fmadd_ps(a, w0, sum[r][0]);
      sum[r][1] = _mm512_fmadd_ps(a, w1, sum[r][1]);
    }
  }
  for (int r = 0; r < R; ++r)
    for (int v = 0; v < 2; ++v) _mm512_storeu_ps(y + r * ldy + 16 * v, sum[r][v]);
}

// V vectors of 8 columns at a time: 2 where several rows fill the 16 registers, 4 where few do.
template <int R, int V>
__attribute__((target("avx2,fma"))) void panel_avx2(int k, const float* x, std::int64_t xr, std::int64_t xk,
                                                    const float* panel, float* y, std::int64_t ldy, bool accumulate,
                                                    const float* bias) {
  for (int c = 0; c < kPanel; c += 8 * V) {
    __m256 sum[R][V];
    for (int r = 0; r < R; ++r)
      for (int v = 0; v < V; ++v)
        sum[r][v] = accumulate ? _mm256_loadu_ps(y + r * ldy + c + 8 * v)
                    : bias     ? _mm256_loadu_ps(bias + c + 8 * v)
                               : _mm256_setzero_ps();
    const float *w = panel + c, *a_k = x;
    for (int i = 0; i < k; ++i, w += kPanel, a_k += xk) {
      __m256 b[V];
      for (int v = 0; v < V; ++v) b[v] = _mm256_load_ps(w + 8 * v);
#pragma GCC unroll 8
      for (int r = 0; r < R; ++r) {
        const __m256 a = _mm256_set1_ps(a_k[r * xr]);
        for (int v = 0; v < V; ++v) sum[r][v] = _mm256_fmadd_ps(a, b[v], sum[r][v]);
      }
    }
    for (int r = 0; r < R; ++r)
      for (int v = 0; v < V; ++v) _mm256_storeu_ps(y + r * ldy + c + 8 * v, sum[r][v]);
  }
}

template <int... R>
constexpr auto avx512_table(std::integer_sequence<int, R...>) {
  return std::array<PanelKernel<float>, sizeof...(R)>{&panel_avx512<R + 1>...};
}
template <int... R>
constexpr auto avx2_table(std::integer_sequence<int, R...>) {
  return std::array<PanelKernel<float>, sizeof...(R)>{&panel_avx2<R + 1, (R + 1 <= 3 ? 4 : 2)>...};
}
constexpr auto kAvx512 = avx512_table(std::make_integer_sequence<int, 12>());
constexpr auto kAvx2 = avx2_table(std::make_integer_sequence<int, 6>());
#endif

Isa detect() {
  Isa isa = Isa::base;
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) isa = Isa::avx2;
  if (isa == Isa::avx2 && __builtin_cpu_supports("avx512f")) isa = Isa::avx512;
#endif
  if (const char* allowed = std::getenv("ATEN_CPU_CAPABILITY")) {
    if (std::string_view(allowed) == "default") isa = Isa::base;
    if (std::string_view(allowed) == "avx2") isa = std::min(isa, Isa::avx2);
  }
  return isa;
}

std::atomic<Isa> limit{Isa::avx512};

}  // namespace

Isa best_isa() {
  static const Isa isa = detect();
  return std::min(isa, limit.load(std::memory_order_relaxed));
}

void limit_isa(Isa most) { limit = most; }

const char* isa_name(Isa isa) { return isa == Isa::avx512 ? "avx512" : isa == Isa::avx2 ? "avx2" : "base"; }

template <class T>
void PackedMatrix<T>::Free::operator()(T* p) const {
  std::free(p);
}

template <class T>
void PackedMatrix<T>::pack(const T* data, std::int64_t k_stride, std::int64_t n_stride, int k, int n) {
  const int panels = (n + kPanel - 1) / kPanel;
  const std::size_t bytes = static_cast<std::size_t>(panels) * k * kPanel * sizeof(T);
  if (bytes > capacity_) {
    data_.reset(static_cast<T*>(std::aligned_alloc(64, bytes)));
    capacity_ = data_ ? bytes : 0;
    if (!data_) throw std::bad_alloc();
  }
  k_ = k;
  n_ = n;
  T* out = data_.get();
  for (int p = 0; p < panels; ++p) {
    const int width = std::min(kPanel, n - p * kPanel);
    const T* in = data + p * kPanel * n_stride;
    for (int i = 0; i < k; ++i, out += kPanel, in += k_stride) {
      if (n_stride == 1)
        std::copy_n(in, width, out);
      else
        for (int j = 0; j < width; ++j) out[j] = in[j * n_stride];
      std::fill(out + width, out + kPanel, T(0));
    }
  }
}

template <class T>
void PackedMatrix<T>::multiply_as(Isa isa, int rows, const T* x, std::int64_t xr, std::int64_t xk, T* y,
                                  std::int64_t ldy, Start start, const T* bias) const {
  const PanelKernel<T> base = &panel_base<T>;
  const PanelKernel<T>* kernels = &base;
  int most = 1;
#if defined(__x86_64__)
  if constexpr (std::is_same_v<T, float>) {
    if (isa == Isa::avx512) kernels = kAvx512.data(), most = static_cast<int>(kAvx512.size());
    if (isa == Isa::avx2) kernels = kAvx2.data(), most = static_cast<int>(kAvx2.size());
  }
#endif
  (void)isa;
  const bool accumulate = start == Start::accumulate;
  constexpr int kRowBlock = 64;  // rows of x that stay in the second-level cache while all panels pass
  for (int r0 = 0; r0 < rows; r0 += kRowBlock) {
    const int block = std::min(kRowBlock, rows - r0);
    const int parts = (block + most - 1) / most;
    const T* panel = data_.get();
    for (int n0 = 0; n0 < n_; n0 += kPanel, panel += static_cast<std::ptrdiff_t>(k_) * kPanel) {
      const int width = std::min(kPanel, n_ - n0);
      for (int part = 0; part < parts; ++part) {
        const int first = r0 + block * part / parts, count = r0 + block * (part + 1) / parts - first;
        const T* a = x + first * xr;
        T* c = y + first * ldy + n0;
        if (width == kPanel) {
          kernels[count - 1](k_, a, xr, xk, panel, c, ldy, accumulate, start == Start::bias ? bias + n0 : nullptr);
          continue;
        }
        alignas(64) T edge[12 * kPanel] = {};
        for (int r = 0; r < count; ++r)
          if (start != Start::zero) std::copy_n(accumulate ? c + r * ldy : bias + n0, width, edge + r * kPanel);
        kernels[count - 1](k_, a, xr, xk, panel, edge, kPanel, true, nullptr);
        for (int r = 0; r < count; ++r) std::copy_n(edge + r * kPanel, width, c + r * ldy);
      }
    }
  }
}

template <class T>
void weight_gradient(int rows, const T* d, std::int64_t ldd, int out, const T* x, std::int64_t ldx, int in, T* dw,
                     std::int64_t lddw, Start start) {
  // Slices of samples whose packed inputs and gradients stay in the second-level cache; the chain of additions runs on.
  constexpr int kSlice = 256;
  thread_local PackedMatrix<T> packed;
  if (rows == 0 && start == Start::zero)
    for (int o = 0; o < out; ++o) std::fill_n(dw + o * lddw, in, T(0));
  for (int r = 0; r < rows; r += kSlice) {
    const int count = std::min(kSlice, rows - r);
    packed.pack(x + r * ldx, ldx, 1, count, in);
    packed.multiply_as(best_isa(), out, d + r * ldd, 1, ldd, dw, lddw, r == 0 ? start : Start::accumulate, nullptr);
  }
}

template class PackedMatrix<float>;
template class PackedMatrix<double>;
template void weight_gradient(int, const float*, std::int64_t, int, const float*, std::int64_t, int, float*,
                              std::int64_t, Start);
template void weight_gradient(int, const double*, std::int64_t, int, const double*, std::int64_t, int, double*,
                              std::int64_t, Start);

}  // namespace mocap::nn
