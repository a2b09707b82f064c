// Generating motion with a trained baseline: the initial state is drawn, every frame after it follows (Ghorbani et al. 2020, 5.1).
//
// A clip's frames depend on the weights, its own random stream and its own classes alone: not on the other clips, the size
// of the chunk, the number of threads, or on which of avx2 and avx512 runs (tested, to the bit).
#pragma once
#include <cstdint>
#include <memory>
#include <vector>

#include "libmodels/baselines/network.hpp"

namespace mocap::baselines {

// One clip to generate. Classes change at the given frames (ascending, the first at frame 0).
struct ClipRequest {
  struct Change {
    std::int64_t frame = 0;
    std::vector<std::int64_t> classes;
  };
  std::uint64_t seed = 0, stream = 0;
  std::int64_t frames = 0;
  std::vector<Change> schedule;
};

struct SampleOptions {
  int threads = 1;
  int chunk = 32;          // clips computed together on one thread
  double sigma_scale = 1;  // factor on the initial state's sigma: 0 generates the one motion at its mean
};

// The weights of a network, copied and laid out for sampling. Immutable: any number of threads may share one.
class Sampler {
 public:
  explicit Sampler(const Network& network);  // float parameters
  const BaselineConfig& config() const { return config_; }

  // All clips, each (frames, features) standardised, row-major. Error(internal) where classes are out of range or not
  // given at frame 0.
  std::vector<std::vector<float>> sample(const std::vector<ClipRequest>& requests, const SampleOptions& options = {}) const;

 private:
  BaselineConfig config_;
  std::shared_ptr<const PackedNetwork> packed_;
  std::vector<float> initial_mu_, initial_sigma_;  // (combinations, state)
};

}  // namespace mocap::baselines
