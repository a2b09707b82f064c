#include "libmodels/train/dataset.hpp"

#include <algorithm>
#include <set>

#include "libmocap/base/error.hpp"
#include "libmocap/base/random.hpp"
#include "libmocap/base/sha256.hpp"

namespace mocap::train {

MotionDataset::MotionDataset(const std::string& path, features::RotationRepresentation representation, std::vector<std::string> attributes, const MotionDataset* like) {
  const store::ArchiveReader reader(path);
  header_ = reader.header();
  layout_ = {header_.skeleton->joint_count() - 1, representation};
  file_sha256_ = reader.file_sha256();
  const std::string& name = reader.name();
  if (reader.size() == 0) refuse({name, 0, {}}, "0 clips, expected at least one");
  if (layout_.joints < 1) refuse({name, 0, "skeleton"}, "1 joint, expected a root and at least one more");

  if (like) {
    if (!header_.skeleton->same_as(*like->header_.skeleton, 1e-5)) refuse({name, 0, "skeleton"}, "another skeleton than the training data's");
    if (header_.frame_rate_hz != like->header_.frame_rate_hz)
      refuse({name, 0, {}}, std::to_string(header_.frame_rate_hz) + " Hz, expected " + std::to_string(like->header_.frame_rate_hz) + " Hz as in the training data");
    vocabulary_ = like->vocabulary_;
  } else {
    std::map<std::string, std::map<std::string, std::size_t>> counts;  // attribute -> value -> clips
    for (std::size_t i = 0; i < reader.size(); ++i)
      for (const auto& [key, value] : reader.info(i).attributes)
        if (!value.empty()) ++counts[key][value];
    if (attributes.empty())
      for (const auto& [key, values] : counts) {
        std::size_t labelled = 0;
        for (const auto& [value, n] : values) labelled += n;
        // A subject's or file's name is no class to generate from: with hundreds of values it is an identifier.
        if (2 * labelled >= reader.size() && values.size() <= 32 && key != "subject") attributes.push_back(key);
      }
    for (const auto& key : attributes) {
      if (!counts.contains(key)) refuse({name, 0, {}}, "no clip has an attribute '" + key + "', expected labels to condition on");
      vocabulary_[key];
    }
  }
  std::vector<std::size_t> labelled;  // clips that have every attribute of the vocabulary
  for (std::size_t i = 0; i < reader.size(); ++i) {
    const auto& a = reader.info(i).attributes;
    const auto has = [&](const auto& item) { return a.contains(item.first) && !a.at(item.first).empty(); };
    if (std::all_of(vocabulary_.begin(), vocabulary_.end(), has)) labelled.push_back(i);
  }
  left_out_ = reader.size() - labelled.size();
  if (labelled.empty()) refuse({name, 0, {}}, "no clip has all the attributes asked for, expected at least one");
  if (!like)
    for (auto& [key, values] : vocabulary_) {
      std::set<std::string> seen;
      for (const std::size_t i : labelled) seen.insert(reader.info(i).attributes.at(key));
      values.assign(seen.begin(), seen.end());
    }

  features::FeatureStatistics statistics(layout_);
  std::vector<features::FeatureMatrix> raw;
  std::set<std::string> sources;
  for (const std::size_t i : labelled) {
    const auto& info = reader.info(i);
    LabelledFeatures clip;
    clip.name = info.name;
    for (const auto& [key, values] : vocabulary_) {
      const auto a = info.attributes.find(key);
      const std::string value = a == info.attributes.end() ? std::string() : a->second;
      const auto at = std::find(values.begin(), values.end(), value);
      if (at == values.end()) refuse({name, 0, "clip " + info.name}, "attribute " + key + " is '" + value + "', which the training data does not know");
      clip.classes.push_back(at - values.begin());
    }
    if (!info.source.sha256.empty()) sources.insert(info.source.sha256);
    raw.push_back(features::encode_motion_cell(reader.read(i), representation));
    statistics.add(raw.back());
    combinations_[clip.classes].push_back(clips_.size());
    clips_.push_back(std::move(clip));
  }
  // The archive's own digest knows neither labels nor the order of the clips; both decide the batches.
  Sha256 digest;
  digest.update(reader.digest());
  for (const auto& [key, values] : vocabulary_) {
    digest.update("\n" + key);
    for (const auto& value : values) digest.update("\t" + value);
  }
  for (std::size_t i = 0; i < labelled.size(); ++i) {
    digest.update("\n" + reader.info(labelled[i]).digest);
    for (const auto c : clips_[i].classes) digest.update(std::to_string(c) + "\t");
  }
  digest_ = to_hex(digest.finish());
  sources_.assign(sources.begin(), sources.end());
  mean_ = like ? like->mean_ : statistics.mean();
  deviation_ = like ? like->deviation_ : statistics.deviation();
  for (std::size_t i = 0; i < raw.size(); ++i) {
    torch::Tensor x = torch::empty({raw[i].rows(), raw[i].cols()}, torch::kFloat32);
    float* out = x.data_ptr<float>();
    for (Eigen::Index t = 0; t < raw[i].rows(); ++t)
      for (Eigen::Index c = 0; c < raw[i].cols(); ++c)
        *out++ = static_cast<float>((raw[i](t, c) - mean_[static_cast<std::size_t>(c)]) / deviation_[static_cast<std::size_t>(c)]);
    clips_[i].features = x;
  }
}

std::size_t MotionDataset::frames() const {
  std::size_t n = 0;
  for (const auto& c : clips_) n += static_cast<std::size_t>(c.features.size(0));
  return n;
}

torch::Tensor identity_padding(const features::MotionCellLayout& layout, const std::vector<float>& mean, const std::vector<float>& deviation) {
  torch::Tensor x = torch::zeros({layout.columns()}, torch::kFloat32);
  float* p = x.data_ptr<float>();
  const int k = layout.rotation_values();
  for (int j = 0; j < layout.joints; ++j) {
    if (layout.representation == features::RotationRepresentation::quaternion) p[j * k] = 1;
    if (layout.representation == features::RotationRepresentation::rotation_matrix) p[j * k] = p[j * k + 4] = p[j * k + 8] = 1;
  }
  for (int c = 0; c < layout.columns(); ++c) {
    const auto i = static_cast<std::size_t>(c);
    // Root values of the padding are the data's mean, so that no frame lies far from the rest.
    p[c] = c < layout.rotation_columns() ? (p[c] - mean[i]) / deviation[i] : 0.0f;
  }
  return x;
}

namespace {

void fill(Batch& batch, std::int64_t row, const LabelledFeatures& clip, std::int64_t first, std::int64_t frames, const torch::Tensor& padding) {
  const std::int64_t real = std::min(frames, clip.features.size(0) - first);
  batch.features[row].narrow(0, 0, real).copy_(clip.features.narrow(0, first, real));
  if (real < frames) batch.features[row].narrow(0, real, frames - real).copy_(padding.expand({frames - real, -1}));
  batch.mask[row].narrow(0, 0, real).fill_(1);
  for (std::size_t a = 0; a < clip.classes.size(); ++a) batch.classes[row][static_cast<std::int64_t>(a)] = clip.classes[a];
}

Batch empty_batch(const MotionDataset& data, std::int64_t count, std::int64_t frames) {
  return {torch::empty({count, frames, data.layout().columns()}, torch::kFloat32), torch::zeros({count, frames}, torch::kFloat32),
          torch::zeros({count, static_cast<std::int64_t>(data.vocabulary().size())}, torch::kInt64)};
}

}  // namespace

Batch draw_batch(const MotionDataset& data, std::int64_t count, std::int64_t frames, const torch::Tensor& padding, std::uint64_t seed, std::uint64_t stream) {
  Random random(seed, stream);
  std::vector<const std::vector<std::size_t>*> groups;
  for (const auto& [classes, members] : data.combinations()) groups.push_back(&members);
  Batch batch = empty_batch(data, count, frames);
  for (std::int64_t row = 0; row < count; ++row) {
    const auto& members = *groups[random.below(groups.size())];
    const LabelledFeatures& clip = data.clips()[members[random.below(members.size())]];
    const std::int64_t spare = clip.features.size(0) - frames;
    const std::int64_t first = spare > 0 ? static_cast<std::int64_t>(random.below(static_cast<std::uint64_t>(spare) + 1)) : 0;
    fill(batch, row, clip, first, frames, padding);
  }
  return batch;
}

Batch fixed_batch(const MotionDataset& data, const std::vector<std::size_t>& indices, std::int64_t frames, const torch::Tensor& padding) {
  Batch batch = empty_batch(data, static_cast<std::int64_t>(indices.size()), frames);
  for (std::size_t i = 0; i < indices.size(); ++i) fill(batch, static_cast<std::int64_t>(i), data.clips()[indices[i]], 0, frames, padding);
  return batch;
}

}  // namespace mocap::train
