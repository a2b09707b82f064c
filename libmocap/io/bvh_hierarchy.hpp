// The HIERARCHY part of a BVH file. Internal to libmocap/io.
#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "libmocap/io/text_cursor.hpp"
#include "libmocap/skeleton/skeleton.hpp"

namespace mocap::io {

// Channels of one joint in file order: 0 1 2 for X Y Z position, 3 4 5 for X Y Z rotation.
struct BvhChannels {
  std::array<std::uint8_t, 6> kinds{};
  std::uint8_t count = 0;
};

struct BvhHierarchy {
  Skeleton skeleton;                  // names unique, joints in file order
  std::vector<BvhChannels> channels;  // [J]
  std::size_t channel_count = 0;
  std::vector<std::string> notes;
};

// Reads up to and including the word MOTION; the cursor stands behind it. Iterative: depth costs heap, not stack.
BvhHierarchy read_hierarchy(TextCursor& text);

}  // namespace mocap::io
