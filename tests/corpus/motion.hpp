// What the tests measure on a clip, from its rotations alone: nothing of the generators' plans is used.
#pragma once
#include <algorithm>
#include <cmath>
#include <vector>

#include "libmocap/corpus/corpus.hpp"
#include "libmocap/skeleton/canonical_body.hpp"

namespace mocap::corpus {

struct Track {
  const Clip& clip;
  std::vector<Pose> poses;
  std::vector<std::vector<Vector3>> tips;  // end sites

  explicit Track(const Clip& c) : clip(c), poses(c.frames()) {
    for (std::size_t t = 0; t < c.frames(); ++t) {
      world_pose(c, t, poses[t]);
      tips.push_back(end_site_positions(*c.skeleton, poses[t]));
    }
  }
  std::size_t size() const { return poses.size(); }
  const Vector3& at(std::size_t t, int joint) const { return poses[t].positions[static_cast<std::size_t>(joint)]; }
  const Quaternion& local(std::size_t t, int joint) const { return clip.frame(t)[static_cast<std::size_t>(joint)]; }
  double scale() const {
    return -clip.skeleton->rest_offsets[kLeftKnee].z() / -canonical_body()->rest_offsets[kLeftKnee].z();
  }

  // Direction of travel, or of facing where the body stays: of the pelvis.
  double heading(std::size_t t) const {
    const Vector3 left = at(t, kLeftHip) - at(t, kRightHip);
    return std::atan2(-left.x(), left.y());
  }
  Vector3 forward(std::size_t t) const { return Vector3(std::cos(heading(t)), std::sin(heading(t)), 0); }
  // Rotation of a joint in the world without the heading of the whole body over `around` frames.
  Quaternion facing_free(std::size_t t, int joint) const {
    return yaw_rotation(-heading(t)) * poses[t].rotations[static_cast<std::size_t>(joint)];
  }

  double knee(std::size_t t, int side) const { return log_map(local(t, kLeftKnee + side)).y(); }
  double elbow(std::size_t t, int side) const {
    return (side == 0 ? -1 : 1) * log_map(local(t, kLeftElbow + side)).z();
  }
  double foot_pitch(std::size_t t, int side) const {  // toes up positive
    const Vector3 along = poses[t].rotations[static_cast<std::size_t>(kLeftAnkle + side)] * Vector3::UnitX();
    return std::asin(std::clamp(along.z(), -1.0, 1.0));
  }
  double lean(std::size_t t) const {  // of neck over pelvis, forwards, radians
    const Vector3 up = at(t, kNeck) - at(t, kPelvis);
    return std::atan2(up.dot(forward(t)), up.z());
  }
  // Height of the lowest point of a sole: under the heel, the ball and the tip of the toes.
  double sole(std::size_t t, int side) const {
    const double s = scale();
    const Vector3 heel = at(t, kLeftAnkle + side) + poses[t].rotations[static_cast<std::size_t>(kLeftAnkle + side)] *
                                                        Vector3(-0.048 * s, 0, -kAnkleSoleHeight * s);
    const double tip = tips[t][static_cast<std::size_t>(3 + side)].z() -
                       (kFootSoleHeight * s + clip.skeleton->end_sites[3].offset.z());
    return std::min({heel.z(), at(t, kLeftFoot + side).z() - kFootSoleHeight * s, tip});
  }
  bool planted(std::size_t t, int side) const { return clip.contacts[t][static_cast<std::size_t>(side)] != 0; }
};

inline double mean(const std::vector<double>& v) {
  double sum = 0;
  for (const double x : v) sum += x;
  return v.empty() ? 0 : sum / static_cast<double>(v.size());
}

inline double deviation(const std::vector<double>& v) {
  const double m = mean(v);
  double sum = 0;
  for (const double x : v) sum += (x - m) * (x - m);
  return v.empty() ? 0 : std::sqrt(sum / static_cast<double>(v.size()));
}

inline double correlation(const std::vector<double>& a, const std::vector<double>& b) {
  const double ma = mean(a), mb = mean(b);
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - ma) * (b[i] - mb);
  return sum / static_cast<double>(a.size()) / (deviation(a) * deviation(b));
}

}  // namespace mocap::corpus
