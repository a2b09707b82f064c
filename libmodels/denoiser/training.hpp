// Training of the denoiser (Ghorbani et al. 2020, sections 3.1 and 4.2): clean motion is corrupted, the network gives it back.
//
//   loss = mean over windows, frames and columns of w_c (y - x)^2, standardised features, mean of w_c = 1
// w_c is the square of how far a deviation of column c moves the body, so that a degree of the hip counts more than one of the wrist and
// legs, which vary most, count no less for it: deviation times the impact factor of the joint (Ghorbani et al. eq. 23, metres; root tilts:
// that of the root; height: 1; velocities and yaw rate: what they move in kVelocitySeconds). With w_c = 1 the legs came out worse than they
// went in. The paper does not give its loss.
// A row of a batch: a clip, uniform; a window of `window` frames of it, uniform, with kReach frames of context on either side (the first and
// last frame stand for what is missing); each number of it, with probability `share` (0.1), gets noise N(0, deviation 0.5). Where twins are given
// (the same clips as a sensor shows them) the window of the twin is what the network sees, in place of made noise. Adam, 1e-4, times
// 0.99 every 10 epochs, 300 epochs. An epoch is as many rows as windows fill the data, at least one a clip. Frames past the end of a short clip
// do not count.
#pragma once
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "libmocap/base/random.hpp"
#include "libmocap/store/archive.hpp"
#include "libmodels/denoiser/network.hpp"
#include "libmodels/train/trainable.hpp"

namespace mocap::denoiser {

// All clips of an archive as standardised features, whatever their labels.
class Data {
 public:
  // `like`: statistics are those of other data. Error(data): one joint, features that are not finite; with `like` another skeleton or rate.
  explicit Data(const std::string& path, const Data* like = nullptr);
  // Brings the clips into the order of `clean`. Error(data) where a clip of `clean` has no clip of its name and length here.
  void match(const Data& clean);
  const std::vector<torch::Tensor>& clips() const { return clips_; }  // (T, D)
  const std::string& name() const { return name_; }                   // of the file, for messages
  const std::vector<float>& mean() const { return mean_; }
  const std::vector<float>& deviation() const { return deviation_; }
  const store::ArchiveHeader& header() const { return header_; }
  const std::vector<std::string>& sources() const { return sources_; }  // sorted SHA-256
  const std::string& digest() const { return digest_; }
  const std::string& file_sha256() const { return file_sha256_; }
  std::int64_t frames() const;

 private:
  store::ArchiveHeader header_;
  std::string name_, digest_, file_sha256_;
  std::vector<std::string> clip_names_;
  std::vector<torch::Tensor> clips_;
  std::vector<std::string> sources_;
  std::vector<float> mean_, deviation_;
};

inline constexpr double kVelocitySeconds = 0.1;

struct TrainingConfig {
  std::int64_t epochs = 300, batch = 32, window = 64;
  int shards = 2;
  double share = 0.1, corruption = 0.5;  // of the numbers; deviation
  double learning_rate = 1e-4, decay = 0.99;
  std::int64_t decay_epochs = 10;
  double gradient_limit = 5;
  std::uint64_t seed = 1;
};

// The last three may be null; all must outlive the training.
struct TrainingData {
  const Data* clean = nullptr;
  const Data* noisy = nullptr;             // twins of `clean`, matched
  const Data* validation = nullptr;
  const Data* validation_noisy = nullptr;  // given with `noisy`: twins of `validation`, matched
};

class DenoiserTraining final : public train::Trainable {
 public:
  // Error(usage) for settings out of range.
  DenoiserTraining(TrainingConfig config, TrainingData data);

  store::ModelFile describe() const override;
  std::string identity() const override;
  train::NamedTensors parameters() override;
  std::int64_t steps() const override { return config_.epochs * steps_per_epoch(); }
  std::int64_t steps_per_epoch() const override;
  double learning_rate(std::int64_t step) const override;
  double gradient_limit() const override { return config_.gradient_limit; }
  int shards() const override { return config_.shards; }
  void prepare(std::int64_t step) override;
  torch::Tensor shard_loss(int shard, train::LossTerms& terms) override;
  std::optional<double> validation_loss() override;  // at most 256 windows spread over the clips, the same noise every time

  const Network& network() const { return *network_; }

 private:
  struct Rows {
    torch::Tensor clean, corrupted, mask;  // (B, window + 2 kReach, D) twice, (B, window, 1)
  };
  Rows rows(const Data& data, const Data* noisy, const std::vector<std::pair<std::size_t, std::int64_t>>& places, Random& noise) const;  // places: clip, first frame
  torch::Tensor squares(const Rows& rows, std::int64_t first, std::int64_t count) const;  // summed over what counts

  TrainingConfig config_;
  TrainingData data_;
  std::unique_ptr<Network> network_;
  torch::Tensor weights_;  // (D) w_c
  Rows rows_;
  double counted_ = 1;
};

}  // namespace mocap::denoiser
