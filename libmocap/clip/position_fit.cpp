#include "libmocap/clip/position_fit.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "libmocap/base/error.hpp"

namespace mocap {
namespace {

enum Part : std::size_t {
  kPelvis, kLeftHip, kRightHip, kSpine1, kLeftKnee, kRightKnee, kSpine2, kLeftAnkle, kRightAnkle, kSpine3, kLeftFoot, kRightFoot, kNeck, kLeftCollar, kRightCollar, kHead, kLeftShoulder,
  kRightShoulder, kLeftElbow, kRightElbow, kLeftWrist, kRightWrist, kParts
};
constexpr std::array<std::string_view, kParts> kNames = {"pelvis",    "left_hip",   "right_hip", "spine1",      "left_knee",    "right_knee", "spine2",        "left_ankle",     "right_ankle", "spine3",      "left_foot",
                                                         "right_foot", "neck",       "left_collar", "right_collar", "head",       "left_shoulder", "right_shoulder", "left_elbow",  "right_elbow", "left_wrist", "right_wrist"};
constexpr std::array<std::size_t, kParts> kParents = {kParts,  kPelvis, kPelvis, kPelvis,     kLeftHip,     kRightHip, kSpine1,       kLeftKnee,      kRightKnee,  kSpine2,     kLeftAnkle,
                                                      kRightAnkle, kSpine3, kSpine3, kSpine3, kNeck, kLeftCollar, kRightCollar, kLeftShoulder, kRightShoulder, kLeftElbow, kRightElbow};
constexpr bool inferred(std::size_t part) { return part == kSpine2 || part == kLeftCollar || part == kRightCollar; }

// Beside the sine of the bend: a limb straighter than this follows what is natural.
constexpr double kFootWeight = 0.03, kPelvisWeight = 0.02, kArmWeight = 0.03;
// Sine of the bend up to which a limb that closes the wrong way counts as straightened too far, and from which on it is believed: knees only ever look so, while an arm's natural plane is a guess.
struct WrongWay {
  double straight, believed;
};
constexpr WrongWay kLegs{0.1, 0.3}, kArms{0.06, 0.12};
constexpr double kNothing = 1e-9;  // m: too short for a direction

using Places = std::array<Vector3, kParts>;
using Turns = std::array<Quaternion, kParts>;  // to the world

Vector3 across(const Vector3& v, const Vector3& axis) { return v - axis * (axis.dot(v) / std::max(axis.squaredNorm(), kNothing * kNothing)); }

// Columns: along `first`, then as near to `second` as can be. The identity where they leave it open.
Eigen::Matrix3d triad(const Vector3& first, const Vector3& second) {
  Eigen::Matrix3d m;
  const Vector3 third = first.cross(second);
  if (third.norm() < kNothing * kNothing) return Eigen::Matrix3d::Identity();
  m.col(0) = first.normalized();
  m.col(2) = third.normalized();
  m.col(1) = m.col(2).cross(m.col(0));
  return m;
}

Quaternion turn(const Vector3& first, const Vector3& second, const Eigen::Matrix3d& rest) { return Quaternion(Eigen::Matrix3d(triad(first, second) * rest.transpose())).normalized(); }

Quaternion swing(const Vector3& from, const Vector3& to) { return from.norm() < kNothing || to.norm() < kNothing ? Quaternion::Identity() : rotation_between(from, to); }

struct Limb {
  std::size_t start, middle, end;
  Vector3 upper, lower, hinge;  // rest offsets of middle and end; axis about which the limb closes
  // |upper + R(theta) lower|^2 = sum + 2 (a cos theta + b sin theta)
  double sum, a, b;
  Limb(std::size_t s, std::size_t m, std::size_t e, const Vector3& upper_offset, const Vector3& lower_offset, const Vector3& axis) : start(s), middle(m), end(e), upper(upper_offset), lower(lower_offset), hinge(axis) {
    sum = upper.squaredNorm() + lower.squaredNorm() + 2 * upper.dot(hinge) * lower.dot(hinge);
    a = across(upper, hinge).dot(across(lower, hinge));
    b = upper.dot(hinge.cross(lower));
  }
  double opening(double distance) const {
    const double most = std::hypot(a, b);
    return std::atan2(b, a) + std::acos(std::clamp((distance * distance - sum) / (2 * std::max(most, kNothing * kNothing)), -1.0, 1.0));
  }
};

}  // namespace

struct PositionFitter::Body {
  std::array<int, kParts> joint{};      // in the skeleton
  std::array<Eigen::Index, kParts> column{};  // of the positions; -1 where not given
  std::array<Vector3, kParts> offset;
  Eigen::Matrix3d pelvis, chest;  // triads at rest
  std::vector<Limb> legs, arms;   // left, right
  std::array<Quaternion, kParts> natural;  // of joints without one that hangs on them; of neck, ankles and elbows the turn about their own axis

  // Places and rotations in the world for one frame of targets.
  void solve(const Places& target, Places& place, Turns& world) const {
    world[kPelvis] = turn(target[kLeftHip] - target[kRightHip], target[kSpine1] - 0.5 * (target[kLeftHip] + target[kRightHip]), pelvis);
    place[kPelvis] = target[kPelvis];
    const auto put = [&](std::size_t part, std::size_t parent) { place[part] = place[parent] + world[parent] * offset[part]; };
    put(kSpine1, kPelvis);
    world[kSpine3] = turn(target[kNeck] - target[kSpine3], target[kLeftShoulder] - target[kRightShoulder], chest);
    world[kSpine1] = slerp(world[kPelvis], world[kSpine3], 1.0 / 3);
    world[kSpine2] = slerp(world[kPelvis], world[kSpine3], 2.0 / 3);
    const Quaternion straighten = swing(world[kSpine1] * offset[kSpine2] + world[kSpine2] * offset[kSpine3], target[kSpine3] - place[kSpine1]);
    world[kSpine1] = straighten * world[kSpine1];
    world[kSpine2] = straighten * world[kSpine2];
    put(kSpine2, kSpine1);
    put(kSpine3, kSpine2);
    put(kNeck, kSpine3);
    world[kNeck] = swing(world[kSpine3] * offset[kHead], target[kHead] - place[kNeck]) * world[kSpine3] * natural[kNeck];
    put(kHead, kNeck);
    world[kHead] = world[kNeck] * natural[kHead];
    for (const auto& [collar, shoulder] : {std::pair{kLeftCollar, kLeftShoulder}, {kRightCollar, kRightShoulder}}) {
      put(collar, kSpine3);
      world[collar] = swing(world[kSpine3] * offset[shoulder], target[shoulder] - place[collar]) * world[kSpine3];
      put(shoulder, collar);
    }
    for (std::size_t side = 0; side < 2; ++side) {
      const Limb &leg = legs[side], &arm = arms[side];
      put(leg.start, kPelvis);
      const std::size_t foot = side == 0 ? kLeftFoot : kRightFoot;
      const Vector3 toes = target[foot] - target[leg.end], shin = target[leg.end] - target[leg.middle];
      place_limb(leg, target, kFootWeight * toes.cross(shin).normalized() + kPelvisWeight * (world[kPelvis] * leg.hinge), kLegs, place, world);
      world[leg.end] = swing(world[leg.middle] * offset[foot], target[foot] - place[leg.end]) * world[leg.middle] * natural[leg.end];
      put(foot, leg.end);
      world[foot] = world[leg.end] * natural[foot];
      const std::size_t collar = side == 0 ? kLeftCollar : kRightCollar;
      place_limb(arm, target, kArmWeight * (swing(world[collar] * arm.upper, target[arm.end] - place[arm.start]) * (world[collar] * arm.hinge)), kArms, place, world);
      world[arm.middle] = world[arm.middle] * natural[arm.middle];
      world[arm.end] = world[arm.middle] * natural[arm.end];
    }
  }

  // `natural`: normal of its plane that is added to the observed one.
  void place_limb(const Limb& limb, const Places& target, const Vector3& natural, const WrongWay& wrong, Places& place, Turns& world) const {
    const Vector3 way = target[limb.end] - place[limb.start], seen_way = target[limb.end] - target[limb.start], upper = target[limb.middle] - target[limb.start];
    const double theta = limb.opening(way.norm());
    const Quaternion open = exp_map(limb.hinge * theta);
    const Vector3 reach = limb.upper + open * limb.lower;
    Vector3 normal = natural;
    const double scale = limb.upper.norm() * limb.lower.norm();
    if (scale > kNothing * kNothing) {
      Vector3 seen = upper.cross(seen_way) / scale;
      if (const Vector3 m = natural.normalized(); seen.dot(m) < 0) {
        const double u = std::clamp((-seen.dot(m) - wrong.straight) / (wrong.believed - wrong.straight), 0.0, 1.0);
        seen -= m * (seen.dot(m) * (1 - u * u * (3 - 2 * u)));
      }
      normal += seen;
    }
    // Along the way to the end, and the hinge as near to the normal as can be.
    const Eigen::Matrix3d rest = triad(reach, limb.hinge);
    world[limb.start] = way.norm() < kNothing ? Quaternion::Identity() : Quaternion(Eigen::Matrix3d(triad(way, normal) * rest.transpose())).normalized();
    world[limb.middle] = world[limb.start] * open;
    place[limb.middle] = place[limb.start] + world[limb.start] * limb.upper;
    place[limb.end] = place[limb.middle] + world[limb.middle] * limb.lower;
  }
};

PositionFitter::PositionFitter(std::shared_ptr<const Skeleton> skeleton, std::vector<int> joints, const std::vector<Quaternion>& natural) : skeleton_(std::move(skeleton)), joints_(std::move(joints)) {
  auto body = std::make_shared<Body>();
  for (std::size_t part = 0; part < kParts; ++part) {
    body->joint[part] = skeleton_->find(kNames[part]);
    if (body->joint[part] < 0) refuse({{}, 0, "skeleton"}, fmt::format("no joint {}, expected the canonical body", kNames[part]));
    const int parent = skeleton_->parents[static_cast<std::size_t>(body->joint[part])];
    if (parent != (part == kPelvis ? -1 : body->joint[kParents[part]])) refuse({{}, 0, "skeleton"}, fmt::format("joint {} does not hang on {}, expected the canonical body", kNames[part], part == kPelvis ? "nothing" : kNames[kParents[part]]));
    const auto given = std::find(joints_.begin(), joints_.end(), body->joint[part]);
    body->column[part] = given == joints_.end() ? -1 : 3 * (given - joints_.begin());
    if (given == joints_.end() && !inferred(part)) refuse({{}, 0, std::string(kNames[part])}, "no positions, expected those of all joints but spine2 and the collars");
    body->offset[part] = skeleton_->rest_offsets[static_cast<std::size_t>(body->joint[part])];
  }
  if (skeleton_->joint_count() != static_cast<int>(kParts)) refuse({{}, 0, "skeleton"}, fmt::format("{} joints, expected the {} of the canonical body", skeleton_->joint_count(), std::size_t{kParts}));
  const auto& o = body->offset;
  body->pelvis = triad(o[kLeftHip] - o[kRightHip], o[kSpine1] - 0.5 * (o[kLeftHip] + o[kRightHip]));
  body->chest = triad(o[kNeck], o[kLeftCollar] + o[kLeftShoulder] - o[kRightCollar] - o[kRightShoulder]);
  body->legs = {{kLeftHip, kLeftKnee, kLeftAnkle, o[kLeftKnee], o[kLeftAnkle], Vector3::UnitY()}, {kRightHip, kRightKnee, kRightAnkle, o[kRightKnee], o[kRightAnkle], Vector3::UnitY()}};
  body->arms = {{kLeftShoulder, kLeftElbow, kLeftWrist, o[kLeftElbow], o[kLeftWrist], -Vector3::UnitZ()}, {kRightShoulder, kRightElbow, kRightWrist, o[kRightElbow], o[kRightWrist], Vector3::UnitZ()}};
  body->natural.fill(Quaternion::Identity());
  if (!natural.empty()) {
    if (natural.size() != kParts) refuse({{}, 0, "skeleton"}, fmt::format("{} natural rotations, expected {}", natural.size(), std::size_t{kParts}));
    const auto of = [&](std::size_t part) { return natural[static_cast<std::size_t>(body->joint[part])].normalized(); };
    for (const std::size_t end : {kHead, kLeftWrist, kRightWrist, kLeftFoot, kRightFoot}) body->natural[end] = of(end);
    for (const auto& [part, end] : {std::pair{kNeck, kHead}, {kLeftAnkle, kLeftFoot}, {kRightAnkle, kRightFoot}, {kLeftElbow, kLeftWrist}, {kRightElbow, kRightWrist}})
      if (o[end].norm() > kNothing) body->natural[part] = twist_about(of(part), o[end].normalized());
  }
  body_ = body;
}

PositionFit PositionFitter::operator()(const JointPositions& positions, double frame_rate_hz) const {
  const auto k = static_cast<Eigen::Index>(joints_.size());
  if (positions.cols() != 3 * k) refuse({}, fmt::format("{} numbers in a frame, expected {}: 3 for each of {} joints", positions.cols(), 3 * k, k));
  if (positions.rows() == 0) refuse({}, "0 frames, expected at least one");
  if (!(std::isfinite(frame_rate_hz) && frame_rate_hz > 0)) refuse({}, fmt::format("{} Hz, expected a rate above 0", frame_rate_hz));
  const auto frames = static_cast<std::size_t>(positions.rows());
  PositionFit fit;
  fit.frames = frames;
  fit.joints.resize(joints_.size());
  Clip& clip = fit.clip;
  clip.skeleton = skeleton_;
  clip.frame_rate_hz = frame_rate_hz;
  clip.rotations.resize(frames * kParts);
  clip.root_position.resize(frames);
  Places target, place;
  Turns world;
  for (std::size_t t = 0; t < frames; ++t) {
    const double* row = positions.row(static_cast<Eigen::Index>(t)).data();
    for (std::size_t part = 0; part < kParts; ++part) {
      if (body_->column[part] < 0) continue;
      target[part] = Vector3(row[body_->column[part]], row[body_->column[part] + 1], row[body_->column[part] + 2]);
      if (!target[part].allFinite()) refuse({{}, 0, std::string(kNames[part])}, fmt::format("frame {} has a position that is not finite", t));
    }
    body_->solve(target, place, world);
    clip.root_position[t] = place[kPelvis];
    for (std::size_t part = 0; part < kParts; ++part) {
      const auto joint = static_cast<std::size_t>(body_->joint[part]);
      clip.rotations[t * kParts + joint] = part == kPelvis ? world[part] : (world[kParents[part]].conjugate() * world[part]).normalized();
      if (body_->column[part] < 0) continue;
      JointFit& of = fit.joints[static_cast<std::size_t>(body_->column[part] / 3)];
      const double mm = 1000 * (place[part] - target[part]).norm();
      of.mean_mm += mm;
      if (mm > of.worst_mm) of.worst_mm = mm, of.worst_frame = t;
    }
  }
  for (JointFit& of : fit.joints) {
    of.mean_mm /= static_cast<double>(frames);
    fit.mean_mm += of.mean_mm / static_cast<double>(joints_.size());
  }
  make_sign_continuous(clip);
  return fit;
}

void MeanPose::add(const Clip& clip) {
  const auto joints = static_cast<std::size_t>(clip.joints());
  if (sum_.empty()) sum_.assign(joints, Eigen::Vector4d::Zero());
  if (sum_.size() != joints) throw Error(Exit::internal, {}, "a mean pose of clips with different skeletons");
  for (std::size_t t = 0; t < clip.frames(); ++t)
    for (std::size_t j = 1; j < joints; ++j) {
      const Eigen::Vector4d q = clip.frame(t)[j].coeffs();
      sum_[j] += sum_[j].dot(q) < 0 ? Eigen::Vector4d(-q) : q;
    }
}

std::vector<Quaternion> MeanPose::rotations() const {
  std::vector<Quaternion> mean(sum_.size(), Quaternion::Identity());
  for (std::size_t j = 1; j < sum_.size(); ++j)
    if (sum_[j].norm() > kNothing) mean[j].coeffs() = sum_[j].normalized();
  return mean;
}

}  // namespace mocap
