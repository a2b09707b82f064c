#include "libmodels/nn/pointwise.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>

#include "libmodels/nn/packed_matrix.hpp"

#define MOCAP_INLINE __attribute__((always_inline)) inline

namespace mocap::nn {
namespace {

MOCAP_INLINE double exp_of(double x) { return std::exp(x); }

// Cephes expf: x = n ln 2 + r, |r| <= ln 2 / 2, 2^n put together in the exponent bits.
MOCAP_INLINE float exp_of(float x) {
  x = x < -87.0f ? -87.0f : x;
  x = x > 88.0f ? 88.0f : x;
  const float round = 12582912.0f;  // 1.5 * 2^23: adding it leaves the nearest integer
  const float n = (x * 1.44269504088896341f + round) - round;
  const float r = (x - n * 0.693359375f) - n * -2.12194440e-4f;
  float p = 1.9875691500e-4f;
  p = p * r + 1.3981999507e-3f;
  p = p * r + 8.3334519073e-3f;
  p = p * r + 4.1665795894e-2f;
  p = p * r + 1.6666665459e-1f;
  p = p * r + 5.0000001201e-1f;
  p = p * (r * r) + r + 1.0f;
  return p * std::bit_cast<float>((static_cast<std::int32_t>(n) + 127) << 23);
}

MOCAP_INLINE double tanh_of(double x) { return std::tanh(x); }
MOCAP_INLINE float tanh_of(float x) { return 2.0f / (1.0f + exp_of(-2.0f * x)) - 1.0f; }

template <class T>
MOCAP_INLINE T sigmoid_of(T x) {
  return T(1) / (T(1) + exp_of(-x));
}

MOCAP_INLINE double log1p_of(double x) { return std::log1p(x); }
// log(1 + x) for 0 <= x <= 1 as 2 artanh(w), w = x / (2 + x) <= 1/3.
MOCAP_INLINE float log1p_of(float x) {
  const float w = x / (2.0f + x), v = w * w;
  float p = 1.0f / 15;
  p = p * v + 1.0f / 13;
  p = p * v + 1.0f / 11;
  p = p * v + 1.0f / 9;
  p = p * v + 1.0f / 7;
  p = p * v + 1.0f / 5;
  p = p * v + 1.0f / 3;
  return 2.0f * w * (p * v + 1.0f);
}

struct Elu {
  template <class T>
  MOCAP_INLINE static void run(int rows, int columns, T* y, std::int64_t ld) {
    for (int r = 0; r < rows; ++r, y += ld)
#pragma GCC ivdep
      for (int i = 0; i < columns; ++i) {
        const T x = y[i], e = exp_of(x) - T(1);
        y[i] = x > T(0) ? x : e;
      }
  }
};

struct EluBackward {
  template <class T>
  MOCAP_INLINE static void run(int rows, int columns, const T* y, std::int64_t ldy, T* dy, std::int64_t ldd) {
    for (int r = 0; r < rows; ++r, y += ldy, dy += ldd)
#pragma GCC ivdep
      for (int i = 0; i < columns; ++i) dy[i] *= std::min(y[i], T(0)) + T(1);
  }
};

struct GruGates {
  template <class T>
  MOCAP_INLINE static void run(int rows, int hidden, const T* gi, const T* gh, const T* h, std::int64_t ldh, T* gates,
                               T* h_next, std::int64_t ldn) {
    for (int row = 0; row < rows; ++row, gi += 3 * hidden, gh += 3 * hidden, h += ldh, h_next += ldn) {
#pragma GCC ivdep
      for (int i = 0; i < hidden; ++i) {
        const T hn = gh[2 * hidden + i], before = h[i];
        const T r = sigmoid_of(gi[i] + gh[i]);
        const T z = sigmoid_of(gi[hidden + i] + gh[hidden + i]);
        const T n = tanh_of(gi[2 * hidden + i] + r * hn);
        if (gates) {
          gates[i] = r;
          gates[hidden + i] = z;
          gates[2 * hidden + i] = n;
          gates[3 * hidden + i] = hn;
        }
        h_next[i] = (T(1) - z) * n + z * before;
      }
      if (gates) gates += 4 * hidden;
    }
  }
};

struct GruGatesBackward {
  template <class T>
  MOCAP_INLINE static void run(int rows, int hidden, const T* gates, const T* h, std::int64_t ldh, T* dh,
                               std::int64_t ldd, T* d) {
    for (int row = 0; row < rows; ++row, gates += 4 * hidden, h += ldh, dh += ldd, d += 4 * hidden)
#pragma GCC ivdep
      for (int i = 0; i < hidden; ++i) {
        const T r = gates[i], z = gates[hidden + i], n = gates[2 * hidden + i], hn = gates[3 * hidden + i], g = dh[i];
        const T dn = g * (T(1) - z) * (T(1) - n * n);
        d[i] = dn * hn * r * (T(1) - r);
        d[hidden + i] = g * (h[i] - n) * z * (T(1) - z);
        d[2 * hidden + i] = dn;
        d[3 * hidden + i] = dn * r;
        dh[i] = g * z;
      }
  }
};

struct LstmGates {
  template <class T>
  MOCAP_INLINE static void run(int rows, int hidden, T* gates, const T* c, std::int64_t ldc, T* c_next,
                               std::int64_t ldcn, T* h_next, std::int64_t ldhn) {
    for (int row = 0; row < rows; ++row, gates += 4 * hidden, c += ldc, c_next += ldcn, h_next += ldhn)
#pragma GCC ivdep
      for (int k = 0; k < hidden; ++k) {
        const T i = sigmoid_of(gates[k]), f = sigmoid_of(gates[hidden + k]), g = tanh_of(gates[2 * hidden + k]),
                o = sigmoid_of(gates[3 * hidden + k]);
        gates[k] = i;
        gates[hidden + k] = f;
        gates[2 * hidden + k] = g;
        gates[3 * hidden + k] = o;
        const T next = f * c[k] + i * g;
        c_next[k] = next;
        h_next[k] = o * tanh_of(next);
      }
  }
};

struct LstmGatesBackward {
  template <class T>
  MOCAP_INLINE static void run(int rows, int hidden, const T* gates, const T* c, std::int64_t ldc, const T* c_next,
                               std::int64_t ldcn, const T* dh, std::int64_t lddh, T* dc, std::int64_t lddc, T* d) {
    for (int row = 0; row < rows; ++row, gates += 4 * hidden, d += 4 * hidden, c += ldc, c_next += ldcn, dh += lddh, dc += lddc)
#pragma GCC ivdep
      for (int k = 0; k < hidden; ++k) {
        const T i = gates[k], f = gates[hidden + k], g = gates[2 * hidden + k], o = gates[3 * hidden + k];
        const T t = tanh_of(c_next[k]), total = dc[k] + dh[k] * o * (T(1) - t * t);
        d[k] = total * g * i * (T(1) - i);
        d[hidden + k] = total * c[k] * f * (T(1) - f);
        d[2 * hidden + k] = total * i * (T(1) - g * g);
        d[3 * hidden + k] = dh[k] * t * o * (T(1) - o);
        dc[k] = total * f;
      }
  }
};

struct Softplus {
  template <class T>
  MOCAP_INLINE static void run(std::int64_t count, const T* s, T floor, T* sigma) {
#pragma GCC ivdep
    for (std::int64_t i = 0; i < count; ++i)
      sigma[i] = std::max(s[i], T(0)) + log1p_of(exp_of(-std::abs(s[i]))) + floor;
  }
};

struct SoftplusBackward {
  template <class T>
  MOCAP_INLINE static void run(std::int64_t count, const T* sigma, T floor, T* dsigma) {
#pragma GCC ivdep
    for (std::int64_t i = 0; i < count; ++i) dsigma[i] *= T(1) - exp_of(floor - sigma[i]);
  }
};

struct ColumnSum {
  template <class T>
  MOCAP_INLINE static void run(int rows, int columns, const T* x, std::int64_t ld, T* out, bool accumulate) {
    if (!accumulate) std::fill_n(out, columns, T(0));
    for (int r = 0; r < rows; ++r, x += ld)
#pragma GCC ivdep
      for (int i = 0; i < columns; ++i) out[i] += x[i];
  }
};

// Every kernel is an inline body compiled once per instruction set: the same arithmetic at three widths. (The
// compiler's own multiversioning would do the same, but its resolvers break sanitizer builds.)
#if defined(__x86_64__)
template <class Kernel, class... A>
__attribute__((target("avx512f,avx512dq,avx512bw,avx512vl,prefer-vector-width=512"))) void run_avx512(A... a) {
  Kernel::run(a...);
}
template <class Kernel, class... A>
__attribute__((target("avx2"))) void run_avx2(A... a) {
  Kernel::run(a...);
}
#endif

template <class Kernel, class... A>
void dispatch(A... a) {
#if defined(__x86_64__)
  if (best_isa() == Isa::avx512) return run_avx512<Kernel>(a...);
  if (best_isa() == Isa::avx2) return run_avx2<Kernel>(a...);
#endif
  Kernel::run(a...);
}

}  // namespace

template <class T>
void elu(int rows, int columns, T* y, std::int64_t ld) {
  dispatch<Elu>(rows, columns, y, ld);
}
template <class T>
void elu_backward(int rows, int columns, const T* y, std::int64_t ldy, T* dy, std::int64_t ldd) {
  dispatch<EluBackward>(rows, columns, y, ldy, dy, ldd);
}
template <class T>
void gru_gates(int rows, int hidden, const T* gi, const T* gh, const T* h, std::int64_t ldh, T* gates, T* h_next,
               std::int64_t ldn) {
  dispatch<GruGates>(rows, hidden, gi, gh, h, ldh, gates, h_next, ldn);
}
template <class T>
void gru_gates_backward(int rows, int hidden, const T* gates, const T* h, std::int64_t ldh, T* dh, std::int64_t ldd,
                        T* d) {
  dispatch<GruGatesBackward>(rows, hidden, gates, h, ldh, dh, ldd, d);
}
template <class T>
void lstm_gates(int rows, int hidden, T* gates, const T* c, std::int64_t ldc, T* c_next, std::int64_t ldcn, T* h_next,
                std::int64_t ldhn) {
  dispatch<LstmGates>(rows, hidden, gates, c, ldc, c_next, ldcn, h_next, ldhn);
}
template <class T>
void lstm_gates_backward(int rows, int hidden, const T* gates, const T* c, std::int64_t ldc, const T* c_next,
                         std::int64_t ldcn, const T* dh, std::int64_t lddh, T* dc, std::int64_t lddc, T* d) {
  dispatch<LstmGatesBackward>(rows, hidden, gates, c, ldc, c_next, ldcn, dh, lddh, dc, lddc, d);
}
template <class T>
void softplus(std::int64_t count, const T* s, T floor, T* sigma) {
  dispatch<Softplus>(count, s, floor, sigma);
}
template <class T>
void softplus_backward(std::int64_t count, const T* sigma, T floor, T* dsigma) {
  dispatch<SoftplusBackward>(count, sigma, floor, dsigma);
}
template <class T>
void column_sum(int rows, int columns, const T* x, std::int64_t ld, T* out, bool accumulate) {
  dispatch<ColumnSum>(rows, columns, x, ld, out, accumulate);
}

#define MOCAP_INSTANTIATE(T)                                                                           \
  template void elu(int, int, T*, std::int64_t);                                                       \
  template void elu_backward(int, int, const T*, std::int64_t, T*, std::int64_t);                      \
  template void gru_gates(int, int, const T*, const T*, const T*, std::int64_t, T*, T*, std::int64_t); \
  template void gru_gates_backward(int, int, const T*, const T*, std::int64_t, T*, std::int64_t, T*);  \
  template void lstm_gates(int, int, T*, const T*, std::int64_t, T*, std::int64_t, T*, std::int64_t);  \
  template void lstm_gates_backward(int, int, const T*, const T*, std::int64_t, const T*, std::int64_t, const T*, \
                                    std::int64_t, T*, std::int64_t, T*);                               \
  template void softplus(std::int64_t, const T*, T, T*);                                               \
  template void softplus_backward(std::int64_t, const T*, T, T*);                                      \
  template void column_sum(int, int, const T*, std::int64_t, T*, bool);
MOCAP_INSTANTIATE(float)
MOCAP_INSTANTIATE(double)

}  // namespace mocap::nn
