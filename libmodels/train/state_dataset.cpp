#include "libmodels/train/state_dataset.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "libmocap/base/error.hpp"
#include "libmocap/base/random.hpp"
#include "libmocap/base/sha256.hpp"
#include "libmocap/clip/ground.hpp"
#include "libmocap/features/state.hpp"

namespace mocap::train {
namespace {

// Sums about the first row, against cancellation.
class Moments {
 public:
  void add(const features::FeatureMatrix& x) {
    if (shift_.size() == 0) {
      shift_ = x.row(0);
      sum_ = squares_ = Eigen::VectorXd::Zero(x.cols());
    }
    for (Eigen::Index t = 0; t < x.rows(); ++t) {
      const Eigen::VectorXd d = x.row(t).transpose() - shift_;
      sum_ += d;
      squares_ += d.cwiseProduct(d);
    }
    count_ += static_cast<double>(x.rows());
  }
  std::vector<float> mean() const {
    std::vector<float> out;
    for (Eigen::Index c = 0; c < sum_.size(); ++c) out.push_back(static_cast<float>(shift_[c] + sum_[c] / count_));
    return out;
  }
  std::vector<float> deviation() const {
    std::vector<float> out;
    for (Eigen::Index c = 0; c < sum_.size(); ++c) {
      const double m = sum_[c] / count_, least = c < 4 ? 1e-3 : 1e-2;  // steps, heading, height; angles
      out.push_back(static_cast<float>(std::max(least, std::sqrt(std::max(0.0, squares_[c] / count_ - m * m)))));
    }
    return out;
  }

 private:
  Eigen::VectorXd shift_, sum_, squares_;
  double count_ = 0;
};

void copy_window(const StateClip& clip, std::int64_t first, std::int64_t row, StateBatch& batch) {
  const std::int64_t frames = batch.rows.size(0), real = std::min(frames, clip.rows.size(0) - first);
  const torch::Tensor to = batch.rows.select(1, row);
  to.narrow(0, 0, real).copy_(clip.rows.narrow(0, first, real));
  if (real < frames) to.narrow(0, real, frames - real).copy_(clip.rows.narrow(0, first + real - 1, 1).expand({frames - real, -1}));
  batch.mask.select(1, row).narrow(0, 0, real).fill_(1);
}

StateBatch empty_batch(const StateDataset& data, std::int64_t count, std::int64_t frames) { return {torch::empty({frames, count, data.columns() + kContactBits}), torch::zeros({frames, count})}; }

}  // namespace

torch::Tensor standardised(const features::FeatureMatrix& x, std::span<const std::array<std::uint8_t, 2>> contacts, const Reference& reference) {
  torch::Tensor rows = torch::empty({x.rows(), x.cols() + kContactBits});
  float* out = rows.data_ptr<float>();
  for (Eigen::Index t = 0; t < x.rows(); ++t) {
    for (Eigen::Index c = 0; c < x.cols(); ++c) *out++ = static_cast<float>((x(t, c) - reference.mean[static_cast<std::size_t>(c)]) / reference.deviation[static_cast<std::size_t>(c)]);
    for (const std::uint8_t down : contacts[static_cast<std::size_t>(t)]) *out++ = down ? 1.0f : 0.0f;
  }
  return rows;
}

RawStates raw_states(const float* rows, std::int64_t count, const Reference& reference) {
  RawStates out{features::FeatureMatrix(count, static_cast<Eigen::Index>(reference.mean.size())), {}};
  for (Eigen::Index t = 0; t < out.features.rows(); ++t) {
    for (Eigen::Index c = 0; c < out.features.cols(); ++c) out.features(t, c) = static_cast<double>(*rows++) * reference.deviation[static_cast<std::size_t>(c)] + reference.mean[static_cast<std::size_t>(c)];
    out.contacts.push_back({static_cast<std::uint8_t>(rows[0] > 0.5f), static_cast<std::uint8_t>(rows[1] > 0.5f)});
    rows += kContactBits;
  }
  return out;
}

StateDataset::StateDataset(const std::string& path, const std::optional<Reference>& like) {
  const store::ArchiveReader reader(path, store::Caching::in_order);
  name_ = reader.name();
  header_ = reader.header();
  file_sha256_ = reader.file_sha256();
  digest_ = reader.digest();
  build(reader.size(), [&](std::size_t i) { return reader.read(i); }, like);
}

StateDataset::StateDataset(const std::string& name, std::vector<Clip> clips, const Reference& like) : name_(name) {
  if (!clips.empty()) {
    header_.skeleton = clips[0].skeleton;
    header_.frame_rate_hz = clips[0].frame_rate_hz;
  }
  Sha256 digest;
  for (const Clip& clip : clips) {
    clip.validate(name);
    digest.update(to_hex(store::clip_digest(clip)));
  }
  digest_ = to_hex(digest.finish());
  build(clips.size(), [&](std::size_t i) { return std::move(clips[i]); }, like);
}

void StateDataset::build(std::size_t count, const std::function<Clip(std::size_t)>& read, const std::optional<Reference>& like) {
  if (count == 0) refuse({name_, 0, {}}, "0 clips, expected at least one");
  if (header_.skeleton->joint_count() < 2) refuse({name_, 0, "skeleton"}, "1 joint, expected a root and at least one more");
  if (like) check_alike(*header_.skeleton, header_.frame_rate_hz, *like, {name_, 0, {}}, "the training data");
  Moments moments;
  std::vector<features::FeatureMatrix> raw;
  std::vector<std::vector<std::array<std::uint8_t, 2>>> contacts;
  std::set<std::string> sources;
  for (std::size_t i = 0; i < count; ++i) {
    Clip clip = read(i);
    if (clip.frames() < 2) {
      ++left_out_;
      continue;
    }
    if (clip.contacts.empty()) {
      labelled_here_ = true;
      clip.contacts = label_contacts(clip, contact_preset("default"));
      if (clip.contacts.empty()) refuse({name_, 0, "skeleton"}, "no roles left_foot and right_foot, expected feet that contacts can be labelled of");
    }
    if (!clip.source.sha256.empty()) sources.insert(clip.source.sha256);
    raw.push_back(features::encode_state(clip));
    moments.add(raw.back());
    contacts.push_back(std::move(clip.contacts));
    clips_.push_back({clip.name, {}});
  }
  if (clips_.empty()) refuse({name_, 0, {}}, "no clip of 2 frames or more, expected motion to predict a next frame of");
  mean_ = like ? like->mean : moments.mean();
  deviation_ = like ? like->deviation : moments.deviation();
  const Reference own = reference();
  for (std::size_t i = 0; i < raw.size(); ++i) {
    clips_[i].rows = standardised(raw[i], contacts[i], own);
    raw[i].resize(0, 0);
  }
  sources_.assign(sources.begin(), sources.end());
}

std::size_t StateDataset::shorter_than(std::int64_t frames) const {
  return static_cast<std::size_t>(std::count_if(clips_.begin(), clips_.end(), [&](const StateClip& c) { return c.rows.size(0) < frames; }));
}

std::string StateDataset::contacts_rule() const { return header_.contacts_rule.empty() ? "preset:default" : header_.contacts_rule; }

std::int64_t StateDataset::frames() const {
  std::int64_t n = 0;
  for (const auto& c : clips_) n += c.rows.size(0);
  return n;
}

StateBatch draw_states(const StateDataset& data, std::int64_t count, std::int64_t frames, std::uint64_t seed, std::uint64_t stream, ShortClips short_clips) {
  Random random(seed, stream);
  std::vector<std::int64_t> places;  // of the clips up to and with each
  for (const auto& c : data.clips()) places.push_back((places.empty() ? 0 : places.back()) + std::max<std::int64_t>(short_clips == ShortClips::padded ? 1 : 0, c.rows.size(0) - frames + 1));
  if (places.back() == 0) refuse({data.name(), 0, {}}, fmt::format("no clip of {} frames or more, expected at least one as long as the windows", frames));
  StateBatch batch = empty_batch(data, count, frames);
  for (std::int64_t b = 0; b < count; ++b) {
    const auto at = static_cast<std::int64_t>(random.below(static_cast<std::uint64_t>(places.back())));
    const auto clip = static_cast<std::size_t>(std::upper_bound(places.begin(), places.end(), at) - places.begin());
    copy_window(data.clips()[clip], at - (clip == 0 ? 0 : places[clip - 1]), b, batch);
  }
  return batch;
}

StateBatch fixed_states(const StateDataset& data, const std::vector<std::size_t>& clips, std::int64_t frames) {
  StateBatch batch = empty_batch(data, static_cast<std::int64_t>(clips.size()), frames);
  for (std::size_t b = 0; b < clips.size(); ++b) copy_window(data.clips()[clips[b]], 0, static_cast<std::int64_t>(b), batch);
  return batch;
}

}  // namespace mocap::train
