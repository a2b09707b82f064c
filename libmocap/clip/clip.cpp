#include "libmocap/clip/clip.hpp"

#include <algorithm>
#include <cmath>

#include "libmocap/base/error.hpp"

namespace mocap {

void Clip::validate(const std::string& file) const {
  const auto fail = [&](const std::string& object, const std::string& what) {
    refuse({file, 0, "clip " + name + (object.empty() ? "" : " " + object)}, what);
  };
  if (!skeleton) fail("", "no skeleton");
  const std::size_t n = frames(), j = static_cast<std::size_t>(joints());
  if (!(std::isfinite(frame_rate_hz) && frame_rate_hz > 0)) fail("", "frame rate " + std::to_string(frame_rate_hz) + ", expected a finite number above 0");
  if (n == 0) fail("", "0 frames, expected at least one");
  if (rotations.size() != n * j) fail("", std::to_string(rotations.size()) + " rotations, expected " + std::to_string(n) + " frames x " + std::to_string(j) + " joints");
  if (!contacts.empty() && contacts.size() != n) fail("", std::to_string(contacts.size()) + " contact rows, expected " + std::to_string(n));
  if (!translations.empty() && translations.size() != n * j) fail("", std::to_string(translations.size()) + " translations, expected " + std::to_string(n * j));
  for (std::size_t t = 0; t < n; ++t) {
    if (!root_position[t].allFinite()) fail("frame " + std::to_string(t), "a root position that is not finite");
    for (std::size_t k = 0; k < j; ++k) {
      const Quaternion& q = rotations[t * j + k];
      if (!(std::abs(q.squaredNorm() - 1) < 2e-3))
        fail("frame " + std::to_string(t) + " joint " + skeleton->joint_names[k], "a quaternion of norm " + std::to_string(q.norm()) + ", expected 1");
    }
  }
  for (const Vector3& v : translations)
    if (!v.allFinite()) fail("", "a joint translation that is not finite");
  for (const Vector2& v : path)
    if (!v.allFinite()) fail("", "a path point that is not finite");
  for (std::size_t k = 0; k < segments.size(); ++k) {
    const Segment& s = segments[k];
    const auto end = static_cast<std::int64_t>(n);
    if (s.start < 0 || s.start > end || s.length < 0 || s.length > end - s.start)
      fail("segment " + std::to_string(k), "frames " + std::to_string(s.start) + " and " + std::to_string(s.length) + " more, expected them within the clip's " + std::to_string(n));
  }
}

void world_pose(const Clip& clip, std::size_t t, Pose& out) {
  const auto j = static_cast<std::size_t>(clip.joints());
  const std::span<const Vector3> moved = clip.translations.empty() ? std::span<const Vector3>{} : std::span<const Vector3>(clip.translations.data() + t * j, j);
  forward_kinematics(*clip.skeleton, clip.frame(t), clip.root_position[t], out, moved);
}

Clip without_frames(const Clip& clip) {
  Clip out;
  out.name = clip.name;
  out.skeleton = clip.skeleton;
  out.frame_rate_hz = clip.frame_rate_hz;
  out.attributes = clip.attributes;
  out.attribute_probability = clip.attribute_probability;
  out.source = clip.source;
  out.path = clip.path;
  return out;
}

Clip cut(const Clip& clip, std::size_t first, std::size_t count) {
  if (first > clip.frames() || count > clip.frames() - first) throw Error(Exit::internal, {}, "cut: frames out of range");
  const auto j = static_cast<std::size_t>(clip.joints());
  const auto rows = [&](const auto& v, std::size_t width) {
    using V = std::decay_t<decltype(v)>;
    if (v.empty()) return V{};
    const auto begin = v.begin() + static_cast<std::ptrdiff_t>(first * width);
    return V(begin, begin + static_cast<std::ptrdiff_t>(count * width));
  };
  Clip out = without_frames(clip);
  out.rotations = rows(clip.rotations, j);
  out.root_position = rows(clip.root_position, 1);
  out.translations = rows(clip.translations, j);
  out.contacts = rows(clip.contacts, 1);
  const auto begin = static_cast<std::int64_t>(first), end = static_cast<std::int64_t>(first + count);
  for (const Segment& s : clip.segments) {
    const std::int64_t a = std::max(s.start, begin), b = std::min(s.start + s.length, end);
    if (a < b) out.segments.push_back({a - begin, b - a, s.attributes});
  }
  out.source.start_s = clip.source.start_s + static_cast<double>(first) / clip.frame_rate_hz;
  out.source.end_s = count == 0 ? out.source.start_s : clip.source.start_s + static_cast<double>(first + count - 1) / clip.frame_rate_hz;
  return out;
}

void make_sign_continuous(Clip& clip) {
  const auto j = static_cast<std::size_t>(clip.joints());
  for (std::size_t k = 0; k < j; ++k) make_sign_continuous(clip.rotations, k, j, clip.frames());
}

}  // namespace mocap
