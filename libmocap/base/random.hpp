// Counter-based random numbers (Philox4x32-10, Salmon et al., SC'11, through the Random123 library).
//
// A generator is addressed by (seed, stream): equal addresses give equal numbers on every machine, and any number of
// streams can be drawn in any order or on any thread. Clip 17 of a sample has stream 17, whoever computes it.
#pragma once
#include <cstdint>

namespace mocap {

class Random {
 public:
  Random(std::uint64_t seed, std::uint64_t stream) : seed_(seed), stream_(stream) {}

  std::uint32_t next_u32();
  std::uint64_t next_u64();
  double uniform();                               // [0, 1), 53 bits
  double uniform(double low, double high);        // [low, high)
  double normal();                                // standard normal (Box-Muller)
  double normal(double mean, double deviation) { return mean + deviation * normal(); }
  std::uint64_t below(std::uint64_t n);           // 0 .. n-1 without bias; n >= 1

  // The position in the stream, for checkpoints: a generator moved to it continues with the same numbers.
  std::uint64_t position() const { return count_; }
  void seek(std::uint64_t position);

 private:
  std::uint64_t seed_, stream_, count_ = 0;  // count_: 32-bit words drawn
  std::uint32_t block_[4] = {};
  std::uint64_t block_index_ = ~0ULL;
};

// A stream number from parts, for streams with several indices (subject, clip, joint): SplitMix64 over the parts.
std::uint64_t stream_of(std::uint64_t a, std::uint64_t b, std::uint64_t c = 0);

}  // namespace mocap
