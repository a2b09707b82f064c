// Integers from files: products and sums that would overflow are refused instead of wrapping.
#pragma once
#include <cstddef>
#include <cstdint>
#include <string>

#include "libmocap/base/error.hpp"

namespace mocap {

inline std::size_t checked_product(std::size_t a, std::size_t b, const Where& where = {}) {
  std::size_t out = 0;
  if (__builtin_mul_overflow(a, b, &out)) refuse(where, "a size of " + std::to_string(a) + " x " + std::to_string(b) + " does not fit in memory");
  return out;
}

inline std::size_t checked_sum(std::size_t a, std::size_t b, const Where& where = {}) {
  std::size_t out = 0;
  if (__builtin_add_overflow(a, b, &out)) refuse(where, "a size of " + std::to_string(a) + " + " + std::to_string(b) + " does not fit in memory");
  return out;
}

}  // namespace mocap
