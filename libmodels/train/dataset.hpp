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

using Classes = std::vector<std::int64_t>;  // one per attribute of the vocabulary, in its order

inline constexpr std::int64_t kFilled = -1;  // in a span: no label, the class is the one drawn with the clip

struct ClassSpan {  // from frame `first` up to the next span
  std::int64_t first = 0;
  Classes classes;  // kFilled where the clip has no label
};

struct LabelledFeatures {
  std::string name;
  torch::Tensor features;        // (T, D) float32, standardised
  Classes classes;               // at the first frame; the most probable one where it has no label
  std::vector<ClassSpan> spans;  // empty where `classes` are labels and hold for the whole clip
};

// A clip with classes for what it has no labels for, as often drawn as its weight says.
struct Member {
  std::size_t clip = 0;
  double weight = 1;
  Classes fill;  // what stands for kFilled; empty where all is labelled
};

// What becomes of clips without a label of an attribute. fill: the class is drawn anew each time from the probabilities that a classifier found
// (Clip::attribute_probability; Ghorbani et al. 2020, the dashed arrows of Fig. 2); clips that have none are left out as with drop.
enum class Unlabelled { drop, fill };

// Features of the labelled clips of an archive. A frame's attributes are its clip's, overridden by those of the segment it is in. `attributes`: which
// of the archive's to use; empty: all that label at least half of the clips and have at most 32 values, but `subject`. Clips with frames that lack
// one of them are left out and counted, or filled. With `like`, vocabulary and statistics are those of another data set (a validation or test split).
//
// Filling: the classes of an attribute are those that label a frame, and those that are the most probable of some clip without a label. A clip's
// probabilities over these, and over the combinations that occur so, are scaled to a sum of 1; several attributes count as independent. Each way to
// fill the clip is a member of its combinations, with its probability for a weight against 1 of a labelled clip. So of the draws of a combination
// the share that a clip has is the probability that it belongs there.
class MotionDataset {
 public:
  MotionDataset(const std::string& path, features::RotationRepresentation representation, std::vector<std::string> attributes, const MotionDataset* like = nullptr, Unlabelled unlabelled = Unlabelled::drop);

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
  std::size_t fillable() const { return fillable_; }  // of these, those that Unlabelled::fill would use
  std::size_t filled() const { return filled_; }      // clips that have frames without a label
  std::size_t changing() const;                       // clips whose attributes change
  // Clips by combination of classes, in the order of the combinations that occur in any frame: a clip whose attributes change is in several.
  const std::map<Classes, std::vector<std::size_t>>& combinations() const { return combinations_; }
  const std::map<Classes, std::vector<Member>>& members() const { return members_; }  // the same, with weights

 private:
  store::ArchiveHeader header_;
  features::MotionCellLayout layout_;
  std::vector<LabelledFeatures> clips_;
  Vocabulary vocabulary_;
  std::vector<float> mean_, deviation_;
  std::vector<std::string> sources_;
  std::string digest_, file_sha256_;
  std::size_t left_out_ = 0, fillable_ = 0, filled_ = 0;
  std::map<Classes, std::vector<std::size_t>> combinations_;
  std::map<Classes, std::vector<Member>> members_;

  void group(const std::vector<std::vector<std::vector<double>>>& probabilities);
};

struct Batch {
  torch::Tensor features;  // (B, T, D); past the end of a short clip: the features of the identity pose (padding)
  torch::Tensor mask;      // (B, T) 1 where a frame is real
  torch::Tensor classes;   // (B, A) int64, at the first frame
  torch::Tensor frame_classes = {};  // (B, T, A) int64, past the end of a clip those of its end; undefined where no window of the batch changes classes
};

// Clips [first, first + count) of a batch.
Batch rows(const Batch& batch, std::int64_t first, std::int64_t count);

// Classes for a model that works on words of `word_length` frames: (B, A) where they are constant, otherwise (B, N, A), those of each word's middle frame.
torch::Tensor word_classes(const Batch& batch, std::int64_t word_length);

// `count` windows of `frames` frames. Each draw takes a combination of attributes uniformly, then a clip of it by weight, then a
// place in it where the window begins with that combination (any place where there is none): rare combinations are seen as often as common ones.
// Depends on (seed, stream) alone.
Batch draw_batch(const MotionDataset& data, std::int64_t count, std::int64_t frames, const torch::Tensor& padding, std::uint64_t seed, std::uint64_t stream);

// One window from the start of each of `indices`, for validation; what has no label counts as its most probable class.
Batch fixed_batch(const MotionDataset& data, const std::vector<std::size_t>& indices, std::int64_t frames, const torch::Tensor& padding);

// Standardised features of the identity pose at rest: what padding is made of. (D)
torch::Tensor identity_padding(const features::MotionCellLayout& layout, const std::vector<float>& mean, const std::vector<float>& deviation);

}  // namespace mocap::train
