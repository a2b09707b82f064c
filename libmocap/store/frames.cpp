#include "libmocap/store/frames.hpp"

#include <algorithm>
#include <cmath>

#include "libmocap/store/archive.hpp"
#include "libmocap/store/common_parts.hpp"

namespace mocap::store {
namespace {

double dot(const float* a, const float* b) {
  return static_cast<double>(a[0]) * b[0] + static_cast<double>(a[1]) * b[1] + static_cast<double>(a[2]) * b[2] + static_cast<double>(a[3]) * b[3];
}

bool leads_negative(const float* q) {
  for (int n = 0; n < 4; ++n)
    if (q[n] != 0) return q[n] < 0;
  return false;
}

}  // namespace

void RotationEncoder::encode(std::span<const Quaternion> rotations, float* out) {
  const std::size_t joints = previous_.size() / 4;
  const float* before = previous_.data();
  for (std::size_t first = 0; first < rotations.size(); first += joints) {
    for (std::size_t j = 0; j < joints; ++j) {
      const Quaternion& q = rotations[first + j];
      float r[4] = {static_cast<float>(q.w()), static_cast<float>(q.x()), static_cast<float>(q.y()), static_cast<float>(q.z())};
      if (std::abs(dot(r, r) - 1) > kUnitTolerance) {
        const double scale = 1 / q.norm();
        r[0] = static_cast<float>(q.w() * scale);
        r[1] = static_cast<float>(q.x() * scale);
        r[2] = static_cast<float>(q.y() * scale);
        r[3] = static_cast<float>(q.z() * scale);
      }
      const bool flip = started_ ? dot(r, before + 4 * j) < 0 : leads_negative(r);
      const float sign = flip ? -1.0f : 1.0f;
      // Adding zero turns -0 into +0: equal rotations have equal bytes.
      for (int n = 0; n < 4; ++n) out[4 * j + static_cast<std::size_t>(n)] = sign * r[n] + 0.0f;
    }
    started_ = true;
    before = out;
    out += 4 * joints;
  }
  if (!rotations.empty()) std::copy(before, before + 4 * joints, previous_.begin());
}

bool continues_sign(const float* previous, const float* next) { return previous ? dot(previous, next) >= 0 : !leads_negative(next); }

void encode_positions(std::span<const Vector3> positions, float* out) {
  for (const Vector3& p : positions)
    for (int k = 0; k < 3; ++k) *out++ = static_cast<float>(p[k]) + 0.0f;
}

ClipHash::ClipHash(double frame_rate_hz, const Skeleton& skeleton) {
  hash_number(hash_, frame_rate_hz);
  hash_skeleton(hash_, skeleton);
}

Digest combined_digest(std::vector<Digest> digests) {
  std::sort(digests.begin(), digests.end());
  Sha256 hash;
  for (const Digest& d : digests) hash.update(d.data(), d.size());
  return hash.finish();
}

Digest clip_digest(const Clip& clip) {
  clip.validate();
  ClipHash hash(clip.frame_rate_hz, *clip.skeleton);
  const auto joints = static_cast<std::size_t>(clip.joints());
  const std::size_t block = 256;
  RotationEncoder encoder(joints);
  std::vector<float> buffer(block * joints * 4);
  for (std::size_t t = 0; t < clip.frames(); t += block) {
    const std::size_t n = std::min(block, clip.frames() - t);
    encoder.encode({clip.rotations.data() + t * joints, n * joints}, buffer.data());
    hash.add(buffer.data(), n * joints * 4 * sizeof(float));
  }
  buffer.resize(clip.frames() * 3);
  encode_positions(clip.root_position, buffer.data());
  hash.add(buffer.data(), buffer.size() * sizeof(float));
  hash.add(clip.contacts.data(), clip.contacts.size() * 2);
  return hash.finish();
}

}  // namespace mocap::store
