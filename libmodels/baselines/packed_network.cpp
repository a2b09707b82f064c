#include "libmodels/baselines/packed_network.hpp"

#include <algorithm>
#include <cmath>

namespace mocap::baselines {
namespace {

using nn::View;

// r = p q; conj_p, conj_q: their conjugates instead.
template <class T>
void multiply(const T* p, const T* q, T* r, bool conj_p = false, bool conj_q = false) {
  const T a = p[0], s = conj_p ? T(-1) : T(1), b = s * p[1], c = s * p[2], d = s * p[3];
  const T e = q[0], u = conj_q ? T(-1) : T(1), f = u * q[1], g = u * q[2], h = u * q[3];
  r[0] = a * e - b * f - c * g - d * h;
  r[1] = a * f + b * e + c * h - d * g;
  r[2] = a * g + c * e + d * f - b * h;
  r[3] = a * h + d * e + b * g - c * f;
}

constexpr double kSmallest = 1e-6;  // a quaternion below this length is the identity, as where features are decoded

// q = raw / |raw|; returns |raw|, or 0 where that was too small.
template <class T>
T unit(const T* z, const T* mean, const T* sd, T* q) {
  T sum = 0;
  for (int i = 0; i < 4; ++i) {
    q[i] = mean[i] + sd[i] * z[i];
    sum += q[i] * q[i];
  }
  const T length = std::sqrt(sum);
  if (!(length > static_cast<T>(kSmallest))) {
    q[0] = 1, q[1] = q[2] = q[3] = 0;
    return 0;
  }
  for (int i = 0; i < 4; ++i) q[i] /= length;
  return length;
}

// dz from the gradient of the unit quaternion.
template <class T>
void unit_backward(const T* q, T length, const T* sd, const T* dq, T* dz) {
  if (length == 0) {
    std::fill_n(dz, 4, T(0));
    return;
  }
  const T along = q[0] * dq[0] + q[1] * dq[1] + q[2] * dq[2] + q[3] * dq[3];
  for (int i = 0; i < 4; ++i) dz[i] = sd[i] * (dq[i] - q[i] * along) / length;
}

}  // namespace

template <class T>
NetworkWeights<T>::NetworkWeights(const Network& n, bool training)
    : arch(n.config().arch),
      features(n.config().features()),
      joints(n.config().joints),
      hidden(n.config().hidden),
      state(n.config().state()),
      input(n.config().input()),
      decoder(n.decoder->template pack<T>(0, training)),
      start(n.start->template pack<T>(0, false)),
      mean(n.mean().begin(), n.mean().end()),
      deviation(n.deviation().begin(), n.deviation().end()) {
  if (arch == Arch::erd) {
    encoder = n.encoder->template pack<T>(0, training);
    lstm_1 = n.lstm_1->template pack<T>(training);
    lstm_2 = n.lstm_2->template pack<T>(training);
  } else {
    gru_1 = n.gru_1->template pack<T>(training);
    gru_2 = n.gru_2->template pack<T>(training);
  }
}

template <class T>
void NetworkWeights<T>::frame(int rows, const FrameBuffers<T>& b) const {
  const int h = hidden;
  const View<T> next_2 = b.next.from_column(h);
  if (arch == Arch::erd) {
    encoder.forward(rows, b.input, b.encoded);
    lstm_1.forward(rows, b.encoded.back(), b.state, {b.state.data + 2 * h, b.state.ld}, b.next, b.next.from_column(2 * h), b.gates_1);
    lstm_2.forward(rows, b.next, {b.state.data + h, b.state.ld}, {b.state.data + 3 * h, b.state.ld}, next_2, b.next.from_column(3 * h), b.gates_2);
  } else {
    gru_1.forward(rows, b.input, b.state, b.next, b.gates_1, b.scratch);
    gru_2.forward(rows, b.next, {b.state.data + h, b.state.ld}, next_2, b.gates_2, b.scratch);
  }
  decoder.forward(rows, next_2, b.decoded);
  head(rows, b.input, b.decoded.back(), b.y);
}

template <class T>
void NetworkWeights<T>::head(int rows, View<const T> u, View<const T> o, View<T> y) const {
  for (int r = 0; r < rows; ++r) {
    const T *in = u.data + r * u.ld, *out = o.data + r * o.ld;
    T* to = y.data + r * y.ld;
    if (arch == Arch::erd) {
      std::copy_n(out, features, to);
      continue;
    }
    for (int c = 0; c < 4 * joints; c += 4) {
      T base[4], delta[4], q[4];
      unit(in + c, &mean[c], &deviation[c], base);
      for (int i = 0; i < 4; ++i) delta[i] = (i == 0 ? T(1) : T(0)) + deviation[c + i] * out[c + i];
      multiply(base, delta, q);
      for (int i = 0; i < 4; ++i) to[c + i] = (q[i] - mean[c + i]) / deviation[c + i];
    }
    std::copy(out + 4 * joints, out + features, to + 4 * joints);
  }
}

template <class T>
void NetworkWeights<T>::head_backward(int rows, View<const T> u, View<const T> o, View<const T> dy, View<T> d_o, View<T> du) const {
  for (int r = 0; r < rows; ++r) {
    const T *in = u.data + r * u.ld, *out = o.data + r * o.ld, *from = dy.data + r * dy.ld;
    T *dout = d_o.data + r * d_o.ld, *din = du.data + r * du.ld;
    if (arch == Arch::erd) {
      std::copy_n(from, features, dout);
      std::fill_n(din, features, T(0));
      continue;
    }
    for (int c = 0; c < 4 * joints; c += 4) {
      T base[4], delta[4], dq[4], ddelta[4], dbase[4];
      const T length = unit(in + c, &mean[c], &deviation[c], base);
      for (int i = 0; i < 4; ++i) {
        delta[i] = (i == 0 ? T(1) : T(0)) + deviation[c + i] * out[c + i];
        dq[i] = from[c + i] / deviation[c + i];
      }
      multiply(base, dq, ddelta, true, false);
      multiply(dq, delta, dbase, false, true);
      for (int i = 0; i < 4; ++i) dout[c + i] = deviation[c + i] * ddelta[i];
      unit_backward(base, length, &deviation[c], dbase, din + c);
    }
    std::copy(from + 4 * joints, from + features, dout + 4 * joints);
    std::fill(din + 4 * joints, din + features, T(0));
  }
}

template <class T>
void NetworkWeights<T>::feed_back(int rows, View<const T> y, View<T> u) const {
  for (int r = 0; r < rows; ++r) {
    const T* from = y.data + r * y.ld;
    T* to = u.data + r * u.ld;
    for (int c = 0; c < 4 * joints; c += 4) {
      T q[4];
      unit(from + c, &mean[c], &deviation[c], q);
      for (int i = 0; i < 4; ++i) to[c + i] = (q[i] - mean[c + i]) / deviation[c + i];
    }
    std::copy(from + 4 * joints, from + features, to + 4 * joints);
  }
}

template <class T>
void NetworkWeights<T>::feed_back_backward(int rows, View<const T> y, View<const T> du, View<T> dy) const {
  for (int r = 0; r < rows; ++r) {
    const T *from = y.data + r * y.ld, *d = du.data + r * du.ld;
    T* to = dy.data + r * dy.ld;
    for (int c = 0; c < 4 * joints; c += 4) {
      T q[4], dq[4], dz[4];
      const T length = unit(from + c, &mean[c], &deviation[c], q);
      for (int i = 0; i < 4; ++i) dq[i] = d[c + i] / deviation[c + i];
      unit_backward(q, length, &deviation[c], dq, dz);
      for (int i = 0; i < 4; ++i) to[c + i] += dz[i];
    }
    for (int c = 4 * joints; c < features; ++c) to[c] += d[c];
  }
}

template struct NetworkWeights<float>;
template struct NetworkWeights<double>;

}  // namespace mocap::baselines
