// A motion archive as training data of state features (features/state.hpp) with contact bits: no labels, any motion.
#pragma once
#include <torch/torch.h>

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "libmocap/base/error.hpp"
#include "libmocap/features/state.hpp"
#include "libmocap/store/archive.hpp"
#include "libmodels/train/reference.hpp"

namespace mocap::train {

inline constexpr int kContactBits = 2;  // left, right foot down

struct StateClip {
  std::string name;
  torch::Tensor rows;  // (T, D + 2) float32: standardised features, then contacts 0 or 1
};

// (T, D + 2) float32 from features and contacts, and back: features and bits (set from a half on) of T rows, row-major.
torch::Tensor standardised(const features::FeatureMatrix& x, std::span<const std::array<std::uint8_t, 2>> contacts, const Reference& reference);
struct RawStates {
  features::FeatureMatrix features;
  std::vector<std::array<std::uint8_t, 2>> contacts;
};
RawStates raw_states(const float* rows, std::int64_t count, const Reference& reference);

// Every clip of an archive with at least two frames; shorter ones are left out and counted. Clips without contacts are labelled by the rule `default`.
// Standardised by column over all frames; deviations are at least 0.01 rad for angles, 1 mm for steps and height, 0.001 rad for the change of heading, so that noise on what never
// moves stays small. With `like`, mean and deviation are those of another data set or of a model, whose skeleton and rate the archive must have (Error(data)).
class StateDataset {
 public:
  explicit StateDataset(const std::string& path, const std::optional<Reference>& like = std::nullopt);
  // Clips in memory, of which `name` says in messages where they came from; Error(data) where one breaks an invariant, as a generator's may that has blown up.
  StateDataset(const std::string& name, std::vector<Clip> clips, const Reference& like);

  const std::vector<StateClip>& clips() const { return clips_; }
  const std::vector<float>& mean() const { return mean_; }
  const std::vector<float>& deviation() const { return deviation_; }
  const store::ArchiveHeader& header() const { return header_; }
  Reference reference() const { return {header_.skeleton, header_.frame_rate_hz, mean_, deviation_}; }
  std::string contacts_rule() const;  // the archive's, or the one they were labelled by
  bool labelled_here() const { return labelled_here_; }
  int columns() const { return static_cast<int>(mean_.size()); }
  std::vector<std::string> sources() const { return sources_; }
  const std::string& digest() const { return digest_; }
  const std::string& file_sha256() const { return file_sha256_; }
  std::int64_t frames() const;
  std::size_t left_out() const { return left_out_; }
  std::size_t shorter_than(std::int64_t frames) const;  // clips
  const std::string& name() const { return name_; }     // the archive's, for messages

 private:
  void build(std::size_t count, const std::function<Clip(std::size_t)>& read, const std::optional<Reference>& like);

  std::string name_;
  store::ArchiveHeader header_;
  std::vector<StateClip> clips_;
  std::vector<float> mean_, deviation_;
  std::vector<std::string> sources_;
  std::string digest_, file_sha256_;
  std::size_t left_out_ = 0;
  bool labelled_here_ = false;
};

// Windows of motion, time first as the recurrent passes read them.
struct StateBatch {
  torch::Tensor rows;  // (T, B, D + 2); past the end of a short clip its last row
  torch::Tensor mask;  // (T, B) 1 where a row is real
};

// Of clips shorter than the window: they have one place, and are padded; or none.
enum class ShortClips { padded, left_out };

// `count` windows of `frames` rows. Each begins at a place drawn uniformly from all places of all clips, so that every frame is seen equally often but for the clips' ends.
// Depends on (seed, stream) alone. Error(data) where every clip is left out.
StateBatch draw_states(const StateDataset& data, std::int64_t count, std::int64_t frames, std::uint64_t seed, std::uint64_t stream, ShortClips short_clips = ShortClips::padded);

// Windows from the start of each of the clips named.
StateBatch fixed_states(const StateDataset& data, const std::vector<std::size_t>& clips, std::int64_t frames);

}  // namespace mocap::train
