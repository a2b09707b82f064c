// Rows of angles and positions to the frames of a clip: what the BVH and AMC readers share. Internal to libmocap/io.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "libmocap/clip/clip.hpp"

namespace mocap::io {

// Three different axes, outermost rotation first (R = R_0 R_1 R_2), and the parity of their order.
struct AxisOrder {
  std::array<std::uint8_t, 3> axes{0, 1, 2};
  double parity = 1;
};
// `axes` (different, at most three), then those not among them: their angles stay 0.
AxisOrder axis_order(std::span<const std::uint8_t> axes);

// A reader fills `row`, calls rotations_of_row() and finish_frame() for each frame, and place_translations() at the end.
struct FrameRows {
  std::vector<AxisOrder> orders;    // [J]
  std::vector<std::size_t> moving;  // joints but the root whose positions are in the rows
  // Degrees of joint j from 3j on, in the order of its axes; the root's position from 3J on; then positions of `moving`.
  std::vector<double> row;
  std::size_t frames = 0;  // finished

  // Local rotations of the row: [J], exact to 4e-15 rad.
  void rotations_of_row(Quaternion* out);
  // Frame `frames` of the clip, which has room for it and holds its rotations: sign continuity and positions.
  void finish_frame(Clip& clip);
  // Positions of `moving`: offsets of the skeleton where they do not vary, Clip::translations where they do. The notes say
  // which.
  void place_translations(Skeleton& skeleton, Clip& clip, std::vector<std::string>& notes) const;

  // Of moving joint m in frame t.
  Vector3 position(std::size_t t, std::size_t m) const { return Vector3::Map(moved_.data() + 3 * (t * moving.size() + m)); }

 private:
  std::vector<double> sine_, cosine_, moved_;
};

}  // namespace mocap::io
