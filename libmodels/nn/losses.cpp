#include "libmodels/nn/losses.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace mocap::nn {
namespace {

using torch::Tensor;
using torch::autograd::AutogradContext;
using torch::autograd::variable_list;

// p = conj(t) q.
template <class T>
inline void relative(const T* t, const T* q, T* p) {
  p[0] = t[0] * q[0] + t[1] * q[1] + t[2] * q[2] + t[3] * q[3];
  p[1] = t[0] * q[1] - q[0] * t[1] - (t[2] * q[3] - t[3] * q[2]);
  p[2] = t[0] * q[2] - q[0] * t[2] - (t[3] * q[1] - t[1] * q[3]);
  p[3] = t[0] * q[3] - q[0] * t[3] - (t[1] * q[2] - t[2] * q[1]);
}

template <class T>
void distances(std::int64_t count, const T* q, const T* t, T* angle) {
  for (std::int64_t i = 0; i < count; ++i) {
    T p[4];
    relative(t + 4 * i, q + 4 * i, p);
    angle[i] = 2 * std::atan2(std::sqrt(p[1] * p[1] + p[2] * p[2] + p[3] * p[3]), std::abs(p[0]));
  }
}

template <class T>
void gradients(std::int64_t count, const T* q, const T* t, const T* dangle, T* dq) {
  for (std::int64_t i = 0; i < count; ++i, q += 4, t += 4, dq += 4) {
    T p[4], g[4];
    relative(t, q, p);
    const T s = std::sqrt(p[1] * p[1] + p[2] * p[2] + p[3] * p[3]), c = std::abs(p[0]), norm2 = s * s + c * c;
    if (!(norm2 > T(1e-24))) {
      std::fill_n(dq, 4, T(0));
      continue;
    }
    const T least = static_cast<T>(kGeodesicFloor / 2) * std::sqrt(norm2);
    const T along = 2 * c / (norm2 * std::max(s, least)) * dangle[i];
    g[0] = -2 * std::min(s, s * s / least) / norm2 * (p[0] < 0 ? -dangle[i] : dangle[i]);
    for (int j = 1; j < 4; ++j) g[j] = along * p[j];
    // dq = t g, the transpose of q -> conj(t) q.
    dq[0] = t[0] * g[0] - t[1] * g[1] - t[2] * g[2] - t[3] * g[3];
    dq[1] = t[0] * g[1] + g[0] * t[1] + (t[2] * g[3] - t[3] * g[2]);
    dq[2] = t[0] * g[2] + g[0] * t[2] + (t[3] * g[1] - t[1] * g[3]);
    dq[3] = t[0] * g[3] + g[0] * t[3] + (t[1] * g[2] - t[2] * g[1]);
  }
}

struct Geodesic : torch::autograd::Function<Geodesic> {
  static Tensor forward(AutogradContext* ctx, const Tensor& q, const Tensor& target) {
    TORCH_CHECK(q.sizes() == target.sizes() && q.size(-1) == 4,
                "geodesic_distance: shapes differ or are not quaternions");
    const Tensor a = q.contiguous(), b = target.to(q.scalar_type()).contiguous();
    ctx->save_for_backward({a, b});
    const Tensor angle = at::empty(q.sizes().slice(0, q.dim() - 1), a.options());
    if (a.scalar_type() == torch::kDouble)
      distances(angle.numel(), a.data_ptr<double>(), b.data_ptr<double>(), angle.data_ptr<double>());
    else
      distances(angle.numel(), a.data_ptr<float>(), b.data_ptr<float>(), angle.data_ptr<float>());
    return angle;
  }
  static variable_list backward(AutogradContext* ctx, variable_list grads) {
    const variable_list saved = ctx->get_saved_variables();
    const Tensor &a = saved[0], &b = saved[1];
    const Tensor g = grads[0].contiguous(), dq = at::empty(a.sizes(), a.options());
    if (a.scalar_type() == torch::kDouble)
      gradients(g.numel(), a.data_ptr<double>(), b.data_ptr<double>(), g.data_ptr<double>(), dq.data_ptr<double>());
    else
      gradients(g.numel(), a.data_ptr<float>(), b.data_ptr<float>(), g.data_ptr<float>(), dq.data_ptr<float>());
    return {dq, Tensor()};
  }
};

}  // namespace

Tensor geodesic_distance(const Tensor& q, const Tensor& target) { return Geodesic::apply(q, target); }

Tensor quaternion_d2(const Tensor& q, const Tensor& target) { return 1 - (q * target).sum(-1).abs(); }

Tensor quaternion_d3(const Tensor& q, const Tensor& target) {
  return torch::min((q - target).square().sum(-1), (q + target).square().sum(-1));
}

Tensor normalize_quaternions(const Tensor& q) { return q / q.norm(2, -1, true).clamp_min(1e-8); }

Tensor unit_norm_penalty(const Tensor& q) { return (q.square().sum(-1) - 1).abs(); }

Tensor joint_weights(const Skeleton& skeleton, double floor) {
  const std::vector<double> alpha = impact_factors(skeleton, floor);
  return torch::tensor(alpha, torch::kDouble).to(torch::kFloat);
}

Tensor gaussian_kl(const Tensor& mu_q, const Tensor& sigma_q, const Tensor& mu_p, const Tensor& sigma_p) {
  const Tensor ratio = sigma_q / sigma_p;
  return (0.5 * (ratio.square() + ((mu_q - mu_p) / sigma_p).square() - 1) - ratio.log()).sum(-1);
}

}  // namespace mocap::nn
