// Generating motion with a trained mixture generator (Wang, Chai, Xia 2018, section 4.1.4), frame by frame and as long as one likes.
//
// From x_t (5.1: plus noise of the given deviation on the features, if any) the network gives the mixture of x_{t+1}; a component is drawn by its weight, then the features from its normal
// distribution. A contact bit is set where its probability is above a half: drawn bits would flicker where the model is sure but not quite. Scale 0 follows the mean of the most probable component.
//
// A clip's frames depend on the weights, its own random stream and its own start alone: not on the other clips, the size of the chunk or the number of threads.
#pragma once
#include <cstdint>
#include <memory>
#include <vector>

#include "libmodels/lstm_gmm/network.hpp"

namespace mocap::lstm_gmm {

struct ClipRequest {
  std::uint64_t seed = 0, stream = 0;
  std::int64_t frames = 0;
  std::vector<float> first;  // (input) frame 0, which is the clip's first frame
  std::vector<float> state;  // (state) of the network before it; empty: 0
  std::vector<float> given = {};  // (G, input) frames 1 .. G, taken as they are instead of drawn
  std::vector<float> draws = {};  // (frames - 1, 1 + features) standard normal numbers that decide frames 1 ..: the component by the first's distribution function, then the features; empty: the stream's
};

struct SampleOptions {
  int threads = 1;
  int chunk = 32;          // clips computed together on one thread
  double sigma_scale = 1;  // factor on every sigma
  double input_noise = 0;  // deviation of the noise on the network's input, standardised
};

// The weights of a network, copied and laid out for sampling. Immutable: any number of threads may share one.
class Sampler {
 public:
  explicit Sampler(const Network& network);  // float parameters
  ~Sampler();
  const LstmGmmConfig& config() const { return config_; }

  // All clips, each (frames, input): standardised features and contacts 0 or 1, row-major. Error(internal) for a start of another size.
  std::vector<std::vector<float>> sample(const std::vector<ClipRequest>& requests, const SampleOptions& options = {}) const;

 private:
  class Rows;
  struct Weights;
  LstmGmmConfig config_;
  std::unique_ptr<const Weights> weights_;
};

}  // namespace mocap::lstm_gmm
