#include "libmocap/math/ground_curve.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "libmocap/base/error.hpp"

namespace mocap {
namespace {

constexpr double kSettingOut = 0.3;  // metres that say where a curve sets out to
constexpr double kMostPoints = 1e7;

double length_of(const Vector2& v) { return std::hypot(v.x(), v.y()); }  // no underflow: different points are apart

}  // namespace

GroundCurve::GroundCurve(std::vector<Vector2> points) : points_(std::move(points)) {
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const Vector2& p = points_[i];
    if (!p.allFinite()) refuse({}, fmt::format("point {} is ({}, {}), expected finite metres", i, p.x(), p.y()));
    if (p.cwiseAbs().maxCoeff() > kFarthest) refuse({}, fmt::format("point {} is ({}, {}), expected metres within +-{:g}", i, p.x(), p.y(), kFarthest));
  }
  points_.erase(std::unique(points_.begin(), points_.end(), [](const Vector2& a, const Vector2& b) { return a == b; }), points_.end());
  if (points_.size() < 2) refuse({}, fmt::format("a curve of {} different points, expected at least 2", points_.size()));
  direction_.reserve(points_.size() - 1);
  start_.reserve(points_.size());
  start_.push_back(0);
  for (std::size_t i = 0; i + 1 < points_.size(); ++i) {
    const Vector2 d = points_[i + 1] - points_[i];
    direction_.push_back((d / d.cwiseAbs().maxCoeff()).normalized());  // denormal differences too
    start_.push_back(start_.back() + length_of(d));
  }
}

std::size_t GroundCurve::segment_at(double s) const {
  const auto after = std::upper_bound(start_.begin() + 1, start_.end() - 1, s);
  return static_cast<std::size_t>(after - start_.begin()) - 1;
}

Vector2 GroundCurve::point_at(double s) const {
  s = std::clamp(s, 0.0, length());
  if (s == length()) return points_.back();
  const std::size_t i = segment_at(s);
  return points_[i] + (points_[i + 1] - points_[i]) * ((s - start_[i]) / (start_[i + 1] - start_[i]));
}

Vector2 GroundCurve::tangent_at(double s) const { return std::isnan(s) ? Vector2(s, s) : direction_[segment_at(s)]; }

GroundCurve::Nearest GroundCurve::nearest(const Vector2& p, double from, double to) const {
  if (!(from <= to)) throw Error(Exit::internal, {}, fmt::format("GroundCurve: nearest point between {} and {} m", from, to));
  from = std::clamp(from, 0.0, length());
  to = std::clamp(to, 0.0, length());
  Nearest best{from, point_at(from), 0};
  double least = (p - best.point).squaredNorm();
  for (std::size_t i = segment_at(from); i < direction_.size() && start_[i] <= to; ++i) {
    const double whole = start_[i + 1] - start_[i], low = std::max(from - start_[i], 0.0), high = std::min(to - start_[i], whole);
    const double along = std::clamp(direction_[i].dot(p - points_[i]), low, high);
    // A corner is the same point for the segments on both sides of it: then the distances are equal, and the lower s stays.
    const bool at_end = along >= whole;
    const Vector2 foot = at_end ? points_[i + 1] : Vector2(points_[i] + along * direction_[i]);
    const double squared = (p - foot).squaredNorm();
    if (squared < least) {
      least = squared;
      best.point = foot;
      best.s = at_end ? start_[i + 1] : std::min(std::clamp(start_[i] + along, from, to), start_[i + 1]);
    }
  }
  best.distance = length_of(p - best.point);
  return best;
}

GroundCurve GroundCurve::resampled(double spacing) const {
  if (!(spacing > 0)) refuse_usage(fmt::format("a spacing of {} m, expected one above 0", spacing));
  double n = std::max(1.0, std::round(length() / spacing));
  if (!(n <= kMostPoints)) refuse_usage(fmt::format("a spacing of {} m along {} m, expected at most {} points", spacing, length(), kMostPoints));
  // Of a figure eight with n = 2 both points may be its crossing; of any closed curve with n = 1 they are its start.
  for (;; ++n) {
    std::vector<Vector2> points;
    points.reserve(static_cast<std::size_t>(n) + 1);
    for (double k = 0; k < n; ++k) points.push_back(point_at(length() * (k / n)));
    points.push_back(points_.back());
    if (std::any_of(points.begin(), points.end(), [&](const Vector2& p) { return p != points[0]; })) return GroundCurve(std::move(points));
  }
}

double GroundCurve::initial_heading() const {
  const double ahead = std::min(kSettingOut, length());
  Vector2 chord = point_at(ahead) - points_[0];
  if (length_of(chord) < 1e-6 * ahead) chord = direction_[0];
  return std::atan2(chord.y(), chord.x());
}

GroundCurve GroundCurve::placed(const Vector2& origin, double heading) const {
  const Eigen::Matrix2d rotation = Eigen::Rotation2Dd(heading - initial_heading()).toRotationMatrix();
  std::vector<Vector2> points;
  points.reserve(points_.size());
  for (const Vector2& p : points_) points.push_back(origin + rotation * (p - points_[0]));
  return GroundCurve(std::move(points));
}

}  // namespace mocap
