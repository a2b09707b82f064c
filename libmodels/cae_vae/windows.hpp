// A motion archive as windows of features (features/motegi.hpp): what Motegi, Hijioka, Murakami 2018 train on (section II).
#pragma once
#include <torch/torch.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "libmocap/base/error.hpp"
#include "libmocap/base/random.hpp"
#include "libmocap/features/motegi.hpp"
#include "libmocap/store/archive.hpp"
#include "libmodels/train/reference.hpp"

namespace mocap::cae_vae {

using train::Reference;

torch::Tensor standardised(const features::FeatureMatrix& x, const Reference& reference);            // (T, 58) float32
features::FeatureMatrix restored(const float* rows, std::int64_t frames, const Reference& reference);  // and back

struct Window {
  std::size_t clip = 0;
  std::int64_t first = 0;
};

// Windows of `length` frames, each beginning `length - overlap` after the one before it, from the start of every clip; clips shorter than a window are left out and counted, what is left behind a clip's
// last window is not seen. Standardised by column over all frames of the clips that are used; deviations are at least 1 mm, 1 cm/s and 0.01 rad/s. The archive's labels are not looked at.
class WindowDataset {
 public:
  // With `like`, mean and deviation are those of another data set or a model. Error(data): a body that lacks a joint of the features, no clip of a window's length, numbers that are not
  // finite; with `like` another skeleton or rate. Error(usage) unless 0 <= overlap < length.
  WindowDataset(const std::string& path, std::int64_t length, std::int64_t overlap, const Reference* like = nullptr);

  torch::Tensor batch(const std::vector<std::size_t>& windows) const;  // (B, length, 58)
  // The same with each window up to `shift` frames later, as far as its clip goes; draws from `random` once a window.
  torch::Tensor batch(const std::vector<std::size_t>& windows, std::int64_t shift, Random& random) const;
  const std::vector<Window>& windows() const { return windows_; }
  std::int64_t length() const { return length_; }
  std::int64_t step() const { return step_; }  // frames from one window to the next
  const Reference& reference() const { return reference_; }
  const std::vector<Quaternion>& natural() const { return natural_; }  // mean local rotations: for what positions do not tell (clip/position_fit.hpp)
  double floor_m() const { return floor_; }  // median over the clips of the lowest joint's height in the first frame: where joints rest above the ground
  const store::ArchiveHeader& header() const { return header_; }
  std::string contacts_rule() const;  // the archive's; "preset:default" where it has none that a generator could follow
  const std::vector<std::string>& sources() const { return sources_; }  // sorted SHA-256
  const std::string& digest() const { return digest_; }
  const std::string& file_sha256() const { return file_sha256_; }
  const std::string& name() const { return name_; }
  std::size_t clips() const { return clips_.size(); }
  std::size_t left_out() const { return left_out_; }
  std::int64_t frames() const;

 private:
  store::ArchiveHeader header_;
  Reference reference_;
  std::string name_, digest_, file_sha256_;
  std::vector<torch::Tensor> clips_;  // (T, 58)
  std::vector<Window> windows_;
  std::vector<std::string> sources_;
  std::vector<Quaternion> natural_;
  std::int64_t length_ = 0, step_ = 0;
  std::size_t left_out_ = 0;
  double floor_ = 0;
};

}  // namespace mocap::cae_vae
