// What the BVH reader and writer must agree on. Internal to libmocap/io.
#pragma once
#include <cstddef>
#include <optional>

#include "libmocap/math/rotation.hpp"

namespace mocap::io {

inline constexpr double kStillTranslation = 1e-4;  // of the file's unit: what varies less is an offset

// The middle of the range of position(0..frames), exact for equal values; nullopt where an axis varies more than that.
template <class Position>
std::optional<Vector3> still_position(std::size_t frames, const Position& position) {
  Vector3 low = position(0), high = low;
  for (std::size_t t = 1; t < frames; ++t) {
    low = low.cwiseMin(position(t));
    high = high.cwiseMax(position(t));
  }
  if ((high - low).maxCoeff() > kStillTranslation) return std::nullopt;
  return Vector3(low + (high - low) / 2);
}

}  // namespace mocap::io
