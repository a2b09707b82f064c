// Generating motion with a trained Motion Cell: Algorithm 2 of Ghorbani et al. 2020, without autograd.
//
// A clip's frames depend on the weights, its own random stream and its own classes alone: not on the other clips of its
// batch, on the batch's size, on the number of threads, or on which of avx2 and avx512 runs (tested, to the bit).
#pragma once
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "libmocap/base/random.hpp"
#include "libmodels/motion_cell/network.hpp"

namespace mocap::motion_cell {

template <class T>
struct CellWeights;

// The weights of a network, copied and laid out for sampling. Immutable: any number of threads may share one.
class Sampler {
 public:
  explicit Sampler(const MotionCell& cell);  // float parameters
  const MotionCellConfig& config() const { return config_; }

 private:
  friend class SampleStream;
  MotionCellConfig config_;
  std::shared_ptr<const PackedCell> packed_;
  std::vector<float> initial_mu_, initial_sigma_;  // (combinations, 2 hidden)
};

// Clips generated side by side, a motion word at a time, for as long as one likes. Not thread-safe; many streams may
// run at once. Keeps a reference to the sampler.
class SampleStream {
 public:
  // noise        one generator a clip. Numbers are drawn in this order: 2 hidden for the initial state, then `latent` a
  // word. classes      clips x attributes; Error(internal) where out of range. sigma_scale  factor on the prior's sigma
  // (not on the initial state's): 1 samples the model, 0 follows its mean.
  SampleStream(const Sampler& sampler, std::vector<Random> noise, std::span<const std::int64_t> classes,
               double sigma_scale = 1);

  int clips() const { return static_cast<int>(noise_.size()); }
  // Classes of one clip from the next word on.
  void set_classes(int clip, std::span<const std::int64_t> classes);
  // The next word of every clip: `frames` receives clips x (word_length x features) standardised values.
  void next(float* frames) { next(frames, sampler_->config().word_features()); }
  void next(float* frames, std::int64_t clip_stride);
  // Ends a clip: the last clip takes its place.
  void remove(int clip);

 private:
  const Sampler* sampler_;
  std::vector<Random> noise_;
  float sigma_scale_;
  std::vector<float> constant_, state_;  // per clip: control part of the first layers, h
  std::vector<float> ahead_;             // per clip: what the last word's decoder wrote of the next, where words overlap
  bool first_ = true;
  std::vector<float> scratch_;
};

// One clip to generate. Classes change at the given words (ascending, the first at word 0).
struct ClipRequest {
  struct Change {
    std::int64_t word = 0;
    std::vector<std::int64_t> classes;
  };
  std::uint64_t seed = 0, stream = 0;
  std::int64_t frames = 0;
  std::vector<Change> schedule;
};

struct SampleOptions {
  int threads = 1;
  int chunk = 32;  // clips computed together on one thread
  double sigma_scale = 1;
};

// All clips, each (frames, features) standardised, row-major.
// Cost: 2 x parameters flop a word and clip; a chunk of one runs at the speed at which the weights stream from cache.
std::vector<std::vector<float>> sample_clips(const Sampler& sampler, const std::vector<ClipRequest>& requests,
                                             const SampleOptions& options = {});

}  // namespace mocap::motion_cell
