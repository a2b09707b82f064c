#include "libmocap/features/motegi.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "libmocap/base/error.hpp"

namespace mocap::features {
namespace {

constexpr std::array<std::string_view, kMotegiJoints> kNames = {"pelvis", "left_hip", "left_knee", "left_ankle", "left_foot",     "right_hip",  "right_knee", "right_ankle",    "right_foot",  "spine1",
                                                                "spine3", "neck",     "head",      "left_shoulder", "left_elbow", "left_wrist", "right_shoulder", "right_elbow", "right_wrist"};
constexpr int kLeftShoulder = 13, kRightShoulder = 16;
constexpr int kVelocity = kMotegiColumns - kMotegiRootVelocities;
constexpr double kLeastLevel = 0.1;  // of v_f's length: cosine of its steepness

void check(const FeatureMatrix& x, Eigen::Index columns, double rate, const char* what) {
  if (x.cols() != columns) refuse({}, fmt::format("{} numbers in a frame, expected the {} of {}", x.cols(), columns, what));
  if (x.rows() == 0) refuse({}, "0 frames, expected at least one");
  if (!(std::isfinite(rate) && rate > 0)) refuse({}, fmt::format("{} Hz, expected a rate above 0", rate));
  for (Eigen::Index t = 0; t < x.rows(); ++t)
    if (!x.row(t).allFinite()) refuse({}, fmt::format("frame {} has a number that is not finite", t));
}

std::optional<double> heading_of(const FeatureMatrix& p, Eigen::Index t) {
  const Vector3 hip = p.row(t).head<3>(), left = p.row(t).segment<3>(3 * kLeftShoulder), right = p.row(t).segment<3>(3 * kRightShoulder);
  const Vector3 forward = (left - hip).cross(right - hip);
  const double level = std::hypot(forward.x(), forward.y());
  if (!(level > kLeastLevel * forward.norm())) return std::nullopt;
  return std::atan2(forward.y(), forward.x());
}

double first_heading(const FeatureMatrix& p, Eigen::Index from) {
  for (Eigen::Index t = from; t < p.rows(); ++t)
    if (const auto heading = heading_of(p, t)) return *heading;
  return 0;
}

double lowest(const FeatureMatrix& p, Eigen::Index t) {
  double z = p(t, 2);
  for (int j = 1; j < kMotegiJoints; ++j) z = std::min(z, p(t, 3 * j + 2));
  return z;
}

}  // namespace

const std::array<std::string_view, kMotegiJoints>& motegi_joint_names() { return kNames; }

std::vector<int> motegi_joints(const Skeleton& skeleton) {
  std::vector<int> joints;
  for (const std::string_view name : kNames) {
    const auto at = std::find(skeleton.joint_names.begin(), skeleton.joint_names.end(), name);
    if (at == skeleton.joint_names.end()) refuse({{}, 0, "skeleton"}, fmt::format("no joint {}, expected the canonical body", name), "canonicalize brings motion to it");
    joints.push_back(static_cast<int>(at - skeleton.joint_names.begin()));
  }
  return joints;
}

FeatureMatrix motegi_positions(const Clip& clip) {
  if (clip.frames() == 0) refuse({{}, 0, "clip " + clip.name}, "0 frames, expected at least one");
  const std::vector<int> joints = motegi_joints(*clip.skeleton);
  FeatureMatrix p(static_cast<Eigen::Index>(clip.frames()), 3 * kMotegiJoints);
  Pose pose;
  for (std::size_t t = 0; t < clip.frames(); ++t) {
    world_pose(clip, t, pose);
    for (int j = 0; j < kMotegiJoints; ++j) p.row(static_cast<Eigen::Index>(t)).segment<3>(3 * j) = pose.positions[static_cast<std::size_t>(joints[static_cast<std::size_t>(j)])].transpose();
  }
  return p;
}

MotegiPlacement motegi_placement(const FeatureMatrix& p, Eigen::Index frame) {
  if (p.cols() != 3 * kMotegiJoints || frame < 0 || frame >= p.rows()) throw Error(Exit::internal, {}, "motegi: a placement of a frame that is not there");
  double heading = first_heading(p, frame);
  for (Eigen::Index t = frame; t >= 0; --t)
    if (const auto valid = heading_of(p, t)) {
      heading = *valid;
      break;
    }
  return {p(frame, 0), p(frame, 1), heading, lowest(p, frame)};
}

FeatureMatrix encode_motegi(const FeatureMatrix& p, double rate) {
  check(p, 3 * kMotegiJoints, rate, "19 joints");
  FeatureMatrix x(p.rows(), kMotegiColumns);
  const double floor = lowest(p, 0);
  double before = first_heading(p, 0);
  for (Eigen::Index t = 0; t < p.rows(); ++t) {
    const double heading = heading_of(p, t).value_or(before), c = std::cos(heading), s = std::sin(heading);
    x(t, 0) = p(t, 2) - floor;
    for (int j = 1; j < kMotegiJoints; ++j) {
      const double dx = p(t, 3 * j) - p(t, 0), dy = p(t, 3 * j + 1) - p(t, 1);
      x(t, 3 * j - 2) = c * dx + s * dy;
      x(t, 3 * j - 1) = c * dy - s * dx;
      x(t, 3 * j) = p(t, 3 * j + 2) - floor;
    }
    if (t > 0) {
      const double dx = p(t, 0) - p(t - 1, 0), dy = p(t, 1) - p(t - 1, 1), cb = std::cos(before), sb = std::sin(before);
      x(t, kVelocity) = (cb * dx + sb * dy) * rate;
      x(t, kVelocity + 1) = (cb * dy - sb * dx) * rate;
      x(t, kVelocity + 2) = wrap_angle(heading - before) * rate;
    }
    before = heading;
  }
  if (x.rows() > 1)
    x.row(0).tail<kMotegiRootVelocities>() = x.row(1).tail<kMotegiRootVelocities>();
  else
    x.row(0).tail<kMotegiRootVelocities>().setZero();
  return x;
}

FeatureMatrix decode_motegi(const FeatureMatrix& x, double rate, const MotegiPlacement& start) {
  check(x, kMotegiColumns, rate, "the features");
  FeatureMatrix p(x.rows(), 3 * kMotegiJoints);
  double px = start.x, py = start.y, heading = start.heading, c = std::cos(heading), s = std::sin(heading);
  for (Eigen::Index t = 0; t < x.rows(); ++t) {
    if (t > 0) {
      const double dx = x(t, kVelocity) / rate, dy = x(t, kVelocity + 1) / rate;
      px += c * dx - s * dy;
      py += s * dx + c * dy;
      heading += x(t, kVelocity + 2) / rate;
      c = std::cos(heading);
      s = std::sin(heading);
    }
    double* row = p.row(t).data();
    const double* from = x.row(t).data();
    row[0] = px;
    row[1] = py;
    row[2] = from[0] + start.floor;
    for (int j = 1; j < kMotegiJoints; ++j) {
      const double dx = from[3 * j - 2], dy = from[3 * j - 1];
      row[3 * j] = px + c * dx - s * dy;
      row[3 * j + 1] = py + s * dx + c * dy;
      row[3 * j + 2] = from[3 * j] + start.floor;
    }
  }
  return p;
}

}  // namespace mocap::features
