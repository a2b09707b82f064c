// Windows of standardised features into the latent space and out of it (Motegi, Hijioka, Murakami 2018, section V), and motion of any length.
//
//   x~ = Phi'(mu_theta(z)),  z ~ N(0, I), or from where the training windows lie (latent_prior.hpp)
//
// Longer motion is made of windows that overlap by half. The window that goes on is the one of `kCandidates` draws whose first half is nearest to the last half of the motion so far (mean square,
// standardised features); twice the motion's own last half is put in place of its first and the whole is encoded and decoded, which brings it onto what the model knows; then both are blended over
// the overlap, 3 u^2 - 2 u^3.
#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "libmocap/base/random.hpp"
#include "libmodels/cae_vae/latent_prior.hpp"
#include "libmodels/cae_vae/network.hpp"
#include "libmodels/nn/convolution.hpp"
#include "libmodels/nn/layers.hpp"

namespace mocap::cae_vae {

inline constexpr int kCandidates = 64;

using Latent = std::vector<float>;

// What latents are drawn from: N(0, scale^2 I), or a prior with its deviations times scale.
struct Drawing {
  const LatentPrior* prior = nullptr;
  double scale = 1;
};

struct ClipRequest {
  std::uint64_t seed = 1, stream = 0;  // of everything random: equal pairs give equal clips, alone or in company
  std::int64_t frames = 120;
  std::optional<Latent> latent = {};   // of the first window instead of a draw
};

// Phi'(mu_theta(z)) with packed weights.
class Decoder {
 public:
  explicit Decoder(const Network& network);
  // z (count, latent) -> x (count, window, 58), row-major. A window's numbers do not depend on the others. Equal to the network's within 1e-4 (tested).
  // Cost: about 8 Mflop a window in the paper's sizes. Thread-safe.
  void operator()(const float* z, std::int64_t count, float* x) const;

 private:
  CaeVaeConfig config_;
  nn::PackedLinear<float> hidden_, features_;  // features_: frame by frame, in the first stage's own units
  nn::PackedConvolution<float> frames_;
};

class Codec {
 public:
  explicit Codec(const Network& network) : network_(network), decoder_(network) {}  // which must outlive it

  // Means of q(z | y) of a window (window, 58): its place in the latent space.
  Latent encode(const float* x) const;
  // What a clip of (seed, stream) begins with.
  Latent draw(std::uint64_t seed, std::uint64_t stream, const Drawing& drawing) const;
  // (frames, 58) each. Depends on requests and drawing alone, not on `threads`.
  std::vector<std::vector<float>> sample(const std::vector<ClipRequest>& requests, const Drawing& drawing, int threads) const;
  // Any motion of at least a window (frames, 58), window by window through the latent space, overlapping by half and blended; the last window ends with the motion.
  // Without `latent` through the first stage alone.
  std::vector<float> reconstruct(const float* x, std::int64_t frames, bool latent = true) const;

 private:
  Latent draw(Random& random, const Drawing& drawing) const;
  std::vector<float> decode(const Latent& z) const;
  std::vector<float> through_autoencoder(const float* x) const;
  std::vector<float> long_motion(const ClipRequest& request, const Drawing& drawing) const;

  const Network& network_;
  Decoder decoder_;
};

}  // namespace mocap::cae_vae
