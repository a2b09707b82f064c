#include "libmocap/draw/camera.hpp"

#include <cmath>
#include <numbers>

#include "libmocap/base/error.hpp"
#include "libmocap/clip/world_frame.hpp"
#include "libmocap/draw/sides.hpp"

namespace mocap::draw {

View parse_view(const std::string& name) {
  for (const View v : {View::side, View::front, View::top, View::oblique})
    if (text(v) == name) return v;
  refuse_usage("view '" + name + "', expected side, front, top or oblique");
}

std::string text(View view) {
  switch (view) {
    case View::side: return "side";
    case View::front: return "front";
    case View::top: return "top";
    case View::oblique: return "oblique";
  }
  throw Error(Exit::internal, {}, "an unknown view");
}

Camera camera_for(View view, const Vector3& forward) {
  const Vector3 up = Vector3::UnitZ(), left = up.cross(forward);
  Camera c;
  if (view == View::top) return {forward, left, up};
  constexpr double kDegree = std::numbers::pi / 180;
  // Angle from the figure's right side towards its front, and above the horizon.
  const double turned = view == View::front ? 90 * kDegree : view == View::oblique ? 40 * kDegree : 0;
  const double raised = view == View::oblique ? 20 * kDegree : 0;
  const Vector3 level = std::cos(turned) * -left + std::sin(turned) * forward;
  c.toward = std::cos(raised) * level + std::sin(raised) * up;
  c.right = up.cross(level);
  c.up = c.toward.cross(c.right);
  return c;
}

Vector3 mean_facing(const Clip& clip) {
  const Anatomy anatomy = anatomy_of(*clip.skeleton);
  const std::size_t n = clip.frames(), looked = std::min<std::size_t>(n, 200);
  Vector3 sum = Vector3::Zero(), first = Vector3::Zero();
  int defined = 0;
  Pose pose;
  for (std::size_t k = 0; k < looked; ++k) {
    world_pose(clip, k * n / looked, pose);
    const auto yaw = facing_yaw(anatomy.with_roles, pose);
    if (!yaw) continue;
    const Vector3 direction(std::cos(*yaw), std::sin(*yaw), 0);
    if (defined++ == 0) first = direction;
    sum += direction;
  }
  if (defined > 0) return sum.norm() > 0.3 * defined ? Vector3(sum.normalized()) : first;
  Vector3 way = n > 0 ? Vector3(clip.root_position.back() - clip.root_position.front()) : Vector3(Vector3::Zero());
  way.z() = 0;
  return way.norm() > 0.2 ? Vector3(way.normalized()) : Vector3(Vector3::UnitX());
}

}  // namespace mocap::draw
