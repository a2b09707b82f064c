#include "libmocap/corpus/planning.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace mocap::corpus {

std::vector<double> smooth_cover(const std::vector<double>& values, std::size_t radius) {
  const auto n = static_cast<std::ptrdiff_t>(values.size()), r = static_cast<std::ptrdiff_t>(radius);
  const auto inside = [n](std::ptrdiff_t i) {
    return static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(i, 0, n - 1));
  };
  std::vector<double> highest(values.size()), out(values.size(), 0.0), weight;
  for (std::ptrdiff_t i = 0; i < n; ++i) {
    const auto first = values.begin() + std::max<std::ptrdiff_t>(0, i - r),
               last = values.begin() + std::min(n, i + r + 1);
    highest[static_cast<std::size_t>(i)] = *std::max_element(first, last);
  }
  double total = 0;
  for (std::ptrdiff_t k = -r; k <= r; ++k) {
    weight.push_back(1 + std::cos(std::numbers::pi * static_cast<double>(k) / static_cast<double>(r + 1)));
    total += weight.back();
  }
  for (std::ptrdiff_t i = 0; i < n; ++i) {
    double sum = 0;
    for (std::ptrdiff_t k = -r; k <= r; ++k) sum += weight[static_cast<std::size_t>(k + r)] * highest[inside(i + k)];
    out[static_cast<std::size_t>(i)] = sum / total;
  }
  return out;
}

Clip empty_clip(const BodyPlan& body, std::size_t frames, double rate_hz) {
  Clip clip;
  clip.skeleton = body.skeleton;
  clip.frame_rate_hz = rate_hz;
  clip.rotations.assign(frames * kJoints, Quaternion::Identity());
  clip.root_position.assign(frames, Vector3::Zero());
  clip.contacts.assign(frames, {0, 0});
  clip.source.frame_rate_hz = rate_hz;
  clip.source.end_s = clip.seconds();
  return clip;
}

void put_frame(const BodyPlan& body, const BodyState& state, std::size_t t, Clip& clip) {
  pose_body(body, state, clip.frame(t));
  clip.root_position[t] = state.pelvis;
  for (std::size_t side = 0; side < 2; ++side) clip.contacts[t][side] = state.feet[side].planted ? 1 : 0;
}

}  // namespace mocap::corpus
