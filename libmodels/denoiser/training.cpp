#include "libmodels/denoiser/training.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "libmocap/base/error.hpp"
#include "libmocap/base/sha256.hpp"
#include "libmocap/features/motion_cell.hpp"
#include "libmodels/nn/mlp.hpp"
#include "libmodels/nn/sharded.hpp"

namespace mocap::denoiser {
namespace {

using Json = nlohmann::json;

enum Draw : std::uint64_t { kBatch = 1, kNoise = 2, kValidation = 3 };

Json to_json(const TrainingConfig& c) {
  return Json{{"epochs", c.epochs},         {"batch", c.batch}, {"window", c.window},             {"shards", c.shards},                 {"share", c.share}, {"corruption", c.corruption},
              {"learning_rate", c.learning_rate}, {"decay", c.decay}, {"decay_epochs", c.decay_epochs}, {"gradient_limit", c.gradient_limit}, {"seed", c.seed}};
}

}  // namespace

Data::Data(const std::string& path, const Data* like) {
  const store::ArchiveReader reader(path);
  header_ = reader.header();
  file_sha256_ = reader.file_sha256();
  const std::string& name = name_ = reader.name();
  const features::MotionCellLayout layout{header_.skeleton->joint_count() - 1, features::RotationRepresentation::quaternion};
  if (layout.joints < 1) refuse({name, 0, "skeleton"}, "1 joint, expected a root and at least one more");
  if (like) {
    if (!header_.skeleton->same_as(*like->header_.skeleton, 1e-5)) refuse({name, 0, "skeleton"}, "another skeleton than the training data's");
    if (header_.frame_rate_hz != like->header_.frame_rate_hz)
      refuse({name, 0, {}}, fmt::format("{} Hz, expected {} Hz as in the training data", header_.frame_rate_hz, like->header_.frame_rate_hz));
  }
  features::FeatureStatistics statistics(layout);
  std::vector<features::FeatureMatrix> encoded;
  std::set<std::string> sources;
  Sha256 digest;
  digest.update(reader.digest());  // knows nothing of the order of the clips
  for (std::size_t i = 0; i < reader.size(); ++i) {
    encoded.push_back(features::encode_motion_cell(reader.read(i), layout.representation));
    clip_names_.push_back(reader.info(i).name);
    if (!encoded.back().allFinite()) refuse({name, 0, "clip " + reader.info(i).name}, "features that are not finite, expected motion of finite numbers");
    statistics.add(encoded.back());
    digest.update("\n" + reader.info(i).digest);
    if (!reader.info(i).source.sha256.empty()) sources.insert(reader.info(i).source.sha256);
  }
  digest_ = to_hex(digest.finish());
  sources_.assign(sources.begin(), sources.end());
  mean_ = like ? like->mean_ : statistics.mean();
  deviation_ = like ? like->deviation_ : statistics.deviation();
  for (const auto& x : encoded) {
    torch::Tensor out = torch::empty({x.rows(), x.cols()}, torch::kFloat32);
    float* p = out.data_ptr<float>();
    for (Eigen::Index t = 0; t < x.rows(); ++t)
      for (Eigen::Index c = 0; c < x.cols(); ++c) *p++ = static_cast<float>((x(t, c) - mean_[static_cast<std::size_t>(c)]) / deviation_[static_cast<std::size_t>(c)]);
    clips_.push_back(std::move(out));
  }
}

void Data::match(const Data& clean) {
  std::map<std::string, std::size_t> places;
  for (std::size_t i = 0; i < clip_names_.size(); ++i) places[clip_names_[i]] = i;
  std::vector<torch::Tensor> ordered;
  for (std::size_t i = 0; i < clean.clips_.size(); ++i) {
    const std::string& clip = clean.clip_names_[i];
    const auto at = places.find(clip);
    if (at == places.end()) refuse({name_, 0, {}}, fmt::format("no clip {}, expected the twin of every clip of {}", clip, clean.name_));
    const std::int64_t frames = clips_[at->second].size(0), expected = clean.clips_[i].size(0);
    if (frames != expected) refuse({name_, 0, "clip " + clip}, fmt::format("{} frames, expected {} as in {}", frames, expected, clean.name_));
    // A quaternion and its negative are one rotation; each clip chose by itself (features/motion_cell.hpp), by its own noise.
    torch::Tensor twin = clips_[at->second];
    const std::int64_t joints = header_.skeleton->joint_count() - 1;
    float* x = twin.data_ptr<float>();
    const float* y = clean.clips_[i].data_ptr<float>();
    for (std::int64_t t = 0; t < frames; ++t, x += twin.size(1), y += twin.size(1))
      for (std::int64_t j = 0; j < joints; ++j) {
        double dot = 0;
        const auto raw = [&](const float* v, std::int64_t k) { return static_cast<double>(v[4 * j + k]) * deviation_[static_cast<std::size_t>(4 * j + k)] + mean_[static_cast<std::size_t>(4 * j + k)]; };
        for (std::int64_t k = 0; k < 4; ++k) dot += raw(x, k) * raw(y, k);
        for (std::int64_t k = 0; dot < 0 && k < 4; ++k)
          x[4 * j + k] = static_cast<float>((-raw(x, k) - mean_[static_cast<std::size_t>(4 * j + k)]) / deviation_[static_cast<std::size_t>(4 * j + k)]);
      }
    ordered.push_back(twin);
  }
  clips_ = std::move(ordered);
  clip_names_ = clean.clip_names_;
}

std::int64_t Data::frames() const {
  std::int64_t n = 0;
  for (const auto& clip : clips_) n += clip.size(0);
  return n;
}

DenoiserTraining::DenoiserTraining(TrainingConfig config, TrainingData data) : config_(std::move(config)), data_(data) {
  const auto positive = [](const char* name, double v) {
    if (!(std::isfinite(v) && v > 0)) refuse_usage(fmt::format("{} is {}, expected a number above 0", name, v));
  };
  positive("epochs", static_cast<double>(config_.epochs));
  positive("batch", static_cast<double>(config_.batch));
  positive("learning rate", config_.learning_rate);
  positive("share of corrupted numbers", config_.share);
  positive("deviation of the corruption", config_.corruption);
  positive("decay of the learning rate", config_.decay);
  positive("epochs between decays", static_cast<double>(config_.decay_epochs));
  positive("gradient limit", config_.gradient_limit);
  if (config_.window < 1) refuse_usage(fmt::format("a window of {} frames, expected at least 1", config_.window));
  if (config_.shards < 1 || config_.shards > config_.batch) refuse_usage(fmt::format("{} shards of a batch of {}, expected between 1 and the batch", config_.shards, config_.batch));
  if (config_.window > (1 << 20) / config_.batch) refuse_usage(fmt::format("{} windows of {} frames in a batch, expected at most {} frames in all", config_.batch, config_.window, 1 << 20));
  NetworkConfig network;
  network.joints = data_.clean->header().skeleton->joint_count() - 1;
  network_ = std::make_unique<Network>(network);
  const std::vector<double> impact = impact_factors(*data.clean->header().skeleton, 0.08);
  const features::MotionCellLayout layout{network.joints, features::RotationRepresentation::quaternion};
  std::vector<double> moved(static_cast<std::size_t>(layout.columns()), 1);  // metres
  for (int j = 0; j < layout.joints; ++j)
    for (int k = 0; k < 4; ++k) moved[static_cast<std::size_t>(4 * j + k)] = 2 * impact[static_cast<std::size_t>(j + 1)];  // |dq| is half an angle
  const auto root = static_cast<std::size_t>(layout.rotation_columns());
  for (const std::size_t velocity : {0, 1, 3}) moved[root + velocity] = kVelocitySeconds;
  for (const std::size_t tilt : {4, 5}) moved[root + tilt] = impact[0];
  weights_ = torch::empty({layout.columns()}, torch::kFloat32);
  for (std::size_t c = 0; c < moved.size(); ++c) weights_[static_cast<std::int64_t>(c)] = std::pow(moved[c] * data.clean->deviation()[c], 2);
  weights_ /= weights_.mean();
}

std::int64_t DenoiserTraining::steps_per_epoch() const {
  const std::int64_t windows = std::max(static_cast<std::int64_t>(data_.clean->clips().size()), data_.clean->frames() / config_.window);
  return (windows + config_.batch - 1) / config_.batch;
}

double DenoiserTraining::learning_rate(std::int64_t step) const {
  return config_.learning_rate * std::pow(config_.decay, static_cast<double>(step / (config_.decay_epochs * steps_per_epoch())));
}

store::ModelFile DenoiserTraining::describe() const {
  store::ModelFile file;
  file.kind = "denoiser";
  const auto& header = data_.clean->header();
  file.config = Json{{"network", denoiser::to_json(network_->config())}, {"training", to_json(config_)}, {"representation", "quaternion"}, {"frame_rate_hz", header.frame_rate_hz}}.dump();
  file.skeleton = header.skeleton;
  file.mean = data_.clean->mean();
  file.deviation = data_.clean->deviation();
  std::set<std::string> sources(data_.clean->sources().begin(), data_.clean->sources().end());
  if (data_.noisy) sources.insert(data_.noisy->sources().begin(), data_.noisy->sources().end());
  file.train_sources.assign(sources.begin(), sources.end());
  return file;
}

std::string DenoiserTraining::identity() const {
  return Json{{"kind", "denoiser"},
              {"data", data_.clean->digest()},
              {"noisy", data_.noisy ? data_.noisy->digest() : ""},
              {"validation", data_.validation ? data_.validation->digest() : ""},
              {"network", denoiser::to_json(network_->config())},
              {"training", to_json(config_)}}
      .dump();
}

train::NamedTensors DenoiserTraining::parameters() { return nn::parameters_by_path(*network_); }

DenoiserTraining::Rows DenoiserTraining::rows(const Data& data, const Data* noisy, const std::vector<std::pair<std::size_t, std::int64_t>>& places, Random& noise) const {
  std::vector<torch::Tensor> windows, twins;
  Rows out;
  out.mask = torch::zeros({static_cast<std::int64_t>(places.size()), config_.window, 1}, torch::kFloat32);
  for (std::size_t b = 0; b < places.size(); ++b) {
    const torch::Tensor& clip = data.clips()[places[b].first];
    windows.push_back(with_edges(clip, places[b].second, config_.window));
    if (noisy) twins.push_back(with_edges(noisy->clips()[places[b].first], places[b].second, config_.window));
    out.mask[static_cast<std::int64_t>(b)].narrow(0, 0, std::min(config_.window, clip.size(0) - places[b].second)).fill_(1);
  }
  out.clean = torch::stack(windows);
  if (noisy) {
    out.corrupted = torch::stack(twins);
    return out;
  }
  out.corrupted = out.clean.clone();
  float* x = out.corrupted.data_ptr<float>();
  for (std::int64_t i = 0; i < out.corrupted.numel(); ++i)
    if (noise.uniform() < config_.share) x[i] += static_cast<float>(config_.corruption * noise.normal());
  return out;
}

torch::Tensor DenoiserTraining::squares(const Rows& rows, std::int64_t first, std::int64_t count) const {
  const auto centre = [&](const torch::Tensor& t) { return t.narrow(1, kReach, config_.window); };
  const torch::Tensor y = network_->forward(rows.corrupted.narrow(0, first, count));
  return ((centre(y) - centre(rows.clean.narrow(0, first, count))).square() * weights_ * rows.mask.narrow(0, first, count)).sum();
}

void DenoiserTraining::prepare(std::int64_t step) {
  Random random(config_.seed, stream_of(kBatch, static_cast<std::uint64_t>(step))), noise(config_.seed, stream_of(kNoise, static_cast<std::uint64_t>(step)));
  std::vector<std::pair<std::size_t, std::int64_t>> places;
  for (std::int64_t b = 0; b < config_.batch; ++b) {
    const auto clip = static_cast<std::size_t>(random.below(data_.clean->clips().size()));
    const std::int64_t spare = data_.clean->clips()[clip].size(0) - config_.window;
    places.emplace_back(clip, spare > 0 ? static_cast<std::int64_t>(random.below(static_cast<std::uint64_t>(spare) + 1)) : 0);
  }
  rows_ = rows(*data_.clean, data_.noisy, places, noise);
  counted_ = rows_.mask.sum().item<double>() * static_cast<double>(rows_.clean.size(2));
}

torch::Tensor DenoiserTraining::shard_loss(int shard, train::LossTerms& terms) {
  const auto [first, last] = nn::shard_range(config_.batch, config_.shards, shard);
  const torch::Tensor loss = squares(rows_, first, last - first) / counted_;
  terms = {{"square_error", loss.item<double>()}};
  return loss;
}

std::optional<double> DenoiserTraining::validation_loss() {
  if (!data_.validation) return std::nullopt;
  const torch::NoGradGuard no_grad;
  const std::size_t n = data_.validation->clips().size(), used = std::min<std::size_t>(n, 256);
  double sum = 0, counted = 0;
  for (std::size_t begin = 0; begin < used; begin += 32) {
    std::vector<std::pair<std::size_t, std::int64_t>> places;
    for (std::size_t i = begin; i < std::min(begin + 32, used); ++i) {
      const std::size_t clip = i * n / used;
      places.emplace_back(clip, std::max<std::int64_t>(0, (data_.validation->clips()[clip].size(0) - config_.window) / 2));
    }
    Random noise(config_.seed, stream_of(kValidation, begin));
    const Rows part = rows(*data_.validation, data_.validation_noisy, places, noise);
    sum += squares(part, 0, static_cast<std::int64_t>(places.size())).item<double>();
    counted += part.mask.sum().item<double>() * static_cast<double>(part.clean.size(2));
  }
  return sum / counted;
}

}  // namespace mocap::denoiser
