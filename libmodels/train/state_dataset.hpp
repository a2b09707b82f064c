// A motion archive as training data of state features (features/state.hpp) with contact bits: no labels, any motion.
#pragma once
#include <torch/torch.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "libmocap/store/archive.hpp"

namespace mocap::train {

inline constexpr int kContactBits = 2;  // left, right foot down

struct StateClip {
  std::string name;
  torch::Tensor rows;  // (T, D + 2) float32: standardised features, then contacts 0 or 1
};

// What two data sets of one model have in common.
struct StateReference {
  std::shared_ptr<const Skeleton> skeleton;
  double frame_rate_hz = 30;
  std::vector<float> mean, deviation;
};

// Every clip of an archive with at least two frames; shorter ones are left out and counted. Clips without contacts are labelled by the rule `default`.
// Standardised by column over all frames; deviations are at least 0.01 rad for angles, 1 mm for steps and height, 0.001 rad for the change of heading, so that noise on what never
// moves stays small. With `like`, mean and deviation are those of another data set or of a model, whose skeleton and rate the archive must have (Error(data)).
class StateDataset {
 public:
  explicit StateDataset(const std::string& path, const std::optional<StateReference>& like = std::nullopt);
  // Clips in memory, of which `name` says in messages where they came from.
  StateDataset(const std::string& name, std::vector<Clip> clips, const StateReference& like);

  const std::vector<StateClip>& clips() const { return clips_; }
  const std::vector<float>& mean() const { return mean_; }
  const std::vector<float>& deviation() const { return deviation_; }
  const store::ArchiveHeader& header() const { return header_; }
  StateReference reference() const { return {header_.skeleton, header_.frame_rate_hz, mean_, deviation_}; }
  std::string contacts_rule() const;  // the archive's, or the one they were labelled by
  bool labelled_here() const { return labelled_here_; }
  int columns() const { return static_cast<int>(mean_.size()); }
  std::vector<std::string> sources() const { return sources_; }
  const std::string& digest() const { return digest_; }
  const std::string& file_sha256() const { return file_sha256_; }
  std::int64_t frames() const;
  std::size_t left_out() const { return left_out_; }

 private:
  void build(const std::string& name, std::vector<Clip> clips, const std::optional<StateReference>& like);

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

// `count` windows of `frames` rows. Each begins at a place drawn uniformly from all places of all clips, so that every frame is seen equally often but for the clips' ends;
// a clip shorter than the window has one place. Depends on (seed, stream) alone.
StateBatch draw_states(const StateDataset& data, std::int64_t count, std::int64_t frames, std::uint64_t seed, std::uint64_t stream);

// Windows from the start of each of the clips named.
StateBatch fixed_states(const StateDataset& data, const std::vector<std::size_t>& clips, std::int64_t frames);

}  // namespace mocap::train
