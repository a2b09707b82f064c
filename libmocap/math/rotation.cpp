#include "libmocap/math/rotation.hpp"

#include <cmath>
#include <numbers>

#include "libmocap/base/error.hpp"

namespace mocap {
namespace {

constexpr double kPi = std::numbers::pi;

Quaternion axis_rotation(int axis, double angle) {
  Quaternion q(std::cos(angle / 2), 0, 0, 0);
  q.coeffs()[axis] = std::sin(angle / 2);
  return q;
}

}  // namespace

Quaternion exp_map(const Vector3& v) {
  const double angle = v.norm();
  // sin(x/2)/x to second order: exact in double below 1e-4.
  const double s = angle < 1e-4 ? 0.5 - angle * angle / 48 : std::sin(angle / 2) / angle;
  Quaternion q(std::cos(angle / 2), s * v.x(), s * v.y(), s * v.z());
  q.normalize();
  return q;
}

Vector3 log_map(const Quaternion& q) {
  const double sign = q.w() < 0 ? -1 : 1;
  const double w = sign * q.w(), n = q.vec().norm();
  const double angle = 2 * std::atan2(n, w);
  const double scale = n < 1e-8 ? 2 / w : angle / n;
  return sign * scale * q.vec();
}

RotationMatrix to_matrix(const Quaternion& q) { return q.toRotationMatrix(); }

Quaternion to_quaternion(const RotationMatrix& m) {
  // allFinite first: maxCoeff passes over NaN.
  if (!m.allFinite() || !((m * m.transpose() - RotationMatrix::Identity()).cwiseAbs().maxCoeff() < 1e-3) || m.determinant() < 0)
    refuse({}, "a 3x3 matrix of determinant " + std::to_string(m.determinant()) + ", expected a rotation");
  Quaternion q(m);
  q.normalize();
  return q;
}

RotationMatrix orthonormalize(const RotationMatrix& m) {
  RotationMatrix r;
  r.col(0) = m.col(0).normalized();
  r.col(1) = (m.col(1) - r.col(0) * r.col(0).dot(m.col(1))).normalized();
  r.col(2) = r.col(0).cross(r.col(1));
  return r;
}

SixD to_six_d(const Quaternion& q) {
  const RotationMatrix m = to_matrix(q);
  SixD v;
  v << m.col(0), m.col(1);
  return v;
}

Quaternion from_six_d(const SixD& v) {
  RotationMatrix m;
  m.col(0) = v.head<3>();
  m.col(1) = v.tail<3>();
  m.col(2).setZero();
  if (!(m.col(0).cross(m.col(1)).norm() > 1e-12 * m.col(0).norm() * m.col(1).norm()))
    refuse({}, "a 6D rotation whose two columns are parallel, zero or not finite, expected independent ones");
  return to_quaternion(orthonormalize(m));
}

EulerOrder EulerOrder::parse(std::string_view text) {
  EulerOrder order;
  order.count = static_cast<int>(text.size());
  if (text.empty() || text.size() > 3) refuse_usage("rotation order '" + std::string(text) + "', expected one to three of X, Y, Z");
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = static_cast<char>(text[i] & ~0x20);
    if (c < 'X' || c > 'Z') refuse_usage("rotation order '" + std::string(text) + "', expected one to three of X, Y, Z");
    order.axes[i] = c - 'X';
  }
  return order;
}

std::string EulerOrder::text() const {
  std::string s;
  for (int i = 0; i < count; ++i) s += static_cast<char>('X' + axes[static_cast<std::size_t>(i)]);
  return s;
}

Quaternion from_euler(const Vector3& angles, const EulerOrder& order) {
  Quaternion q = axis_rotation(order.axes[0], angles[0]);
  for (int i = 1; i < order.count; ++i) q = q * axis_rotation(order.axes[static_cast<std::size_t>(i)], angles[i]);
  return q;
}

Vector3 to_euler(const Quaternion& q, const EulerOrder& order, const Vector3* near) {
  const int i = order.axes[0], j = order.axes[1], k = order.axes[2];
  if (order.count != 3 || i == j || j == k || i == k)
    throw Error(Exit::usage, {}, "rotation order '" + order.text() + "', expected three different axes");
  // R = Ri(a) Rj(b) Rk(c); e = +1 for cyclic orders. R(i,k) = e sin b; the rest follows by reading entries.
  const double e = (j - i + 3) % 3 == 1 ? 1 : -1;
  const RotationMatrix m = to_matrix(q.normalized());
  const double cos_b = std::hypot(m(i, i), m(i, j));
  Vector3 v;
  v[1] = std::atan2(e * m(i, k), cos_b);
  // At gimbal lock only a +- c is determined: a is free.
  v[0] = cos_b > 1e-12 ? std::atan2(-e * m(j, k), m(k, k)) : near ? (*near)[0] : 0.0;
  // c is read from Ri(-a) R, not from R: near the pole a is noise, and this c makes up for it.
  const double s = e * std::sin(v[0]), c = std::cos(v[0]);
  v[2] = std::atan2(e * (c * m(j, i) + s * m(k, i)), c * m(j, j) + s * m(k, j));
  if (!near) {
    for (int n = 0; n < 3; ++n) v[n] = wrap_angle(v[n]);
    return v;
  }
  const auto unwrap = [&](Vector3 u) {
    for (int n = 0; n < 3; ++n) u[n] += 2 * kPi * std::round(((*near)[n] - u[n]) / (2 * kPi));
    return u;
  };
  const Vector3 first = unwrap(v), second = unwrap(Vector3(v[0] + kPi, kPi - v[1], v[2] + kPi));
  return (first - *near).squaredNorm() <= (second - *near).squaredNorm() ? first : second;
}

Quaternion rotation_between(const Vector3& from, const Vector3& to) {
  const Vector3 a = from.normalized(), b = to.normalized();
  const Vector3 sum = a + b;
  Vector3 n = a.cross(b);
  if (sum.norm() < 1e-12) {
    n = Vector3::UnitZ() - a * a.z();
    if (n.norm() < 1e-6) n = Vector3::UnitX() - a * a.x();
    n.normalize();
    return Quaternion(0, n.x(), n.y(), n.z());
  }
  Quaternion q(1 + a.dot(b), n.x(), n.y(), n.z());
  if (a.dot(b) < 0) {
    // 1 + cos loses its digits here, half-angle lengths do not; the axis must stay perpendicular to both.
    n = (n - a * a.dot(n)).normalized() * (a - b).norm();
    q = Quaternion(sum.norm(), n.x(), n.y(), n.z());
  }
  q.normalize();
  return q;
}

Quaternion frame_from(const Vector3& along, const Vector3& up) {
  const Vector3 x = along.normalized();
  Vector3 y = up.cross(x);
  if (!(y.norm() > 1e-9 * up.norm())) throw Error(Exit::internal, {}, "frame_from: the two directions are parallel");
  y.normalize();
  RotationMatrix m;
  m.col(0) = x;
  m.col(1) = y;
  m.col(2) = x.cross(y);
  return to_quaternion(m);
}

Quaternion twist_about(const Quaternion& q, const Vector3& axis) {
  const double along = q.vec().dot(axis), n = std::hypot(q.w(), along);
  if (n < 1e-12) return Quaternion::Identity();
  const Vector3 v = axis * (along / n);
  return Quaternion(q.w() / n, v.x(), v.y(), v.z());
}

double yaw_of(const Quaternion& q) { return std::hypot(q.w(), q.z()) < 1e-12 ? 0 : wrap_angle(2 * std::atan2(q.z(), q.w())); }

Quaternion yaw_rotation(double yaw) { return axis_rotation(2, yaw); }

Quaternion slerp(const Quaternion& a, const Quaternion& b, double t) {
  double c = a.dot(b);
  const double sign = c < 0 ? -1 : 1;
  c = std::abs(c);
  double wa = 1 - t, wb = t;
  if (c < 1 - 1e-10) {
    const double angle = std::atan2(std::sqrt((1 - c) * (1 + c)), c), s = std::sin(angle);
    wa = std::sin((1 - t) * angle) / s;
    wb = std::sin(t * angle) / s;
  }
  Quaternion q;
  q.coeffs() = wa * a.coeffs() + sign * wb * b.coeffs();
  q.normalize();
  return q;
}

double geodesic_distance(const Quaternion& a, const Quaternion& b) {
  const Quaternion d = a.conjugate() * b;
  return 2 * std::atan2(d.vec().norm(), std::abs(d.w()));
}

double geodesic_distance(const RotationMatrix& a, const RotationMatrix& b) {
  const RotationMatrix d = b * a.transpose();
  const Vector3 v(d(2, 1) - d(1, 2), d(0, 2) - d(2, 0), d(1, 0) - d(0, 1));
  return std::atan2(v.norm(), d.trace() - 1);
}

double quaternion_d2(const Quaternion& a, const Quaternion& b) { return 1 - std::abs(a.dot(b)); }

double quaternion_d3(const Quaternion& a, const Quaternion& b) {
  return std::min((a.coeffs() - b.coeffs()).squaredNorm(), (a.coeffs() + b.coeffs()).squaredNorm());
}

void make_sign_continuous(std::vector<Quaternion>& q, std::size_t first, std::size_t stride, std::size_t count) {
  if (count == 0) return;
  Quaternion& start = q[first];
  double lead = start.w();
  for (int n = 0; n < 3 && lead == 0; ++n) lead = start.coeffs()[n];
  if (lead < 0) start.coeffs() *= -1;
  for (std::size_t t = 1; t < count; ++t)
    if (q[first + t * stride].dot(q[first + (t - 1) * stride]) < 0) q[first + t * stride].coeffs() *= -1;
}

double wrap_angle(double a) {
  a = std::remainder(a, 2 * kPi);
  return a <= -kPi ? a + 2 * kPi : a;
}

}  // namespace mocap
