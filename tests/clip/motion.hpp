// Motion made by hand for tests: somebody walks, on any body with the canonical joints and rest pose but bones of any length.
#pragma once
#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "libmocap/base/random.hpp"
#include "libmocap/clip/clip.hpp"
#include "libmocap/skeleton/canonical_body.hpp"

namespace mocap::test {

inline std::size_t joint(const Skeleton& s, const std::string& name) {
  const int j = s.find(name);
  if (j < 0) throw std::runtime_error("no joint " + name);
  return static_cast<std::size_t>(j);
}

// The canonical body with other legs: factors on thigh, shank and foot bones. The soles stay where flat feet have them.
struct Legs {
  double thigh = 1, shank = 1, foot = 1, ankle_height = kAnkleSoleHeight;
  double right_thigh = 1;  // on top, of the right leg alone
};
inline std::shared_ptr<Skeleton> body_with(const Legs& legs, double size = 1) {
  auto s = std::make_shared<Skeleton>(*canonical_body());
  for (auto& v : s->rest_offsets) v *= size;
  for (const std::string p : {"left_", "right_"}) {
    s->rest_offsets[joint(*s, p + "knee")] *= legs.thigh * (p == "right_" ? legs.right_thigh : 1);
    s->rest_offsets[joint(*s, p + "ankle")] *= legs.shank;
    Vector3& foot = s->rest_offsets[joint(*s, p + "foot")];
    foot = size * Vector3(canonical_body()->rest_offsets[joint(*s, p + "foot")].x() * legs.foot, 0, -(legs.ankle_height - kFootSoleHeight));
  }
  for (auto& e : s->end_sites) e.offset *= size;
  return s;
}

struct Walk {
  double seconds = 4, rate_hz = 120, yaw = 0, speed = 0.75, period = 1.1;
  double heel_rise = 45 * std::numbers::pi / 180;
};

// What the feet do, for those who check: flat on the ground, or on the toes with the heel rising.
struct Walked {
  Clip clip;
  std::vector<std::array<char, 2>> flat, on_toes;
};

// Each foot strikes with the heel, stands flat, rises over its toe base, and swings. Planted points are planted to rounding.
inline Walked walk(const std::shared_ptr<const Skeleton>& body, const Walk& options = {}) {
  const Skeleton& s = *body;
  const auto n = static_cast<std::size_t>(s.joint_count());
  const auto offset = [&](const std::string& name) { return s.rest_offsets[joint(s, name)]; };
  const double size = (offset("left_knee").norm() + offset("left_ankle").norm()) / (0.491 * 1.70);
  const double speed = options.speed * size, P = options.period, stance = 0.62, sole = kFootSoleHeight * size;
  const Vector3 x = Vector3::UnitX(), y = Vector3::UnitY(), z = Vector3::UnitZ();
  const auto about = [](double angle, const Vector3& axis) { return Quaternion(Eigen::AngleAxisd(angle, axis)); };
  const auto smooth = [](double u) { return u * u * (3 - 2 * u); };
  double shortest = 1e9;
  for (const std::string p : {"left_", "right_"}) shortest = std::min(shortest, offset(p + "knee").norm() + offset(p + "ankle").norm());
  Walked out;
  Clip& clip = out.clip;
  clip.name = "walk";
  clip.skeleton = body;
  clip.frame_rate_hz = options.rate_hz;
  const auto frames = static_cast<std::size_t>(std::lround(options.seconds * options.rate_hz)) + 1;
  std::vector<Quaternion> world(n);
  for (std::size_t f = 0; f < frames; ++f) {
    const double t = static_cast<double>(f) / options.rate_hz, phase = 2 * std::numbers::pi * t / P;
    std::vector<Quaternion> local(n, Quaternion::Identity());
    const Quaternion pelvis = about(0.07 * std::sin(phase), z);
    const auto set = [&](const std::string& name, const Quaternion& q) { local[joint(s, name)] = q; };
    set("pelvis", pelvis);
    set("spine1", about(-0.06 * std::sin(phase), z));
    set("spine2", about(-0.06 * std::sin(phase), z) * about(0.05 * std::sin(2 * phase), y));
    set("spine3", about(0.04 * std::sin(phase), x));
    set("neck", about(0.04 + 0.03 * std::sin(2 * phase), y));
    set("head", about(-0.04 - 0.03 * std::sin(2 * phase), y));
    const double ankle_sole = sole - offset("left_foot").z();
    const Vector3 root(speed * t, 0, ankle_sole + 0.93 * shortest - offset("left_hip").z());
    std::array<char, 2> flat{}, on_toes{};
    for (const std::size_t k : {0, 1}) {
      const std::string p = k == 0 ? "left_" : "right_";
      const double side = k == 0 ? 1 : -1;
      set(p + "collar", about(0.03 * std::sin(phase), z));
      set(p + "shoulder", about(side * 0.35 * std::sin(phase), y) * about(-side * 1.3, x));
      set(p + "elbow", about(-side * (0.6 + 0.3 * std::sin(phase)), z));
      set(p + "wrist", about(0.1 * std::sin(phase), x));
      // The foot.
      const double cycle = t / P + (k == 0 ? 0.0 : 0.5) + 0.2, turn = std::floor(cycle), u = cycle - turn;
      const Vector3 foot = offset(p + "foot");
      const auto planted = [&](double c) { return Vector3(speed * P * (c - (k == 0 ? 0.0 : 0.5) - 0.2 + stance / 2), offset(p + "hip").y(), sole - foot.z()); };
      const auto posed = [&](double c, double v, double& pitch) -> Vector3 {  // ankle at share v of the stance of cycle c
        const Vector3 at = planted(c);
        if (v < 0.12) {
          pitch = -0.3 * (1 - smooth(v / 0.12));
          return at + about(pitch, y) * Vector3(0, 0, at.z()) - Vector3(0, 0, at.z());
        }
        pitch = v < 0.65 ? 0 : options.heel_rise * smooth((v - 0.65) / 0.35);
        return at + foot - about(pitch, y) * foot;
      };
      double pitch = 0;
      Vector3 ankle;
      if (u < stance) {
        ankle = posed(turn, u / stance, pitch);
        flat[k] = u / stance > 0.12 && u / stance < 0.65;
        on_toes[k] = u / stance > 0.12;
      } else {
        const double v = (u - stance) / (1 - stance), w = smooth(v);
        double from = 0, to = 0;
        const Vector3 a = posed(turn, 1, from), b = posed(turn + 1, 0, to);
        pitch = from + w * (to - from);
        ankle = a + w * (b - a) + Vector3(0, 0, 0.09 * size * std::sin(std::numbers::pi * v) * std::sin(std::numbers::pi * v));
      }
      // Two bones to the ankle, the knee about the pelvis' own left.
      const double thigh = offset(p + "knee").norm(), shank = offset(p + "ankle").norm();
      const Vector3 d = ankle - root - pelvis * offset(p + "hip");
      const double length = std::min(d.norm(), 0.9999 * (thigh + shank));
      Vector3 axis = pelvis * y;
      axis = (axis - axis.dot(d.normalized()) * d.normalized()).normalized();
      const double alpha = std::acos((thigh * thigh + length * length - shank * shank) / (2 * thigh * length));
      const double bend = std::numbers::pi - std::acos((thigh * thigh + shank * shank - length * length) / (2 * thigh * shank));
      const Vector3 down = about(-alpha, axis) * d.normalized();
      RotationMatrix m;
      m.col(1) = axis, m.col(2) = -down, m.col(0) = m.col(1).cross(m.col(2));
      const Quaternion hip(m), knee = hip * about(bend, y);
      set(p + "hip", pelvis.conjugate() * hip);
      set(p + "knee", about(bend, y));
      set(p + "ankle", knee.conjugate() * about(pitch, y));
      set(p + "foot", about(-std::max(0.0, pitch), y));
    }
    local[0] = yaw_rotation(options.yaw) * local[0];
    clip.rotations.insert(clip.rotations.end(), local.begin(), local.end());
    clip.root_position.push_back(yaw_rotation(options.yaw) * root + Vector3(0.4, -0.3, 0));
    out.flat.push_back(flat);
    out.on_toes.push_back(on_toes);
  }
  make_sign_continuous(clip);
  return out;
}

// The same motion on a rig whose joint frames are turned, R_s = R_c turn[c]: its zero rotation is no pose of a body.
inline Clip with_turned_frames(const Clip& clip, const std::vector<Quaternion>& turn) {
  Clip out = clip;
  auto s = std::make_shared<Skeleton>(*clip.skeleton);
  const std::size_t n = s->parents.size();
  const auto parent = [&](std::size_t j) { return static_cast<std::size_t>(s->parents[j]); };
  for (std::size_t j = 1; j < n; ++j) s->rest_offsets[j] = turn[parent(j)].conjugate() * s->rest_offsets[j];
  for (auto& e : s->end_sites) e.offset = turn[static_cast<std::size_t>(e.parent)].conjugate() * e.offset;
  for (std::size_t t = 0; t < clip.frames(); ++t)
    for (std::size_t j = 0; j < n; ++j) out.rotations[t * n + j] = (j == 0 ? clip.rotations[t * n] : turn[parent(j)].conjugate() * clip.rotations[t * n + j]) * turn[j];
  for (std::size_t j = 1; j < n && !out.translations.empty(); ++j)
    for (std::size_t t = 0; t < clip.frames(); ++t) out.translations[t * n + j] = turn[parent(j)].conjugate() * clip.translations[t * n + j];
  out.skeleton = s;
  make_sign_continuous(out);
  return out;
}

inline std::vector<Quaternion> random_turns(std::uint64_t seed, std::size_t n) {
  Random random(seed, 0);
  std::vector<Quaternion> turn;
  for (std::size_t j = 0; j < n; ++j) turn.push_back(Quaternion(random.normal(), random.normal(), random.normal(), random.normal()).normalized());
  return turn;
}

inline std::vector<Pose> poses_of(const Clip& clip) {
  std::vector<Pose> poses(clip.frames());
  for (std::size_t t = 0; t < clip.frames(); ++t) world_pose(clip, t, poses[t]);
  return poses;
}

}  // namespace mocap::test
