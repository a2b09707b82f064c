#include "libmodels/denoiser/denoiser.hpp"

#include <fmt/core.h>
#include <torch/torch.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "libmocap/base/error.hpp"
#include "libmocap/features/motion_cell.hpp"
#include "libmocap/store/model_file.hpp"
#include "libmodels/denoiser/network.hpp"
#include "libmodels/nn/mlp.hpp"
#include "libmodels/train/tensors.hpp"

namespace mocap::denoiser {
namespace {

using features::FeatureMatrix;

constexpr std::int64_t kPart = 4096;     // frames of a long clip at a time
constexpr double kPathSeconds = 0.1, kSpikeSeconds = 0.134;

// Gaussian mean of a sequence, the weights of what lies outside given to the rest.
std::vector<double> smoothed(const std::vector<double>& x, double deviation_frames) {
  const auto n = static_cast<std::int64_t>(x.size()), reach = static_cast<std::int64_t>(std::ceil(3 * deviation_frames));
  std::vector<double> weight;
  for (std::int64_t k = 0; k <= reach; ++k) weight.push_back(std::exp(-0.5 * static_cast<double>(k * k) / (deviation_frames * deviation_frames)));
  std::vector<double> out(x.size());
  for (std::int64_t t = 0; t < n; ++t) {
    double sum = 0, total = 0;
    for (std::int64_t k = std::max<std::int64_t>(0, t - reach); k <= std::min(n - 1, t + reach); ++k) {
      const double w = weight[static_cast<std::size_t>(std::abs(k - t))];
      total += w * x[static_cast<std::size_t>(k)];
      sum += w;
    }
    out[static_cast<std::size_t>(t)] = total / sum;
  }
  return out;
}

// Median of the values at most `reach` away, so that a spike does not pull its surroundings along; fewer near the ends, as many on both sides.
std::vector<double> median(const std::vector<double>& x, std::int64_t reach) {
  const auto n = static_cast<std::int64_t>(x.size());
  std::vector<double> out(x.size());
  for (std::int64_t t = 0; t < n; ++t) {
    const std::int64_t r = std::min({reach, t, n - 1 - t});
    std::vector<double> near(x.begin() + (t - r), x.begin() + (t + r + 1));
    std::nth_element(near.begin(), near.begin() + r, near.end());
    out[static_cast<std::size_t>(t)] = near[static_cast<std::size_t>(r)];
  }
  return out;
}

}  // namespace

struct Denoiser::State {
  std::string file;
  std::shared_ptr<const Skeleton> skeleton;
  double rate = 0;
  std::vector<float> mean, deviation;
  std::unique_ptr<Network> network;
};

Denoiser::Denoiser(std::unique_ptr<State> state) : state_(std::move(state)) {}
Denoiser::~Denoiser() = default;

std::unique_ptr<Denoiser> Denoiser::load(const std::string& path, std::string* file_sha256) {
  const store::ModelFile model = store::read_model(path, file_sha256);
  auto s = std::make_unique<State>();
  const std::string file = path == "-" ? "<stdin>" : path;
  s->file = file;
  const train::Described config = train::described(model, "denoiser", file);
  NetworkConfig network;
  try {
    network = network_config_from_json(config.network);
  } catch (const Error& e) {
    throw e.in_file(file);
  }
  s->rate = config.frame_rate_hz;
  if (!(std::isfinite(s->rate) && s->rate > 0)) refuse({file, 0, "config"}, "no frame_rate_hz above 0, expected that of the training data");
  s->skeleton = model.skeleton;
  if (!s->skeleton || s->skeleton->joint_count() - 1 != network.joints) refuse({file, 0, "skeleton"}, "another number of joints than the network's");
  train::check_numbers(model, network.columns(), network.parameter_count(), file);
  s->network = std::make_unique<Network>(network);
  train::load_weights(nn::parameters_by_path(*s->network), model.weights, file);
  s->mean = model.mean;
  s->deviation = model.deviation;
  return std::unique_ptr<Denoiser>(new Denoiser(std::move(s)));
}

Clip Denoiser::apply(const Clip& clip) const {
  const State& s = *state_;
  const Where where{{}, 0, "clip " + clip.name};
  if (!clip.skeleton || (clip.skeleton != s.skeleton && !clip.skeleton->same_as(*s.skeleton, 1e-5)))
    refuse(where, "another skeleton than the denoiser's, expected the one it was trained on (" + s.file + ")", "canonicalize brings motion to one body");
  if (std::abs(clip.frame_rate_hz - s.rate) > 1e-9 * s.rate)
    refuse(where, fmt::format("{} Hz, expected the {} Hz that the denoiser {} was trained at", clip.frame_rate_hz, s.rate, s.file), "canonicalize --fps brings motion to one rate");
  FeatureMatrix x = features::encode_motion_cell(clip, features::RotationRepresentation::quaternion);
  if (!x.allFinite()) refuse(where, "features that are not finite, expected motion of finite numbers");

  const torch::NoGradGuard no_grad;
  const std::int64_t frames = x.rows(), columns = x.cols();
  torch::Tensor standard = torch::empty({frames, columns}, torch::kFloat32);
  float* p = standard.data_ptr<float>();
  for (Eigen::Index t = 0; t < frames; ++t)
    for (Eigen::Index c = 0; c < columns; ++c) *p++ = static_cast<float>((x(t, c) - s.mean[static_cast<std::size_t>(c)]) / s.deviation[static_cast<std::size_t>(c)]);
  // A pose that lasts is no spike, however far from what was trained on: the network sees it shifted to within its cut.
  const auto reach = static_cast<std::int64_t>(std::lround(kSpikeSeconds * clip.frame_rate_hz));
  p = standard.data_ptr<float>();
  std::vector<double> column(static_cast<std::size_t>(frames));
  for (std::int64_t c = 0; c < columns; ++c) {
    bool far = false;
    for (std::int64_t t = 0; t < frames; ++t) {
      column[static_cast<std::size_t>(t)] = p[t * columns + c];
      far = far || std::abs(p[t * columns + c]) > kCut;
    }
    if (!far) continue;
    const auto lasting = median(column, reach);
    for (std::int64_t t = 0; t < frames; ++t) {
      const double m = lasting[static_cast<std::size_t>(t)];
      p[t * columns + c] -= static_cast<float>(m - std::clamp(m, -kCut, kCut));
    }
  }
  for (std::int64_t first = 0; first < frames; first += kPart) {
    const std::int64_t count = std::min(kPart, frames - first);
    const torch::Tensor in = with_edges(standard, first, count).unsqueeze(0);
    // The change alone is taken from float: what the network leaves alone stays as exact as it was.
    const torch::Tensor change = (s.network->forward(in) - in).squeeze(0).narrow(0, kReach, count).contiguous();
    const float* d = change.data_ptr<float>();
    for (std::int64_t t = 0; t < count; ++t)
      for (std::int64_t c = 0; c < columns; ++c) x(first + t, c) += static_cast<double>(*d++) * s.deviation[static_cast<std::size_t>(c)];
  }
  if (!x.allFinite()) refuse(where, "the denoiser gives numbers that are not finite, expected motion like what it was trained on");

  Clip out = clip;
  const Clip free = features::decode_motion_cell(x, clip.skeleton, clip.frame_rate_hz, features::RotationRepresentation::quaternion);
  out.rotations = free.rotations;
  const auto joints = static_cast<std::size_t>(clip.joints());
  const auto n = static_cast<std::size_t>(frames);
  const Eigen::Index root = columns - features::kRootValues;
  const double deviation = kPathSeconds * clip.frame_rate_hz;
  // Yaw of the root before, continuous, and as the denoised rates add up to.
  std::vector<double> lag(n);
  double heading = yaw_of(clip.rotations[0]), measured = heading;
  std::vector<double> headings(n);
  for (std::size_t t = 0; t < n; ++t) {
    if (t > 0) {
      measured += wrap_angle(yaw_of(clip.rotations[t * joints]) - yaw_of(clip.rotations[(t - 1) * joints]));
      heading += x(static_cast<Eigen::Index>(t - 1), root + 3) / clip.frame_rate_hz;
    }
    headings[t] = heading;
    lag[t] = measured - heading;
  }
  const auto turn = smoothed(median(lag, reach), deviation);
  std::vector<Vector2> place(n);
  std::vector<double> behind_x(n), behind_y(n);
  Vector2 at = clip.root_position[0].head<2>();
  for (std::size_t t = 0; t < n; ++t) {
    headings[t] += turn[t];
    place[t] = at;
    behind_x[t] = clip.root_position[t].x() - at.x();
    behind_y[t] = clip.root_position[t].y() - at.y();
    const auto i = static_cast<Eigen::Index>(t);
    at += (yaw_rotation(headings[t]) * Vector3(x(i, root), x(i, root + 1), 0)).head<2>() / clip.frame_rate_hz;
  }
  const auto follow_x = smoothed(median(behind_x, reach), deviation), follow_y = smoothed(median(behind_y, reach), deviation);
  for (std::size_t t = 0; t < n; ++t) {
    const auto i = static_cast<Eigen::Index>(t);
    out.rotations[t * joints] = yaw_rotation(headings[t]) * exp_map(Vector3(x(i, root + 4), x(i, root + 5), 0));
    const Vector2 xy = place[t] + Vector2(follow_x[t], follow_y[t]);
    out.root_position[t] = Vector3(xy.x(), xy.y(), x(i, root + 2));
  }
  make_sign_continuous(out);
  return out;
}

std::vector<JointChange> changes(const Clip& before, const Clip& after) {
  const auto joints = static_cast<std::size_t>(before.joints());
  const std::size_t frames = before.frames();
  if (after.frames() != frames || static_cast<std::size_t>(after.joints()) != joints) throw Error(Exit::internal, {}, "clips of different sizes cannot be compared");
  std::vector<JointChange> out(joints);
  std::vector<double> peak_after(joints, 0);
  Pose a, b, last_a, last_b;
  for (std::size_t t = 0; t < frames; ++t) {
    world_pose(before, t, a);
    world_pose(after, t, b);
    for (std::size_t j = 0; j < joints; ++j) {
      JointChange& c = out[j];
      const double deg = geodesic_distance(before.rotations[t * joints + j], after.rotations[t * joints + j]) * 180 / std::numbers::pi;
      const double mm = 1000 * (a.positions[j] - b.positions[j]).norm();
      c.mean_deg += deg / static_cast<double>(frames);
      c.mean_mm += mm / static_cast<double>(frames);
      if (deg > c.worst_deg) c.worst_deg = deg, c.worst_deg_frame = t;
      if (mm > c.worst_mm) c.worst_mm = mm, c.worst_mm_frame = t;
      if (t > 0) {
        c.peak_speed_mps = std::max(c.peak_speed_mps, (a.positions[j] - last_a.positions[j]).norm() * before.frame_rate_hz);
        peak_after[j] = std::max(peak_after[j], (b.positions[j] - last_b.positions[j]).norm() * before.frame_rate_hz);
      }
    }
    last_a = a;
    last_b = b;
  }
  for (std::size_t j = 0; j < joints; ++j) out[j].peak_speed_kept = out[j].peak_speed_mps > 0 ? peak_after[j] / out[j].peak_speed_mps : 1;
  return out;
}

}  // namespace mocap::denoiser
