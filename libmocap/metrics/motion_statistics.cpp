#include "libmocap/metrics/motion_statistics.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "libmocap/base/parallel.hpp"

namespace mocap::metrics {
namespace {

using features::FeatureMatrix;
using features::RotationRepresentation;

double percentile(std::vector<double>& values, double p) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  const auto at = static_cast<std::ptrdiff_t>(std::lround(p * static_cast<double>(values.size() - 1)));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

bool same_labels(const Clip& a, const Clip& b, const std::vector<std::string>& keys) {
  return std::all_of(keys.begin(), keys.end(), [&](const std::string& key) {
    const auto x = a.attributes.find(key), y = b.attributes.find(key);
    return x != a.attributes.end() && y != b.attributes.end() && x->second == y->second;
  });
}

}  // namespace

std::vector<double> joint_energy(const Clip& clip) {
  const auto alpha = impact_factors(*clip.skeleton);
  const auto joints = static_cast<std::size_t>(clip.joints());
  std::vector<double> energy;
  for (std::size_t t = 0; t + 1 < clip.frames(); ++t) {
    double sum = 0;
    for (std::size_t j = 1; j < joints; ++j) sum += alpha[j] * geodesic_distance(clip.rotations[t * joints + j], clip.rotations[(t + 1) * joints + j]);
    energy.push_back(sum * clip.frame_rate_hz);
  }
  return energy;
}

MotionStatistics motion_statistics(const std::vector<Clip>& clips, double reference_energy) {
  MotionStatistics s;
  s.clips = clips.size();
  double energy = 0, speed = 0, skate = 0, first = 0, second = 0;
  std::size_t steps = 0, skate_steps = 0, down = 0, second_steps = 0;
  std::vector<double> heights;
  std::vector<std::vector<double>> energies;
  for (const Clip& clip : clips) {
    energies.push_back(joint_energy(clip));
    const auto joints = static_cast<std::size_t>(clip.joints());
    const int feet[2] = {clip.skeleton->find_role("left_foot"), clip.skeleton->find_role("right_foot")};
    Pose before, now;
    for (std::size_t t = 0; t < clip.frames(); ++t) {
      heights.push_back(clip.root_position[t].z());
      if (!clip.contacts.empty()) down += clip.contacts[t][0] || clip.contacts[t][1];
      world_pose(clip, t, now);
      if (t > 0) {
        speed += (clip.root_position[t] - clip.root_position[t - 1]).head<2>().norm() * clip.frame_rate_hz;
        energy += energies.back()[t - 1];
        ++steps;
        for (std::size_t f = 0; f < 2 && !clip.contacts.empty(); ++f)
          if (feet[f] >= 0 && clip.contacts[t][f] && clip.contacts[t - 1][f]) {
            const auto j = static_cast<std::size_t>(feet[f]);
            skate += (now.positions[j] - before.positions[j]).head<2>().norm() * clip.frame_rate_hz;
            ++skate_steps;
          }
      }
      if (t > 1)
        for (std::size_t j = 1; j < joints; ++j) {
          const Quaternion a = clip.rotations[(t - 2) * joints + j].conjugate() * clip.rotations[(t - 1) * joints + j];
          const Quaternion b = clip.rotations[(t - 1) * joints + j].conjugate() * clip.rotations[t * joints + j];
          first += log_map(b).norm();
          second += (log_map(b) - log_map(a)).norm();
          ++second_steps;
        }
      std::swap(before, now);
    }
    s.frames += clip.frames();
  }
  const auto ratio = [](double a, double b) { return b > 0 ? a / b : 0.0; };
  s.energy = ratio(energy, static_cast<double>(steps));
  s.root_speed = ratio(speed, static_cast<double>(steps));
  s.skate_mps = ratio(skate, static_cast<double>(skate_steps));
  s.contact_share = ratio(static_cast<double>(down), static_cast<double>(s.frames));
  s.jerkiness = ratio(second, first);
  if (!heights.empty()) {
    s.root_height_low = percentile(heights, 0.01);
    s.root_height_high = percentile(heights, 0.99);
  }
  const double reference = reference_energy > 0 ? reference_energy : s.energy;
  std::size_t frozen = 0;
  for (const auto& e : energies) {
    const std::size_t third = e.size() / 3;
    if (third == 0) continue;
    double sum = 0;
    for (std::size_t t = e.size() - third; t < e.size(); ++t) sum += e[t];
    frozen += sum / static_cast<double>(third) < 0.2 * reference;
  }
  s.frozen_share = ratio(static_cast<double>(frozen), static_cast<double>(clips.size()));
  return s;
}

std::vector<double> nearest_training_distances(const std::vector<Clip>& clips, const std::vector<Clip>& training, const NearestOptions& o) {
  using Block = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  if (training.empty()) return {};
  features::FeatureStatistics statistics({training[0].joints() - 1, RotationRepresentation::quaternion});
  std::vector<Block> known;
  const auto encode = [&](const Clip& c) { return encode_motion_cell(c, RotationRepresentation::quaternion); };
  for (const Clip& c : training) {
    const FeatureMatrix x = encode(c);
    statistics.add(x);
    known.push_back(x.cast<float>());
  }
  const auto mean = statistics.mean(), deviation = statistics.deviation();
  const auto standardise = [&](Block& x) {
    for (Eigen::Index c = 0; c < x.cols(); ++c) x.col(c).array() = (x.col(c).array() - mean[static_cast<std::size_t>(c)]) / deviation[static_cast<std::size_t>(c)];
  };
  for (Block& x : known) standardise(x);

  std::vector<std::vector<double>> found(clips.size());
  parallel_for(clips.size(), o.threads, [&](std::size_t i) {
    Block x = encode(clips[i]).cast<float>();
    standardise(x);
    const Eigen::Index width = x.cols();
    for (Eigen::Index t = 0; t + o.window <= x.rows(); t += o.stride) {
      float best = std::numeric_limits<float>::infinity();
      for (std::size_t k = 0; k < known.size(); ++k) {
        if (!same_labels(clips[i], training[k], o.match)) continue;
        for (Eigen::Index u = 0; u + o.window <= known[k].rows(); u += o.training_stride) {
          // Rows lie end to end, so a window is one vector; most candidates are dismissed after a few rows.
          float sum = 0;
          for (Eigen::Index w = 0; w < o.window && sum < best; w += 10) {
            const Eigen::Index rows = std::min<Eigen::Index>(10, o.window - w);
            const Eigen::Map<const Eigen::ArrayXf> a(x.data() + (t + w) * width, rows * width), b(known[k].data() + (u + w) * width, rows * width);
            sum += (a - b).square().sum();
          }
          best = std::min(best, sum);
        }
      }
      if (std::isfinite(best)) found[i].push_back(std::sqrt(static_cast<double>(best) / (o.window * static_cast<double>(width))));
    }
  });
  std::vector<double> all;
  for (const auto& f : found) all.insert(all.end(), f.begin(), f.end());
  return all;
}

double median(std::vector<double> values) { return percentile(values, 0.5); }

}  // namespace mocap::metrics
