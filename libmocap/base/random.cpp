#include "libmocap/base/random.hpp"

#include <Random123/philox.h>

#include <cmath>
#include <numbers>

namespace mocap {

std::uint32_t Random::next_u32() {
  const std::uint64_t index = count_ / 4;
  if (index != block_index_) {
    const r123::Philox4x32::ctr_type counter = {{static_cast<std::uint32_t>(index), static_cast<std::uint32_t>(index >> 32),
                                                 static_cast<std::uint32_t>(stream_), static_cast<std::uint32_t>(stream_ >> 32)}};
    const r123::Philox4x32::key_type key = {{static_cast<std::uint32_t>(seed_), static_cast<std::uint32_t>(seed_ >> 32)}};
    const auto out = r123::Philox4x32()(counter, key);
    for (int i = 0; i < 4; ++i) block_[i] = out[static_cast<unsigned>(i)];
    block_index_ = index;
  }
  return block_[count_++ % 4];
}

std::uint64_t Random::next_u64() {
  const std::uint64_t high = next_u32();
  return high << 32 | next_u32();
}

double Random::uniform() { return static_cast<double>(next_u64() >> 11) * 0x1p-53; }

double Random::uniform(double low, double high) {
  const double v = low + (high - low) * uniform();
  return v < high ? v : std::nextafter(high, low);  // rounding can reach high
}

double Random::normal() {
  // 1 - u lies in (0, 1], so the logarithm is finite.
  const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
  return radius * std::cos(2.0 * std::numbers::pi * uniform());
}

std::uint64_t Random::below(std::uint64_t n) {
  const std::uint64_t limit = ~0ULL - ~0ULL % n;
  std::uint64_t draw = next_u64();
  while (draw >= limit) draw = next_u64();
  return draw % n;
}

void Random::seek(std::uint64_t position) { count_ = position; }

std::uint64_t stream_of(std::uint64_t a, std::uint64_t b, std::uint64_t c) {
  std::uint64_t h = 0;
  for (const std::uint64_t part : {a, b, c}) {
    h += part + 0x9e3779b97f4a7c15ULL;
    h = (h ^ (h >> 30)) * 0xbf58476d1ce4e5b9ULL;
    h = (h ^ (h >> 27)) * 0x94d049bb133111ebULL;
    h ^= h >> 31;
  }
  return h;
}

}  // namespace mocap
