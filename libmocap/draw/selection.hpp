// Which clips of a large set to draw.
#pragma once
#include <cstddef>
#include <string>
#include <vector>

#include "libmocap/clip/clip.hpp"

namespace mocap::draw {

// `count` of the numbers 0 .. n-1, evenly spaced, the first included; all where n <= count.
std::vector<std::size_t> evenly_chosen(std::size_t n, std::size_t count);

// The clips `wanted` names, in that order: a clip's name, or its number from 1. Error(usage) for what is neither.
std::vector<std::size_t> clips_named(const std::vector<std::string>& names, const std::vector<std::string>& wanted);

struct Pair {
  std::size_t first, second;
};
// For each combination of the attributes that both sets carry, in alphabetical order, the first clip of either set.
// Combinations that one set lacks are left out; sets without common attributes pair by position.
std::vector<Pair> pair_by_attributes(const std::vector<Attributes>& first, const std::vector<Attributes>& second);

}  // namespace mocap::draw
