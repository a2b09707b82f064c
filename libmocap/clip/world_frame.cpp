#include "libmocap/clip/world_frame.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>

#include "libmocap/base/error.hpp"
#include "libmocap/skeleton/joint_map.hpp"
#include "libmocap/skeleton/rest_pose.hpp"

namespace mocap {
namespace {

constexpr double kTypicalLeg = 0.83;      // hip to ankle of an adult, metres
constexpr double kTypicalStature = 1.65;  // extent of a whole rest pose, metres

// The cyclic permutation that carries Y up to Z up.
Vector3 y_to_z(const Vector3& v) { return {v.z(), v.x(), v.y()}; }
Quaternion y_to_z(const Quaternion& q) { return {q.w(), q.z(), q.x(), q.y()}; }

double extent(const Clip& raw) {
  Pose pose;
  world_pose(raw, 0, pose);
  Vector3 low = pose.positions[0], high = low;
  for (const auto& p : pose.positions) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  return (high - low).maxCoeff();
}

constexpr Unit kCandidates[] = {Unit::metre, Unit::decimetre, Unit::centimetre, Unit::millimetre, Unit::inch, Unit::cmu};

Unit nearest_unit(double length, double typical, double& factor) {
  const auto away = [&](Unit u) { return std::abs(std::log(length * metres_per(u) / typical)); };
  const auto score = [&](Unit u) { return away(u) + (u == Unit::decimetre ? std::log(1.15) : 0); };
  const Unit best = *std::min_element(std::begin(kCandidates), std::end(kCandidates), [&](Unit a, Unit b) { return score(a) < score(b); });
  factor = std::exp(away(best));
  return best;
}

// Mean direction from the feet end to the head end over a few frames: pelvis to head, else feet to pelvis. And how low the body
// reaches along Y and Z in each of them.
struct Stance {
  Vector3 axis = Vector3::Zero();  // sum of unit vectors
  std::array<std::vector<double>, 2> lowest;
};
Stance stance_of(const Clip& raw, const JointMap& map) {
  const int head = map.source_of("head") >= 0 ? map.source_of("head") : map.source_of("neck");
  const int left = map.source_of("left_ankle"), right = map.source_of("right_ankle");
  Stance out;
  Pose pose;
  const std::size_t step = std::max<std::size_t>(1, raw.frames() / 32);
  for (std::size_t t = 0; t < raw.frames(); t += step) {
    world_pose(raw, t, pose);
    const auto at = [&](int j) { return pose.positions[static_cast<std::size_t>(j)]; };
    if (head >= 0 && left >= 0 && right >= 0)
      out.axis += (at(head) - (at(left) + at(right)) / 2).normalized();
    else if (head > 0)
      out.axis += (at(head) - at(0)).normalized();
    else if (left >= 0)
      out.axis += (at(0) - at(left)).normalized();
    std::array<double, 2> low{std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
    for (const int j : map.source)
      for (const int k : {0, 1})
        if (j >= 0) low[static_cast<std::size_t>(k)] = std::min(low[static_cast<std::size_t>(k)], at(j)[k + 1]);
    for (const std::size_t k : {0, 1})
      if (std::isfinite(low[k])) out.lowest[k].push_back(low[k]);
  }
  return out;
}

// Which of Y (0) and Z (1) is up, in points for each. A figure that stands in its rest pose and upright in its motion along the same axis
// leaves no doubt. Otherwise who lies, crawls or stands on his hands has to be told from a rig that rests along another axis than it moves:
// what bears a body stays at one height while the body travels, and most floors are at 0.
std::array<double, 2> up_points(const Clip& raw, const JointMap& map, double leg) {
  Stance stance = stance_of(raw, map);
  std::array<double, 2> points{};
  const double n = static_cast<double>(std::max<std::size_t>(1, stance.lowest[0].size()));
  const auto rest = rest_up(*raw.skeleton, map);
  for (const int k : {0, 1}) {
    const double upright = stance.axis[k + 1] / n;
    points[static_cast<std::size_t>(k)] = (upright > 0 ? upright : -0.3 * upright) + (rest && std::abs((*rest)[k + 1]) > 0.9 ? 0.6 : 0);
  }
  if (!(leg > 0) || stance.lowest[0].empty() || std::max(points[0], points[1]) > 1.1) return points;
  std::array<double, 2> spread{}, floor{};
  for (const std::size_t k : {0, 1}) {
    auto& low = stance.lowest[k];
    std::sort(low.begin(), low.end());
    floor[k] = low[low.size() / 20];
    spread[k] = (low[low.size() * 6 / 10] - floor[k]) / leg;  // the higher ones may be flight
  }
  for (const std::size_t k : {0, 1}) {
    if (spread[1 - k] > 0.3 && spread[k] < 0.4 * spread[1 - k]) points[k] += 0.8;
    if (std::abs(floor[k]) < 0.12 * leg && std::abs(floor[1 - k]) > 0.24 * leg) points[k] += 0.5;
  }
  return points;
}

}  // namespace

double metres_per(Unit unit) {
  switch (unit) {
    case Unit::metre: return 1;
    case Unit::decimetre: return 0.1;
    case Unit::centimetre: return 0.01;
    case Unit::millimetre: return 0.001;
    case Unit::inch: return 0.0254;
    case Unit::cmu: return 0.0254 / 0.45;
    case Unit::automatic: break;
  }
  throw Error(Exit::internal, {}, "metres_per: the unit was not decided");
}

std::string text(Unit unit) {
  switch (unit) {
    case Unit::automatic: return "auto";
    case Unit::metre: return "m";
    case Unit::decimetre: return "dm";
    case Unit::centimetre: return "cm";
    case Unit::millimetre: return "mm";
    case Unit::inch: return "in";
    case Unit::cmu: return "cmu";
  }
  return {};
}

std::string text(UpAxis up) { return up == UpAxis::automatic ? "auto" : up == UpAxis::y ? "y" : "z"; }

WorldFrame detect_world_frame(const Clip& raw, Unit unit, UpAxis up) {
  WorldFrame frame;
  frame.unit = unit;
  frame.up = up;
  const JointMap map = map_to_canonical(*raw.skeleton);
  const double leg = leg_length(*raw.skeleton, map);
  if (unit == Unit::automatic) {
    double factor = 1;
    const double size = leg > 0 ? leg : extent(raw);
    if (size > 0) {
      frame.unit = nearest_unit(size, leg > 0 ? kTypicalLeg : kTypicalStature, factor);
      if (factor > 1.7)
        frame.notes.push_back(fmt::format("{} of {:.4g} units fits no unit well (nearest: {}); force one with --unit", leg > 0 ? "legs" : "an extent", size, text(frame.unit)));
    } else {
      frame.unit = Unit::metre;
      frame.notes.push_back("a skeleton without extent: metres assumed");
    }
  }
  frame.leg_length_m = leg * metres_per(frame.unit);
  if (up == UpAxis::automatic) {
    const auto points = up_points(raw, map, leg);
    frame.up = points[1] > points[0] ? UpAxis::z : UpAxis::y;
    if (std::abs(points[0] - points[1]) < 0.2) frame.notes.push_back(fmt::format("the up axis is uncertain ({} assumed); force one with --up", text(frame.up)));
  }
  return frame;
}

void to_metres_z_up(Clip& clip, const WorldFrame& frame) {
  const double scale = metres_per(frame.unit);
  const bool turn = frame.up == UpAxis::y;
  if (scale == 1 && !turn) return;
  const auto convert = [&](Vector3& v) { v = (turn ? y_to_z(v) : v) * scale; };
  auto skeleton = std::make_shared<Skeleton>(*clip.skeleton);
  for (auto& v : skeleton->rest_offsets) convert(v);
  for (auto& e : skeleton->end_sites) convert(e.offset);
  clip.skeleton = skeleton;
  for (auto& v : clip.root_position) convert(v);
  for (auto& v : clip.translations) convert(v);
  if (turn)
    for (auto& q : clip.rotations) q = y_to_z(q);
}

std::size_t calibration_frames(const Clip& clip) {
  if (clip.frames() < 4) return 0;
  const auto j = static_cast<std::size_t>(clip.joints());
  const JointMap map = map_to_canonical(*clip.skeleton);
  // Of the body alone: fingers that never move would hide its jump.
  std::vector<std::size_t> body;
  for (const int k : map.source)
    if (k >= 0) body.push_back(static_cast<std::size_t>(k));
  if (body.empty())
    for (std::size_t k = 0; k < j; ++k) body.push_back(k);
  const auto step = [&](std::size_t t) {
    double sum = 0;
    for (const std::size_t k : body) sum += geodesic_distance(clip.rotations[t * j + k], clip.rotations[(t + 1) * j + k]);
    return sum / static_cast<double>(body.size());
  };
  Pose pose;
  const auto at_rest = [&](std::size_t t) {
    world_pose(clip, t, pose);
    const auto bone = [&](const char* a, const char* b) -> Vector3 {
      const int x = map.source_of(a), y = map.source_of(b);
      if (x < 0 || y < 0) return Vector3::Zero();
      return (pose.positions[static_cast<std::size_t>(y)] - pose.positions[static_cast<std::size_t>(x)]).normalized();
    };
    const Vector3 left = bone("left_shoulder", "left_wrist"), right = bone("right_shoulder", "right_wrist");
    const Vector3 leg = bone("left_hip", "left_ankle") + bone("right_hip", "right_ankle");
    return left.dot(right) < -0.85 && leg.norm() > 1.8 && std::abs(left.dot(leg.normalized())) < 0.3;
  };
  // The rest pose itself, whatever it looks like.
  const auto unturned = [&](std::size_t t) {
    for (std::size_t k = 1; k < j; ++k)
      if (geodesic_distance(clip.rotations[t * j + k], Quaternion::Identity()) > 1e-3) return false;
    return j > 1;
  };
  for (std::size_t n = 1; n <= 8 && n + 2 < clip.frames(); ++n) {
    const bool zero = unturned(n - 1);
    if (!zero && !at_rest(n - 1)) break;
    const double jump = step(n - 1);
    if (jump < (zero ? 0.03 : 0.1)) continue;
    std::vector<double> following;
    for (std::size_t t = n; t + 1 < clip.frames() && t < n + static_cast<std::size_t>(clip.frame_rate_hz); ++t) following.push_back(step(t));
    const auto middle = following.begin() + static_cast<std::ptrdiff_t>(following.size() / 2);
    std::nth_element(following.begin(), middle, following.end());
    if (jump > 8 * *middle) return n;
  }
  return 0;
}

void require_right_handed(const Clip& clip) {
  const JointMap map = map_to_canonical(*clip.skeleton);
  if (!map.missing().empty()) return;
  Pose pose;
  const auto at = [&](const std::string& name) { return pose.positions[static_cast<std::size_t>(map.source_of(name))]; };
  double toes = 0, knees = 0;
  std::size_t seen = 0, stood = 0;  // frames, and legs in them that stood
  const std::size_t step = std::max<std::size_t>(1, clip.frames() / 128);
  const bool has_toes = map.source_of("left_foot") >= 0 && map.source_of("right_foot") >= 0;
  for (std::size_t t = 0; t < clip.frames(); t += step) {
    world_pose(clip, t, pose);
    const Vector3 across = at("left_hip") - at("right_hip") + at("left_shoulder") - at("right_shoulder");
    const Vector3 trunk = at("left_shoulder") + at("right_shoulder") - at("left_hip") - at("right_hip");
    if (across.norm() < 1e-6 || trunk.norm() < 1e-6) continue;
    const Vector3 forward = across.normalized().cross(trunk.normalized());
    ++seen;
    for (const char* side : {"left_", "right_"}) {
      const std::string p = side;
      const Vector3 thigh = (at(p + "knee") - at(p + "hip")).normalized(), shank = (at(p + "ankle") - at(p + "knee")).normalized();
      knees += thigh.cross(shank).dot(across.normalized()) / 2;  // sine of the bend; positive: the heel rises behind
      // Bent double, toes point where the chest does not: only a leg in line with the trunk tells.
      if (!has_toes || thigh.dot(trunk.normalized()) > -0.5) continue;
      // Across the shank, so that a leg swung back does not count.
      Vector3 toe = at(p + "foot") - at(p + "ankle"), ahead = forward;
      toe -= toe.dot(shank) * shank;
      ahead -= ahead.dot(shank) * shank;
      if (toe.norm() > 1e-6 && ahead.norm() > 1e-6) toes += toe.normalized().dot(ahead.normalized()), ++stood;
    }
  }
  if (seen == 0) return;
  knees /= static_cast<double>(seen);
  const bool by_toes = 5 * stood > seen;  // a tenth of the legs seen
  if (by_toes) toes /= static_cast<double>(stood);
  if (by_toes ? toes < -0.3 && knees < 0.05 : knees < -0.1)
    refuse({{}, 0, "clip " + clip.name},
           fmt::format("left and right are exchanged, or the axes are left-handed: with the left side at the left {}the knees bend {}, expected a right-handed file",
                       by_toes ? "the toes point backwards and " : "", knees < 0 ? "forwards" : "hardly"),
           "a reflection is no rotation; export the file again with right-handed axes");
}

std::optional<double> facing_yaw(const Skeleton& skeleton, const Pose& pose) {
  Vector3 across = Vector3::Zero();
  for (const char* part : {"hip", "shoulder"}) {
    const int l = skeleton.find_role(std::string("left_") + part), r = skeleton.find_role(std::string("right_") + part);
    if (l >= 0 && r >= 0) across += pose.positions[static_cast<std::size_t>(l)] - pose.positions[static_cast<std::size_t>(r)];
  }
  across.z() = 0;
  if (across.norm() < 0.05) return std::nullopt;  // lying on a side, or no such joints
  // across points left; forward = across x up.
  return std::atan2(-across.x(), across.y());
}

void face_forward(Clip& clip) {
  if (clip.frames() == 0) return;
  Pose pose;
  std::optional<double> yaw;
  for (std::size_t t = 0; t < clip.frames() && !yaw; ++t) {
    world_pose(clip, t, pose);
    yaw = facing_yaw(*clip.skeleton, pose);
  }
  const double heading = yaw.value_or(yaw_of(clip.rotations[0]));
  const Quaternion turn = yaw_rotation(-heading);
  Vector3 origin = clip.root_position[0];
  origin.z() = 0;
  for (auto& p : clip.path) p = (turn * Vector3(p.x() - origin.x(), p.y() - origin.y(), 0)).head<2>();
  // The source's frame is given before mirroring, which swaps the sides: y and the sense of turning.
  const double side = clip.source.mirrored ? -1 : 1;
  clip.source.origin += yaw_rotation(clip.source.yaw) * Vector3(origin.x(), side * origin.y(), 0);
  clip.source.yaw = wrap_angle(clip.source.yaw + side * heading);
  const auto j = static_cast<std::size_t>(clip.joints());
  for (std::size_t t = 0; t < clip.frames(); ++t) {
    clip.root_position[t] = turn * (clip.root_position[t] - origin);
    clip.rotations[t * j] = turn * clip.rotations[t * j];
  }
}

}  // namespace mocap
