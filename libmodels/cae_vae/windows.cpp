#include "libmodels/cae_vae/windows.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "libmocap/base/error.hpp"
#include "libmocap/base/sha256.hpp"
#include "libmocap/clip/position_fit.hpp"

namespace mocap::cae_vae {
namespace {

using features::FeatureMatrix;
constexpr int kColumns = features::kMotegiColumns, kRoot = features::kMotegiRootVelocities;
constexpr double kLeastMetres = 1e-3, kLeastVelocity = 1e-2;

}  // namespace

torch::Tensor standardised(const FeatureMatrix& x, const Reference& reference) {
  torch::Tensor out = torch::empty({x.rows(), kColumns}, torch::kFloat32);
  float* p = out.data_ptr<float>();
  for (Eigen::Index t = 0; t < x.rows(); ++t)
    for (int c = 0; c < kColumns; ++c) *p++ = static_cast<float>((x(t, c) - static_cast<double>(reference.mean[static_cast<std::size_t>(c)])) / static_cast<double>(reference.deviation[static_cast<std::size_t>(c)]));
  return out;
}

FeatureMatrix restored(const float* rows, std::int64_t frames, const Reference& reference) {
  FeatureMatrix x(frames, kColumns);
  for (Eigen::Index t = 0; t < frames; ++t)
    for (int c = 0; c < kColumns; ++c) x(t, c) = static_cast<double>(*rows++) * static_cast<double>(reference.deviation[static_cast<std::size_t>(c)]) + static_cast<double>(reference.mean[static_cast<std::size_t>(c)]);
  return x;
}

WindowDataset::WindowDataset(const std::string& path, std::int64_t length, std::int64_t overlap, const Reference* like) : length_(length), step_(length - overlap) {
  if (!(overlap >= 0 && overlap < length)) refuse_usage(fmt::format("windows of {} frames that overlap by {}, expected an overlap from 0 to {}", length, overlap, length - 1));
  const store::ArchiveReader reader(path, store::Caching::in_order);
  header_ = reader.header();
  file_sha256_ = reader.file_sha256();
  name_ = reader.name();
  reference_.skeleton = header_.skeleton;
  reference_.frame_rate_hz = header_.frame_rate_hz;
  try {
    PositionFitter(header_.skeleton, features::motegi_joints(*header_.skeleton));  // what is sampled has to come back as rotations
  } catch (const Error& e) {
    throw e.in_file(name_);
  }
  if (like) {
    train::check_alike(*header_.skeleton, header_.frame_rate_hz, *like, {name_, 0, {}}, "the training data");
    reference_ = *like;
  }
  Sha256 digest;
  digest.update(reader.digest());  // knows nothing of the order of the clips
  std::set<std::string> sources;
  std::vector<FeatureMatrix> encoded;
  std::vector<double> floors;
  MeanPose pose;
  for (std::size_t i = 0; i < reader.size(); ++i) {
    digest.update("\n" + reader.info(i).digest);
    if (reader.info(i).length < length) {
      ++left_out_;
      continue;
    }
    const Clip clip = reader.read(i);
    const FeatureMatrix positions = features::motegi_positions(clip);
    pose.add(clip);
    if (!positions.allFinite()) refuse({name_, 0, "clip " + reader.info(i).name}, "joint positions that are not finite, expected motion of finite numbers");
    floors.push_back(features::motegi_placement(positions).floor);
    encoded.push_back(features::encode_motegi(positions, header_.frame_rate_hz));
    if (!reader.info(i).source.sha256.empty()) sources.insert(reader.info(i).source.sha256);
    for (std::int64_t first = 0; first + length <= reader.info(i).length; first += step_) windows_.push_back({encoded.size() - 1, first});
  }
  digest_ = to_hex(digest.finish());
  sources_.assign(sources.begin(), sources.end());
  if (encoded.empty()) refuse({name_, 0, {}}, fmt::format("{} clips, none as long as a window of {} frames", reader.size(), length), "train on longer clips, or with a shorter --window");
  natural_ = pose.rotations();
  std::nth_element(floors.begin(), floors.begin() + static_cast<std::ptrdiff_t>(floors.size() / 2), floors.end());
  floor_ = floors[floors.size() / 2];
  if (!like) {
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(kColumns), squares = Eigen::VectorXd::Zero(kColumns);
    double count = 0;
    for (const auto& x : encoded) {
      sum += x.colwise().sum().transpose();
      count += static_cast<double>(x.rows());
    }
    const Eigen::VectorXd mean = sum / count;
    for (const auto& x : encoded) squares += (x.rowwise() - mean.transpose()).array().square().matrix().colwise().sum().transpose();
    for (int c = 0; c < kColumns; ++c) {
      reference_.mean.push_back(static_cast<float>(mean[c]));
      reference_.deviation.push_back(static_cast<float>(std::max(std::sqrt(squares[c] / count), c < kColumns - kRoot ? kLeastMetres : kLeastVelocity)));
    }
  }
  for (const auto& x : encoded) clips_.push_back(standardised(x, reference_));
}

torch::Tensor WindowDataset::batch(const std::vector<std::size_t>& windows) const {
  std::vector<torch::Tensor> rows;
  for (const std::size_t w : windows) rows.push_back(clips_[windows_.at(w).clip].narrow(0, windows_[w].first, length_));
  return torch::stack(rows);
}

torch::Tensor WindowDataset::batch(const std::vector<std::size_t>& windows, std::int64_t shift, Random& random) const {
  std::vector<torch::Tensor> rows;
  for (const std::size_t w : windows) {
    const torch::Tensor& clip = clips_[windows_.at(w).clip];
    const auto by = static_cast<std::int64_t>(random.below(static_cast<std::uint64_t>(shift) + 1));
    rows.push_back(clip.narrow(0, std::min(windows_[w].first + by, clip.size(0) - length_), length_));
  }
  return torch::stack(rows);
}

std::string WindowDataset::contacts_rule() const { return header_.contacts_rule.starts_with("preset:") ? header_.contacts_rule : "preset:default"; }

std::int64_t WindowDataset::frames() const {
  std::int64_t n = 0;
  for (const auto& clip : clips_) n += clip.size(0);
  return n;
}

}  // namespace mocap::cae_vae
