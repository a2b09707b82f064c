#include "libmocap/io/frame_rows.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "libmocap/io/bvh_frames.hpp"

namespace mocap::io {
namespace {

constexpr double kHugeAngleDeg = 1e15;

// Sine and cosine of half of each angle, up to a common sign (q and -q are the same rotation); |deg| <= kHugeAngleDeg.
// Reducing by whole turns in degrees is exact; Taylor series of the quarter angle, |x| <= pi/4, are exact to 1e-16, and
// the double-angle formulas follow. No calls and no branches, so that the compiler takes several angles at once: a
// third of the time of sincos(), which would take longer than parsing the numbers.
void half_angle_sin_cos(const double* deg, double* sine, double* cosine, std::size_t n) {
  constexpr double kRound = 0x1.8p52;  // adding and subtracting it rounds to a whole number
  const auto series = [](double y, const auto&... coefficients) {
    double sum = 0;
    ((sum = sum * y + coefficients), ...);
    return sum;
  };
  for (std::size_t i = 0; i < n; ++i) {
    const double turns = (deg[i] * (1.0 / 360) + kRound) - kRound;
    const double x = (deg[i] - 360 * turns) * (std::numbers::pi / 720), y = x * x;
    const double s = x * series(y, -1. / 1307674368000, 1. / 6227020800, -1. / 39916800, 1. / 362880, -1. / 5040,
                                1. / 120, -1. / 6, 1.);
    const double c = series(y, 1. / 20922789888000, -1. / 87178291200, 1. / 479001600, -1. / 3628800, 1. / 40320,
                            -1. / 720, 1. / 24, -1. / 2, 1.);
    sine[i] = 2 * s * c;
    cosine[i] = 1 - 2 * s * s;
  }
}

std::string listed(const Skeleton& s, const std::vector<std::size_t>& joints) {
  std::string text;
  for (std::size_t i = 0; i < joints.size(); ++i) {
    if (i == 8) return text + " and " + std::to_string(joints.size() - i) + " more";
    text += (i ? ", " : "") + s.joint_names[joints[i]];
  }
  return text;
}

}  // namespace

AxisOrder axis_order(std::span<const std::uint8_t> axes) {
  AxisOrder order;
  auto end = std::copy(axes.begin(), axes.end(), order.axes.begin());
  for (std::uint8_t axis = 0; axis < 3; ++axis)
    if (std::find(axes.begin(), axes.end(), axis) == axes.end()) *end++ = axis;
  order.parity = (order.axes[1] - order.axes[0] + 3) % 3 == 1 ? 1 : -1;
  return order;
}

void FrameRows::rotations_of_row(Quaternion* out) {
  const std::size_t angles = 3 * orders.size();
  sine_.resize(angles);
  cosine_.resize(angles);
  int huge = 0;
  for (std::size_t i = 0; i < angles; ++i) huge |= std::abs(row[i]) > kHugeAngleDeg;
  if (huge)
    for (std::size_t i = 0; i < angles; ++i) row[i] = std::remainder(row[i], 360.0);
  half_angle_sin_cos(row.data(), sine_.data(), cosine_.data(), angles);
  // The product of three axis rotations i, j, k (all different), multiplied out.
  const double *sine = sine_.data(), *cosine = cosine_.data();
  for (std::size_t j = 0; j < orders.size(); ++j, sine += 3, cosine += 3) {
    const auto [axes, e] = orders[j];
    const double cc = cosine[0] * cosine[1], ss = sine[0] * sine[1], sc = sine[0] * cosine[1], cs = cosine[0] * sine[1];
    auto& q = out[j].coeffs();
    q[3] = cc * cosine[2] - e * ss * sine[2];
    q[axes[0]] = sc * cosine[2] + e * cs * sine[2];
    q[axes[1]] = cs * cosine[2] - e * sc * sine[2];
    q[axes[2]] = cc * sine[2] + e * ss * cosine[2];
  }
}

void FrameRows::finish_frame(Clip& clip) {
  const std::size_t joints = orders.size();
  Quaternion* const q = clip.rotations.data() + frames * joints;
  // Sign continuity here and not by make_sign_continuous(clip): the frame before is still in the cache.
  if (frames == 0) {
    for (std::size_t j = 0; j < joints; ++j) make_sign_continuous(clip.rotations, j, joints, 1);
  } else {
    for (std::size_t j = 0; j < joints; ++j) {
      const double sign = q[j].dot(*(q + j - joints)) < 0 ? -1 : 1;
      q[j].coeffs() *= sign;
    }
  }
  const double* const positions = row.data() + 3 * joints;
  clip.root_position[frames] = Vector3(positions[0], positions[1], positions[2]);
  moved_.insert(moved_.end(), positions + 3, positions + 3 + 3 * moving.size());
  ++frames;
}

void FrameRows::place_translations(Skeleton& skeleton, Clip& clip, std::vector<std::string>& notes) const {
  std::vector<std::size_t> still, varying, columns;
  for (std::size_t m = 0; m < moving.size(); ++m) {
    const auto fixed = still_position(frames, [&](std::size_t t) { return position(t, m); });
    if (fixed) {
      skeleton.rest_offsets[moving[m]] = *fixed;
      still.push_back(moving[m]);
    } else {
      varying.push_back(moving[m]);
      columns.push_back(m);
    }
  }
  if (!still.empty()) notes.push_back("positions that do not vary became offsets: " + listed(skeleton, still));
  if (varying.empty()) return;
  notes.push_back("positions that vary are kept as translations: " + listed(skeleton, varying));
  const std::size_t joints = skeleton.parents.size();
  auto& all = clip.translations;
  all.reserve(frames * joints);
  for (std::size_t t = 0; t < frames; ++t) {
    all.insert(all.end(), skeleton.rest_offsets.begin(), skeleton.rest_offsets.end());
    for (std::size_t v = 0; v < varying.size(); ++v) all[t * joints + varying[v]] = position(t, columns[v]);
  }
}

}  // namespace mocap::io
