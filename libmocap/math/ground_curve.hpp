// A curve on the ground to be followed, as an open polyline.
//
// Wang, Chai, Xia 2018, section 5.2: for the root's projection on the ground in every frame, c_near,i is the point of the user's curve nearest to it, and
//   P_curve ~ prod_i exp(-|root(s_i) - c_near,i|^2 / sigma_fit^2)                                     (eq. 17)
#pragma once
#include <cstddef>
#include <vector>

#include "libmocap/math/rotation.hpp"

namespace mocap {

// N >= 2 points joined by straight segments; metres, world, the ground plane of Z up. s is the arc length from the first point, 0 .. length(). It may cross or touch itself
// and end where it starts. Immutable, thread-safe.
//
// Accuracy  s sums N - 1 segment lengths: within 2e-16 N length(). A segment too short to change the sum has length 0 along the curve and does no harm.
class GroundCurve {
 public:
  static constexpr double kFarthest = 1e9;  // |x|, |y| at most, metres: a double still tells 0.2 um apart there, and no square overflows

  // Points equal to the one before are dropped. Error(data) for fewer than 2 different points, and (naming the point, counted from 0) for coordinates that are not finite or
  // beyond kFarthest. O(N).
  explicit GroundCurve(std::vector<Vector2> points);

  const std::vector<Vector2>& points() const { return points_; }
  double length() const { return start_.back(); }

  // s outside of 0 .. length() means the nearer end; the corners are exact. tangent_at is unit: along the segment that begins at a corner, at the end along the last one.
  // Not a number gives not a number. O(log N).
  Vector2 point_at(double s) const;
  Vector2 tangent_at(double s) const;

  struct Nearest {
    double s;
    Vector2 point;    // point_at(s) within rounding
    double distance;  // |p - point|
  };
  // The point of the curve nearest to p; of several at the same distance, the one of lowest s. A p that is not finite is at no finite distance: s is 0 (or `from`).
  // O(N), about 3 ns a segment.
  Nearest nearest(const Vector2& p) const { return nearest(p, 0, length()); }
  // The same among the points from <= s <= to, so that a curve that crosses itself is followed in order. What lies outside of 0 .. length() is left out; an interval wholly
  // outside means the nearer end. Error(internal) unless from <= to. O(log N + segments between).
  Nearest nearest(const Vector2& p, double from, double to) const;

  // length() / n apart by arc length along this curve, both ends included, with the whole number n >= 1 nearest to length() / spacing; straight between, so corners are cut
  // and length() may fall. A closed curve gets more points where n would leave one place alone. Error(usage) for a spacing that is not above 0 or n above ten million.
  // O(n log N).
  GroundCurve resampled(double spacing) const;

  // Direction in which it sets out, radians from +X to +Y: that from its first point to the one 0.3 m on (or to its end, where it is shorter), so that a crooked first segment
  // counts for little; that of tangent_at(0) where these two coincide (a loop of 0.3 m, within 1e-6 of that).
  double initial_heading() const;
  // Turned about its start and moved: the first point is exactly `origin` and initial_heading() is `heading` (radians, up to whole turns, within 1e-12 for points
  // near the origin). Errors as the constructor's.
  GroundCurve placed(const Vector2& origin, double heading) const;

 private:
  std::size_t segment_at(double s) const;  // the last segment that starts at or before s

  std::vector<Vector2> points_;     // [N]
  std::vector<Vector2> direction_;  // [N-1] unit
  std::vector<double> start_;       // [N] arc length
};

}  // namespace mocap
