#include "libmocap/corpus/curves.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "libmocap/base/error.hpp"

namespace mocap::corpus {
namespace {

constexpr double kTau = 2 * std::numbers::pi;

}  // namespace

double smoothstep(double u) {
  u = std::clamp(u, 0.0, 1.0);
  return u * u * (3 - 2 * u);
}

double mix(double a, double b, double u) { return a + (b - a) * u; }

double radians(double degrees) { return degrees * std::numbers::pi / 180; }

SlowNoise::SlowNoise(Random& random, double low_hz, double high_hz) {
  for (Wave& w : waves_) {
    w.omega = kTau * random.uniform(low_hz, high_hz);
    w.phase = kTau * random.uniform();
  }
}

// Four waves of variance 1/2 each, scaled by 1/sqrt(2).
double SlowNoise::operator()(double t) const {
  double sum = 0;
  for (const Wave& w : waves_) sum += std::sin(w.omega * t + w.phase);
  return sum * std::numbers::sqrt2 / 2;
}

void KeyCurve::add(double t, double value) {
  if (!t_.empty() && !(t > t_.back()))
    throw Error(Exit::internal, {},
                "KeyCurve: a key at " + std::to_string(t) + " s after one at " + std::to_string(t_.back()) + " s");
  t_.push_back(t);
  value_.push_back(value);
}

void KeyCurve::finish() {
  const std::size_t n = t_.size();
  slope_.assign(n, 0.0);
  for (std::size_t i = 1; i + 1 < n; ++i) {
    const double h0 = t_[i] - t_[i - 1], h1 = t_[i + 1] - t_[i];
    const double d0 = (value_[i] - value_[i - 1]) / h0, d1 = (value_[i + 1] - value_[i]) / h1;
    // Weighted harmonic mean: zero at an extremum, so a flat stretch stays flat.
    if (d0 * d1 > 0) slope_[i] = 3 * (h0 + h1) / ((2 * h1 + h0) / d0 + (h1 + 2 * h0) / d1);
  }
}

KeyCurve::Sample KeyCurve::at(double t) const {
  if (t <= t_.front()) return {value_.front(), 0};
  if (t >= t_.back()) return {value_.back(), 0};
  const auto i = static_cast<std::size_t>(std::upper_bound(t_.begin(), t_.end(), t) - t_.begin()) - 1;
  const double h = t_[i + 1] - t_[i], u = (t - t_[i]) / h, u2 = u * u, u3 = u2 * u;
  const double value = (2 * u3 - 3 * u2 + 1) * value_[i] + (u3 - 2 * u2 + u) * h * slope_[i] +
                       (3 * u2 - 2 * u3) * value_[i + 1] + (u3 - u2) * h * slope_[i + 1];
  const double slope = 6 * (u2 - u) * (value_[i] - value_[i + 1]) / h + (3 * u2 - 4 * u + 1) * slope_[i] +
                       (3 * u2 - 2 * u) * slope_[i + 1];
  return {value, slope};
}

void QuinticPath::add(double t, double position, double velocity, double acceleration) {
  if (!knots_.empty() && !(t > knots_.back().t))
    throw Error(
        Exit::internal, {},
        "QuinticPath: a knot at " + std::to_string(t) + " s after one at " + std::to_string(knots_.back().t) + " s");
  knots_.push_back({t, position, velocity, acceleration});
}

double QuinticPath::operator()(double t) const {
  if (t <= knots_.front().t) return knots_.front().p;
  if (t >= knots_.back().t) return knots_.back().p;
  const auto next = std::upper_bound(knots_.begin(), knots_.end(), t, [](double x, const Knot& k) { return x < k.t; });
  const Knot& a = *(next - 1);
  const Knot& b = *next;
  const double h = b.t - a.t, u = (t - a.t) / h;
  // Taylor part of the left knot plus the three terms that meet the right one.
  const double va = a.v * h, aa = a.a * h * h, vb = b.v * h, ab = b.a * h * h;
  const double p = b.p - a.p - va - aa / 2, v = vb - va - aa, c = ab - aa;
  const double c3 = 10 * p - 4 * v + c / 2, c4 = -15 * p + 7 * v - c, c5 = 6 * p - 3 * v + c / 2;
  return a.p + u * (va + u * (aa / 2 + u * (c3 + u * (c4 + u * c5))));
}

double Fourier::operator()(double phase) const {
  return mean + a1 * std::cos(kTau * (phase - lag)) + a2 * std::cos(2 * kTau * (phase - lag2));
}

}  // namespace mocap::corpus
