#include "libmocap/metrics/clip_figures.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "libmocap/base/error.hpp"
#include "libmocap/base/parallel.hpp"
#include "libmocap/features/motion_cell.hpp"
#include "libmocap/metrics/linear_algebra.hpp"
#include "libmocap/metrics/motion_statistics.hpp"

namespace mocap::metrics {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kGmdHeight = 0.05, kGmdSpeed = 0.5;
constexpr std::size_t kGmdWindow = 5;
constexpr std::size_t kMostWindows = 300000;  // of training clips searched, so that thousands of clips take seconds

double mean_of(const std::vector<double>& v, std::size_t first, std::size_t count) {
  if (count == 0) return kNaN;
  const auto begin = v.begin() + static_cast<std::ptrdiff_t>(first);
  return std::accumulate(begin, begin + static_cast<std::ptrdiff_t>(count), 0.0) / static_cast<double>(count);
}

using Features = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// Standardised features of clips by the statistics of the training clips.
class Encoder {
 public:
  explicit Encoder(const std::vector<Clip>& training) {
    features::FeatureStatistics statistics({training[0].joints() - 1, features::RotationRepresentation::quaternion});
    const std::size_t every = (training.size() + 199) / 200;  // 200 clips tell the spread of a column
    for (std::size_t i = 0; i < training.size(); i += every) statistics.add(encode_motion_cell(training[i], features::RotationRepresentation::quaternion));
    const auto mean = statistics.mean(), deviation = statistics.deviation();
    mean_ = Eigen::Map<const Eigen::RowVectorXf>(mean.data(), static_cast<Eigen::Index>(mean.size()));
    scale_ = Eigen::Map<const Eigen::RowVectorXf>(deviation.data(), static_cast<Eigen::Index>(deviation.size())).cwiseInverse();
  }
  Features operator()(const Clip& clip) const {
    Features x = encode_motion_cell(clip, features::RotationRepresentation::quaternion).cast<float>();
    x.rowwise() -= mean_;
    x.array().rowwise() *= scale_.array();
    return x;
  }
  Eigen::Index columns() const { return mean_.size(); }

 private:
  Eigen::RowVectorXf mean_, scale_;
};

// Every step-th row of the window at `first`, end to end.
template <class Row>
void anchors(const Features& x, Eigen::Index first, const NeighbourOptions& o, Row&& row) {
  Eigen::Index at = 0;
  for (Eigen::Index w = 0; w < o.window; w += o.step, at += x.cols()) row.segment(at, x.cols()) = x.row(first + w);
}

}  // namespace

ClipFigures clip_figures(const Clip& clip) {
  ClipFigures out;
  const std::size_t frames = clip.frames(), joints = static_cast<std::size_t>(clip.joints());
  const int feet[2] = {clip.skeleton->find_role("left_foot"), clip.skeleton->find_role("right_foot")};
  if (feet[0] < 0 || feet[1] < 0) refuse({{}, 0, "clip " + clip.name}, "a skeleton without the roles left_foot and right_foot, expected both");
  std::array<std::vector<double>, 2> speed, height;
  std::vector<Vector3> last[4];  // positions of the last four frames, newest first
  double depth = 0, jerk = 0;
  Pose pose;
  for (std::size_t t = 0; t < frames; ++t) {
    world_pose(clip, t, pose);
    std::rotate(last, last + 3, last + 4);
    last[0] = pose.positions;
    for (const Vector3& p : pose.positions) depth += std::max(0.0, -p.z());
    for (std::size_t f = 0; f < 2; ++f) {
      const auto j = static_cast<std::size_t>(feet[f]);
      height[f].push_back(pose.positions[j].z());
      if (t > 0) speed[f].push_back((last[0][j] - last[1][j]).head<2>().norm() * clip.frame_rate_hz);
    }
    if (t >= 3)
      for (std::size_t j = 0; j < joints; ++j) jerk += (last[0][j] - 3 * last[1][j] + 3 * last[2][j] - last[3][j]).norm();
  }
  const std::size_t steps = frames > 0 ? frames - 1 : 0;
  double skate = 0, contact_speed = 0, contact_height = 0;
  std::size_t standing = 0, skating = 0, contact_steps = 0, contact_frames = 0;
  const auto down = [&](std::size_t t, std::size_t f) { return t < clip.contacts.size() && clip.contacts[t][f] != 0; };
  for (std::size_t t = 0; t < frames; ++t)
    for (std::size_t f = 0; f < 2; ++f) {
      if (!down(t, f)) continue;
      contact_height += height[f][t];
      ++contact_frames;
      if (!down(t + 1, f)) continue;
      contact_speed += speed[f][t];
      ++contact_steps;
    }
  for (std::size_t t = 0; t < steps; ++t) {
    bool skates = false;
    for (std::size_t f = 0; f < 2; ++f) {
      const double z = std::max(height[f][t], height[f][t + 1]);
      if (z < kSkateHeight) {
        skate += speed[f][t];
        ++standing;
      }
      if (z < kGmdHeight && speed[f][t] > kGmdSpeed) {
        double sum = 0;
        for (std::size_t k = t < kGmdWindow / 2 ? 0 : t - kGmdWindow / 2; k < std::min(steps, t + kGmdWindow / 2 + 1); ++k) sum += speed[f][k];
        skates = skates || sum / kGmdWindow > kGmdSpeed;
      }
    }
    skating += skates;
  }
  out.skate_mps = standing > 0 ? skate / static_cast<double>(standing) : kNaN;
  out.contact_speed_mps = contact_steps > 0 ? contact_speed / static_cast<double>(contact_steps) : kNaN;
  out.contact_height_m = contact_frames > 0 ? contact_height / static_cast<double>(contact_frames) : kNaN;
  out.skate_gmd = steps > 0 ? static_cast<double>(skating) / static_cast<double>(steps) : 0;
  out.penetration_m = frames > 0 ? depth / static_cast<double>(frames * joints) : 0;
  out.jerk = frames > 3 ? jerk / static_cast<double>((frames - 3) * joints) * std::pow(clip.frame_rate_hz, 3) : kNaN;
  const auto energy = joint_energy(clip);
  out.energy = mean_of(energy, 0, energy.size());
  const std::size_t third = energy.size() / 3;
  out.thirds[0] = mean_of(energy, 0, third);
  out.thirds[1] = mean_of(energy, third, third == 0 ? 0 : energy.size() - 2 * third);
  out.thirds[2] = mean_of(energy, energy.size() - third, third);
  return out;
}

std::vector<ClipFigures> clip_figures(const std::vector<Clip>& clips, int threads) {
  std::vector<ClipFigures> out(clips.size());
  parallel_for(clips.size(), threads, [&](std::size_t i) { out[i] = clip_figures(clips[i]); });
  return out;
}

Liveliness liveliness(const ClipFigures& clip, double real_energy) {
  if (clip.thirds[2] < 0.2 * real_energy) return Liveliness::frozen;
  for (const double e : clip.thirds)
    if (e > 5 * real_energy) return Liveliness::exploding;
  return Liveliness::alive;
}

std::pair<std::vector<std::size_t>, std::vector<std::size_t>> common_lengths(const std::vector<std::size_t>& a, const std::vector<std::size_t>& b, std::size_t longest) {
  const auto cut_to = [longest](const std::vector<std::size_t>& mine, const std::vector<std::size_t>& other) {
    std::vector<std::size_t> order(mine.size()), sorted = other, out = mine;
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(), [&](std::size_t i, std::size_t j) { return mine[i] < mine[j]; });
    std::sort(sorted.begin(), sorted.end());
    for (std::size_t rank = 0; rank < order.size(); ++rank) {
      std::size_t& length = out[order[rank]];
      if (!sorted.empty()) length = std::min(length, sorted[(2 * rank + 1) * sorted.size() / (2 * order.size())]);
      if (longest > 0) length = std::min(length, longest);
    }
    return out;
  };
  return {cut_to(a, b), cut_to(b, a)};
}

std::vector<Neighbour> nearest_training_clips(const std::vector<Clip>& clips, const std::vector<Clip>& training, const NeighbourOptions& options) {
  NeighbourOptions o = options;
  const auto window = static_cast<std::size_t>(o.window);
  std::vector<std::size_t> asked;
  for (std::size_t i = 0; i < clips.size(); ++i)
    if (clips[i].frames() >= window) asked.push_back(i);
  if (asked.size() > o.most) {
    for (std::size_t i = 0; i < o.most; ++i) asked[i] = asked[i * asked.size() / o.most];
    asked.resize(o.most);
  }
  if (asked.empty() || training.empty()) return {};
  use_one_blas_thread();
  if (o.stride == 0) {
    std::size_t windows = 0;
    for (const Clip& c : training) windows += c.frames() >= window ? c.frames() - window + 1 : 0;
    o.stride = static_cast<int>(std::max<std::size_t>(1, (windows + kMostWindows - 1) / kMostWindows));
  }
  const Encoder encode(training);
  const Eigen::Index width = (o.window + o.step - 1) / o.step * encode.columns(), count = static_cast<Eigen::Index>(asked.size());
  const auto middle = [&](std::size_t i) { return static_cast<Eigen::Index>((clips[asked[i]].frames() - window) / 2); };
  Eigen::MatrixXf mine(count, width);
  parallel_for(asked.size(), o.threads, [&](std::size_t i) { anchors(encode(clips[asked[i]]), middle(i), o, mine.row(static_cast<Eigen::Index>(i))); });

  // A block of training clips at a time; of equally near windows the first counts, so the order of the blocks decides nothing.
  constexpr std::size_t kClips = 16;
  const std::size_t blocks = (training.size() + kClips - 1) / kClips;
  struct Best {
    float distance = std::numeric_limits<float>::infinity();
    std::size_t clip = 0, frame = 0;
  };
  std::vector<std::vector<Best>> best(blocks, std::vector<Best>(asked.size()));
  parallel_for(blocks, o.threads, [&](std::size_t b) {
    for (std::size_t k = b * kClips; k < std::min(training.size(), (b + 1) * kClips); ++k) {
      if (training[k].frames() < window) continue;
      const Features x = encode(training[k]);
      const Eigen::Index windows = (x.rows() - o.window) / o.stride + 1;
      Eigen::MatrixXf theirs(windows, width);
      for (Eigen::Index w = 0; w < windows; ++w) anchors(x, w * o.stride, o, theirs.row(w));
      Eigen::MatrixXf d = -2 * product_transposed(theirs, mine);
      d.colwise() += theirs.rowwise().squaredNorm();  // the sample's own norm changes no order
      for (Eigen::Index i = 0; i < count; ++i) {
        Eigen::Index at = 0;
        const float least = d.col(i).minCoeff(&at);
        if (Best& now = best[b][static_cast<std::size_t>(i)]; least < now.distance) now = {least, k, static_cast<std::size_t>(at * o.stride)};
      }
    }
  });
  std::vector<Neighbour> out(asked.size());
  parallel_for(asked.size(), o.threads, [&](std::size_t i) {
    Best least;
    for (const auto& of_block : best)
      if (of_block[i].distance < least.distance) least = of_block[i];
    out[i] = {asked[i], least.clip, least.frame, kNaN};
    if (!std::isfinite(least.distance)) return;
    const Features a = encode(clips[asked[i]]), b = encode(training[least.clip]);
    // Between the offsets searched may lie a better one: a copy's is found exactly.
    const auto last = static_cast<std::size_t>(b.rows() - o.window), stride = static_cast<std::size_t>(o.stride);
    double nearest = std::numeric_limits<double>::infinity();
    for (std::size_t f = least.frame < stride ? 0 : least.frame - stride + 1; f <= std::min(last, least.frame + stride - 1); ++f) {
      const Features difference = a.middleRows(middle(i), o.window) - b.middleRows(static_cast<Eigen::Index>(f), o.window);
      if (const double square = static_cast<double>(difference.squaredNorm()); square < nearest) {
        nearest = square;
        out[i].frame = f;
      }
    }
    out[i].distance = std::sqrt(nearest / (o.window * static_cast<double>(a.cols())));
  });
  std::erase_if(out, [](const Neighbour& n) { return std::isnan(n.distance); });
  return out;
}

}  // namespace mocap::metrics
