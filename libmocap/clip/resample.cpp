#include "libmocap/clip/resample.hpp"

#include <cmath>

#include "libmocap/base/error.hpp"

namespace mocap {

int phase_count(double source_hz, double target_hz) {
  const double ratio = source_hz / target_hz, whole = std::round(ratio);
  return whole >= 1 && std::abs(ratio - whole) < 1e-6 * ratio ? static_cast<int>(whole) : 1;
}

Clip resample(const Clip& clip, double rate_hz, int phase) {
  if (!(std::isfinite(rate_hz) && rate_hz > 0)) refuse_usage("a rate of " + std::to_string(rate_hz) + " Hz, expected a finite number above 0");
  if (phase < 0) refuse_usage("a phase below 0");
  const double ratio = clip.frame_rate_hz / rate_hz;
  Clip out;
  out.name = clip.name;
  out.skeleton = clip.skeleton;
  out.frame_rate_hz = rate_hz;
  out.attributes = clip.attributes;
  out.source = clip.source;
  out.source.phase = phase;
  out.path = clip.path;
  const std::size_t frames = clip.frames();
  const auto joints = static_cast<std::size_t>(clip.joints());
  if (frames == 0 || static_cast<std::size_t>(phase) >= frames) return out;
  // A hair of tolerance: 2.9999999 source frames are 3.
  const auto count = static_cast<std::size_t>(std::floor(static_cast<double>(frames - 1 - static_cast<std::size_t>(phase)) / ratio + 1e-9)) + 1;
  out.rotations.reserve(count * joints);
  out.root_position.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const double at = phase + static_cast<double>(i) * ratio, nearest = std::round(at);
    const bool exact = std::abs(at - nearest) < 1e-9;
    const auto a = std::min(static_cast<std::size_t>(exact ? nearest : std::floor(at)), frames - 1);
    const std::size_t b = std::min(a + 1, frames - 1);
    const double w = exact ? 0.0 : at - static_cast<double>(a);
    const auto mix = [&](const std::vector<Vector3>& v, std::size_t width, std::size_t k) -> Vector3 {
      return w == 0 ? v[a * width + k] : Vector3((1 - w) * v[a * width + k] + w * v[b * width + k]);
    };
    for (std::size_t k = 0; k < joints; ++k)
      out.rotations.push_back(w == 0 ? clip.rotations[a * joints + k] : slerp(clip.rotations[a * joints + k], clip.rotations[b * joints + k], w));
    out.root_position.push_back(mix(clip.root_position, 1, 0));
    if (!clip.translations.empty())
      for (std::size_t k = 0; k < joints; ++k) out.translations.push_back(mix(clip.translations, joints, k));
    if (!clip.contacts.empty()) out.contacts.push_back(clip.contacts[w < 0.5 ? a : b]);
  }
  for (const Segment& s : clip.segments) {
    const auto place = [&](std::int64_t frame) {
      return std::clamp<std::int64_t>(std::llround((static_cast<double>(frame) - phase) / ratio), 0, static_cast<std::int64_t>(count));
    };
    const std::int64_t a = place(s.start), b = place(s.start + s.length);
    if (a < b) out.segments.push_back({a, b - a, s.attributes});
  }
  make_sign_continuous(out);
  return out;
}

}  // namespace mocap
