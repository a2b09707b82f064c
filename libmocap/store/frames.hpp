// Frames as they are stored: float32, little-endian. Internal to libmocap/store.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "libmocap/base/sha256.hpp"
#include "libmocap/clip/clip.hpp"

namespace mocap::store {

// Rotations of consecutive frames to wxyz float32: unit (renormalised in double where rounding left a squared norm off by
// more than kUnitTolerance), sign-continuous from frame to frame, first frame w >= 0, no negative zeros. Idempotent: what
// it wrote, read back and encoded again, gives the same bits; so do q and -q.
class RotationEncoder {
 public:
  explicit RotationEncoder(std::size_t joints) : previous_(4 * joints) {}
  void encode(std::span<const Quaternion> rotations, float* out);  // whole frames

 private:
  std::vector<float> previous_;
  bool started_ = false;
};
inline constexpr double kUnitTolerance = 2e-7;  // rounding a unit quaternion to float32 moves its squared norm by up to 1.2e-7

// Whether a stored quaternion follows `previous` as the encoder would write it.
bool continues_sign(const float* previous, const float* next);

void encode_positions(std::span<const Vector3> positions, float* out);

// Hash of a clip as clip_digest() defines it, over frames already encoded and added in order.
class ClipHash {
 public:
  ClipHash(double frame_rate_hz, const Skeleton& skeleton);
  void add(const void* bytes, std::size_t size) { hash_.update(bytes, size); }
  Digest finish() { return hash_.finish(); }

 private:
  Sha256 hash_;
};

// SHA-256 over the clip digests in ascending order: independent of the order of the clips.
Digest combined_digest(std::vector<Digest> digests);

}  // namespace mocap::store
