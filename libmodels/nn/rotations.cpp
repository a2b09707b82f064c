#include "libmodels/nn/rotations.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "libmodels/nn/mlp.hpp"

namespace mocap::nn {
namespace {

using torch::Tensor;
using torch::autograd::AutogradContext;
using torch::autograd::variable_list;

template <class T>
inline T dot3(const T* a, const T* b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
template <class T>
inline void cross(const T* a, const T* b, T* out) {
  const T x = a[1] * b[2] - a[2] * b[1], y = a[2] * b[0] - a[0] * b[2], z = a[0] * b[1] - a[1] * b[0];
  out[0] = x, out[1] = y, out[2] = z;
}
template <class T>
inline void multiply(const T* a, const T* b, T* out) {  // Hamilton
  const T w = a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3], x = a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
          y = a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1], z = a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0];
  out[0] = w, out[1] = x, out[2] = y, out[3] = z;
}
// v turned by q, or by its inverse for side = -1.
template <class T>
inline void rotate(const T* q, const T* v, T* out, T side = T(1)) {
  T t[3], u[3] = {side * q[1], side * q[2], side * q[3]}, s[3];
  cross(u, v, t);
  cross(u, t, s);
  for (int i = 0; i < 3; ++i) out[i] = v[i] + 2 * (q[0] * t[i] + s[i]);
}

// A function of a few numbers, applied to the last dimension. Op: kIn, kOut, value(x, y), gradient(x, g, dx).
template <class Op>
struct Map : torch::autograd::Function<Map<Op>> {
  template <class T>
  static void values(const Tensor& x, const Tensor& y) {
    const T* in = x.data_ptr<T>();
    T* out = y.data_ptr<T>();
    for (std::int64_t i = x.numel() / Op::kIn; i-- > 0; in += Op::kIn, out += Op::kOut) Op::value(in, out);
  }
  template <class T>
  static void gradients(const Tensor& x, const Tensor& g, const Tensor& dx) {
    const T *in = x.data_ptr<T>(), *along = g.data_ptr<T>();
    T* out = dx.data_ptr<T>();
    for (std::int64_t i = x.numel() / Op::kIn; i-- > 0; in += Op::kIn, along += Op::kOut, out += Op::kIn) Op::gradient(in, along, out);
  }
  static Tensor forward(AutogradContext* ctx, const Tensor& input) {
    TORCH_CHECK(input.size(-1) == Op::kIn, "a rotation of ", input.size(-1), " numbers, expected ", Op::kIn);
    const Tensor x = input.contiguous();
    std::vector<std::int64_t> sizes = x.sizes().vec();
    sizes.back() = Op::kOut;
    const Tensor y = at::empty(sizes, x.options());
    ctx->save_for_backward({x});
    x.scalar_type() == torch::kDouble ? values<double>(x, y) : values<float>(x, y);
    return y;
  }
  static variable_list backward(AutogradContext* ctx, variable_list grads) {
    const Tensor x = ctx->get_saved_variables()[0], g = grads[0].contiguous(), dx = at::empty(x.sizes(), x.options());
    x.scalar_type() == torch::kDouble ? gradients<double>(x, g, dx) : gradients<float>(x, g, dx);
    return {dx};
  }
};

struct Exponential {
  static constexpr int kIn = 3, kOut = 4;
  // sin(n / 2) / n and its derivative by n over n.
  template <class T>
  static void factors(T n2, T& c, T& s, T& slope) {
    const T n = std::sqrt(n2);
    c = std::cos(n / 2);
    if (n2 < T(0.01)) {
      s = T(0.5) - n2 / 48 + n2 * n2 / 3840;
      slope = T(-1) / 24 + n2 / 960;
    } else {
      s = std::sin(n / 2) / n;
      slope = (c / 2 - s) / n2;
    }
  }
  template <class T>
  static void value(const T* v, T* q) {
    T s, slope;
    factors(dot3(v, v), q[0], s, slope);
    for (int i = 0; i < 3; ++i) q[i + 1] = s * v[i];
  }
  template <class T>
  static void gradient(const T* v, const T* g, T* dv) {
    T c, s, slope;
    factors(dot3(v, v), c, s, slope);
    const T along = slope * dot3(g + 1, v) - s / 2 * g[0];
    for (int i = 0; i < 3; ++i) dv[i] = s * g[i + 1] + along * v[i];
  }
};

struct GramSchmidt {
  static constexpr int kIn = 9, kOut = 4;
  static constexpr double kShortest = 1e-6;
  template <class T>
  struct Frame {
    T x[3], y[3], z[3], a[3], b[3], along, length_a, length_b;
    bool valid;
    explicit Frame(const T* m) {
      for (int i = 0; i < 3; ++i) a[i] = m[3 * i], b[i] = m[3 * i + 1];
      length_a = std::sqrt(dot3(a, a));
      valid = length_a > T(kShortest);
      for (int i = 0; i < 3; ++i) x[i] = a[i] / length_a;
      along = dot3(x, b);
      for (int i = 0; i < 3; ++i) y[i] = b[i] - along * x[i];
      length_b = std::sqrt(dot3(y, y));
      valid = valid && length_b > T(kShortest);
      for (int i = 0; i < 3; ++i) y[i] /= length_b;
      cross(x, y, z);
    }
  };
  template <class T>
  static void quaternion(const Frame<T>& f, T* q) {
    // 4 q_i^2; the largest is at least 1.
    const T xx = f.x[0], yy = f.y[1], zz = f.z[2], squares[4] = {1 + xx + yy + zz, 1 + xx - yy - zz, 1 - xx + yy - zz, 1 - xx - yy + zz};
    const T wx = f.y[2] - f.z[1], wy = f.z[0] - f.x[2], wz = f.x[1] - f.y[0], xy = f.y[0] + f.x[1], xz = f.z[0] + f.x[2], yz = f.z[1] + f.y[2];
    const auto k = std::max_element(squares, squares + 4) - squares;
    const T r = std::sqrt(squares[k]), parts[4][4] = {{r * r, wx, wy, wz}, {wx, r * r, xy, xz}, {wy, xy, r * r, yz}, {wz, xz, yz, r * r}};
    T norm2 = 0;
    for (int i = 0; i < 4; ++i) q[i] = parts[k][i] / (2 * r), norm2 += q[i] * q[i];
    const T scale = (q[0] < 0 ? -1 : 1) / std::sqrt(norm2);
    for (int i = 0; i < 4; ++i) q[i] *= scale;
  }
  template <class T>
  static void value(const T* m, T* q) {
    const Frame<T> f(m);
    if (f.valid) return quaternion(f, q);
    q[0] = 1, q[1] = q[2] = q[3] = 0;
  }
  template <class T>
  static void gradient(const T* m, const T* g, T* dm) {
    const Frame<T> f(m);
    std::fill_n(dm, 9, T(0));
    if (!f.valid) return;
    T q[4], conjugate[4], p[4];
    quaternion(f, q);
    for (int i = 0; i < 4; ++i) conjugate[i] = i ? -q[i] : q[i];
    multiply(g, conjugate, p);
    // A turn by u before the rest changes q by (0, u) q / 2 and each column c by u x c: half of the gradient u, crossed with the
    // columns, does the same along all turns.
    const T u[3] = {p[1] / 4, p[2] / 4, p[3] / 4};
    T dx[3], dy[3], dz[3], t[3];
    cross(u, f.x, dx);
    cross(u, f.y, dy);
    cross(u, f.z, dz);
    cross(f.y, dz, t);  // z = x cross y
    for (int i = 0; i < 3; ++i) dx[i] += t[i];
    cross(dz, f.x, t);
    for (int i = 0; i < 3; ++i) dy[i] += t[i];
    const T radial_y = dot3(f.y, dy);
    for (int i = 0; i < 3; ++i) dy[i] = (dy[i] - radial_y * f.y[i]) / f.length_b;  // now of b - (x . b) x
    const T across = dot3(f.x, dy);
    for (int i = 0; i < 3; ++i) dx[i] -= f.along * dy[i] + across * f.b[i];
    const T radial_x = dot3(f.x, dx);
    for (int i = 0; i < 3; ++i) {
      dm[3 * i] = (dx[i] - radial_x * f.x[i]) / f.length_a;
      dm[3 * i + 1] = dy[i] - across * f.x[i];
    }
  }
};

struct Constraints {
  static constexpr int kIn = 9, kOut = 2;
  template <class T>
  static T products(const T* m, T (*e)[3]) {  // M M^T - I; returns det M
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) e[i][j] = dot3(m + 3 * i, m + 3 * j) - (i == j);
    T t[3];
    cross(m, m + 3, t);
    return dot3(t, m + 6);
  }
  template <class T>
  static void value(const T* m, T* out) {
    T e[3][3];
    out[1] = std::abs(products(m, e) - 1);
    out[0] = dot3(e[0], e[0]) + dot3(e[1], e[1]) + dot3(e[2], e[2]);
  }
  template <class T>
  static void gradient(const T* m, const T* g, T* dm) {
    T e[3][3], t[3];
    const T determinant = products(m, e), side = determinant > 1 ? g[1] : (determinant < 1 ? -g[1] : T(0));
    for (int i = 0; i < 3; ++i) {
      cross(m + (i + 1) % 3 * 3, m + (i + 2) % 3 * 3, t);
      for (int c = 0; c < 3; ++c) dm[3 * i + c] = side * t[c] + 4 * g[0] * (e[i][0] * m[c] + e[i][1] * m[3 + c] + e[i][2] * m[6 + c]);
    }
  }
};

// One frame's forward kinematics and its transpose.
template <class T>
class Body {
 public:
  explicit Body(const Skeleton& s) : s_(s), joints_(s.joint_count()), world_(joints_ * 4), place_(joints_ * 3), force_(joints_ * 3), moment_(joints_ * 3) {
    for (const Vector3& o : s.rest_offsets)
      for (int i = 0; i < 3; ++i) offsets_.push_back(static_cast<T>(o[i]));
    for (const auto& e : s.end_sites)
      for (int i = 0; i < 3; ++i) tips_.push_back(static_cast<T>(e.offset[i]));
  }
  void pose(const T* q) {
    std::copy_n(q, 4, world_.data());
    std::fill_n(place_.data(), 3, T(0));
    for (int j = 1; j < joints_; ++j) {
      const auto parent = s_.parents[static_cast<std::size_t>(j)];
      const T *above = &world_[static_cast<std::size_t>(4 * parent)], *from = &place_[static_cast<std::size_t>(3 * parent)];
      multiply(above, q + 4 * j, &world_[static_cast<std::size_t>(4 * j)]);
      T* p = &place_[static_cast<std::size_t>(3 * j)];
      rotate(above, &offsets_[static_cast<std::size_t>(3 * j)], p);
      for (int i = 0; i < 3; ++i) p[i] += from[i];
    }
  }
  void tip(std::size_t e, T* p) const {
    const auto parent = static_cast<std::size_t>(s_.end_sites[e].parent);
    rotate(&world_[4 * parent], &tips_[3 * e], p);
    for (std::size_t i = 0; i < 3; ++i) p[i] += place_[3 * parent + i];
  }
  void positions(T* out) const {
    out = std::copy(place_.begin() + 3, place_.end(), out);
    for (std::size_t e = 0; e < s_.end_sites.size(); ++e, out += 3) tip(e, out);
  }
  // A turn of joint j by w moves what hangs from it by w x (p - p_j): its gradient is the torque of the gradients about p_j.
  void gradient(const T* q, const T* g, T* dq) {
    std::fill(force_.begin(), force_.end(), T(0));
    std::fill(moment_.begin(), moment_.end(), T(0));
    const auto push = [&](int joint, const T* p, const T* f) {
      T m[3];
      cross(p, f, m);
      for (int i = 0; i < 3; ++i) force_[static_cast<std::size_t>(3 * joint + i)] += f[i], moment_[static_cast<std::size_t>(3 * joint + i)] += m[i];
    };
    const T* ends = g + 3 * (joints_ - 1);
    for (std::size_t e = 0; e < s_.end_sites.size(); ++e, ends += 3) {
      T p[3];
      tip(e, p);
      push(s_.end_sites[e].parent, p, ends);
    }
    for (int j = joints_; j-- > 0;) {
      const auto at = static_cast<std::size_t>(3 * j);
      T torque[3], u[4] = {};
      cross(&place_[at], &force_[at], torque);
      for (std::size_t i = 0; i < 3; ++i) torque[i] = moment_[at + i] - torque[i];
      if (j > 0) {
        const int parent = s_.parents[static_cast<std::size_t>(j)];
        rotate(&world_[static_cast<std::size_t>(4 * parent)], torque, u + 1, T(-1));
        push(j, &place_[at], g + 3 * (j - 1));
        for (std::size_t i = 0; i < 3; ++i) force_[static_cast<std::size_t>(3 * parent) + i] += force_[at + i], moment_[static_cast<std::size_t>(3 * parent) + i] += moment_[at + i];
      } else {
        std::copy_n(torque, 3, u + 1);
      }
      multiply(u, q + 4 * j, dq + 4 * j);
      for (int i = 0; i < 4; ++i) dq[4 * j + i] *= 2;
    }
  }

 private:
  const Skeleton& s_;
  const int joints_;
  std::vector<T> offsets_, tips_, world_, place_, force_, moment_;
};

template <class T>
void body_positions(const Skeleton& s, const Tensor& q, const Tensor& out) {
  Body<T> body(s);
  for (std::int64_t n = 0; n < q.size(0); ++n) {
    body.pose(q.data_ptr<T>() + n * q.size(1) * 4);
    body.positions(out.data_ptr<T>() + n * out.size(1) * 3);
  }
}
template <class T>
void body_gradients(const Skeleton& s, const Tensor& q, const Tensor& g, const Tensor& dq) {
  Body<T> body(s);
  for (std::int64_t n = 0; n < q.size(0); ++n) {
    const std::int64_t at = n * q.size(1) * 4;
    body.pose(q.data_ptr<T>() + at);
    body.gradient(q.data_ptr<T>() + at, g.data_ptr<T>() + n * g.size(1) * 3, dq.data_ptr<T>() + at);
  }
}

struct Positions : torch::autograd::Function<Positions> {
  static Tensor forward(AutogradContext* ctx, const Tensor& rotations, const Skeleton* skeleton, std::int64_t points) {
    TORCH_CHECK(rotations.dim() == 3 && rotations.size(1) == skeleton->joint_count() && rotations.size(2) == 4, "body positions: not (frames, joints, 4) quaternions");
    const Tensor q = rotations.contiguous(), out = at::empty({q.size(0), points, 3}, q.options());
    ctx->save_for_backward({q});
    auto kept = c10::make_intrusive<Tape<Skeleton>>();
    kept->kept = *skeleton;
    ctx->saved_data["skeleton"] = c10::IValue::make_capsule(kept);
    q.scalar_type() == torch::kDouble ? body_positions<double>(*skeleton, q, out) : body_positions<float>(*skeleton, q, out);
    return out;
  }
  static variable_list backward(AutogradContext* ctx, variable_list grads) {
    const auto holder = ctx->saved_data["skeleton"].toCapsule();
    const Skeleton& skeleton = static_cast<Tape<Skeleton>&>(*holder).kept;
    const Tensor q = ctx->get_saved_variables()[0], g = grads[0].contiguous(), dq = at::empty(q.sizes(), q.options());
    q.scalar_type() == torch::kDouble ? body_gradients<double>(skeleton, q, g, dq) : body_gradients<float>(skeleton, q, g, dq);
    return {dq, Tensor(), Tensor()};
  }
};

template <class T>
void continue_signs(Tensor& q) {
  const std::int64_t frames = q.size(1), joints = q.size(2);
  for (std::int64_t b = 0; b < q.size(0); ++b)
    for (std::int64_t j = 0; j < joints; ++j) {
      T *first = q.data_ptr<T>() + (b * frames * joints + j) * 4, w = 0;
      for (std::int64_t t = 0; t < frames; ++t) {
        T* now = first + t * joints * 4;
        if (t > 0) {
          const T* before = now - joints * 4;
          if (now[0] * before[0] + dot3(now + 1, before + 1) < 0)
            for (int i = 0; i < 4; ++i) now[i] = -now[i];
        }
        w += now[0];
      }
      if (w < 0)
        for (std::int64_t t = 0; t < frames; ++t)
          for (int i = 0; i < 4; ++i) first[t * joints * 4 + i] *= -1;
    }
}

}  // namespace

Tensor quaternions_of_vectors(const Tensor& v) { return Map<Exponential>::apply(v); }

Tensor quaternions_of_matrices(const Tensor& m) { return Map<GramSchmidt>::apply(m); }

Tensor matrix_constraints(const Tensor& m) { return Map<Constraints>::apply(m); }

void make_signs_continuous(Tensor& q) {
  TORCH_CHECK(q.dim() == 4 && q.size(3) == 4 && q.is_contiguous(), "make_signs_continuous: not contiguous (rows, frames, joints, 4)");
  q.scalar_type() == torch::kDouble ? continue_signs<double>(q) : continue_signs<float>(q);
}

Tensor BodyPositions::operator()(const Tensor& q) const { return Positions::apply(q, &skeleton_, points()); }

}  // namespace mocap::nn
