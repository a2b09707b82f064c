// A motion archive as training data: standardised features, attribute classes, and batches of windows.
#pragma once
#include <torch/torch.h>

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "libmocap/features/motion_cell.hpp"
#include "libmocap/store/archive.hpp"

namespace mocap::train {

using Vocabulary = std::map<std::string, std::vector<std::string>>;  // attribute -> class names, sorted

struct LabelledFeatures {
  std::string name;
  torch::Tensor features;             // (T, D) float32, standardised
  std::vector<std::int64_t> classes;  // one per attribute of the vocabulary, in its order
};

// Features of the labelled clips of an archive. `attributes`: which of the archive's to use; empty: all that label at least
// half of the clips and have at most 32 values, but `subject`. Clips that lack one of them are left out and counted.
// With `like`, vocabulary and statistics are those of another data set (a validation or test split).
class MotionDataset {
 public:
  MotionDataset(const std::string& path, features::RotationRepresentation representation, std::vector<std::string> attributes, const MotionDataset* like = nullptr);

  const std::vector<LabelledFeatures>& clips() const { return clips_; }
  const Vocabulary& vocabulary() const { return vocabulary_; }
  const std::vector<float>& mean() const { return mean_; }
  const std::vector<float>& deviation() const { return deviation_; }
  const store::ArchiveHeader& header() const { return header_; }
  const features::MotionCellLayout& layout() const { return layout_; }
  std::vector<std::string> sources() const { return sources_; }  // sorted SHA-256 of the source files
  const std::string& digest() const { return digest_; }  // of motions, their order, labels and vocabulary, hexadecimal
  const std::string& file_sha256() const { return file_sha256_; }
  std::size_t frames() const;
  std::size_t left_out() const { return left_out_; }  // clips without a label
  // Clips by combination of classes, in the order of the combinations that occur.
  const std::map<std::vector<std::int64_t>, std::vector<std::size_t>>& combinations() const { return combinations_; }

 private:
  store::ArchiveHeader header_;
  features::MotionCellLayout layout_;
  std::vector<LabelledFeatures> clips_;
  Vocabulary vocabulary_;
  std::vector<float> mean_, deviation_;
  std::vector<std::string> sources_;
  std::string digest_, file_sha256_;
  std::size_t left_out_ = 0;
  std::map<std::vector<std::int64_t>, std::vector<std::size_t>> combinations_;
};

struct Batch {
  torch::Tensor features;  // (B, T, D); past the end of a short clip: the features of the identity pose (padding)
  torch::Tensor mask;      // (B, T) 1 where a frame is real
  torch::Tensor classes;   // (B, A) int64
};

// `count` windows of `frames` frames. Each draw takes a combination of attributes uniformly, then a clip of it, then a
// place in it: rare combinations are seen as often as common ones. Depends on (seed, stream) alone.
Batch draw_batch(const MotionDataset& data, std::int64_t count, std::int64_t frames, const torch::Tensor& padding, std::uint64_t seed, std::uint64_t stream);

// One window from the start of each of `indices`, for validation.
Batch fixed_batch(const MotionDataset& data, const std::vector<std::size_t>& indices, std::int64_t frames, const torch::Tensor& padding);

// Standardised features of the identity pose at rest: what padding is made of. (D)
torch::Tensor identity_padding(const features::MotionCellLayout& layout, const std::vector<float>& mean, const std::vector<float>& deviation);

}  // namespace mocap::train
