// Where the viewer stands.
#pragma once
#include <string>

#include "libmocap/clip/clip.hpp"

namespace mocap::draw {

enum class View { side, front, top, oblique };

View parse_view(const std::string& text);  // Error(usage) for an unknown name
std::string text(View view);

// An orthographic camera: right and up of the picture and the direction towards the viewer, orthonormal, in the world.
struct Camera {
  Vector3 right, up, toward;

  Vector2 project(const Vector3& p) const { return {right.dot(p), up.dot(p)}; }  // metres, y up
  double nearness(const Vector3& p) const { return toward.dot(p); }
};

// forward: ground direction the figure faces, unit, horizontal. side: the figure faces the picture's right and turns its
// right side to the viewer; front: it faces the viewer; top: seen from above, facing right; oblique: from its right
// front, 20 degrees from above.
Camera camera_for(View view, const Vector3& forward);

// Mean facing of the clip (hips and shoulders), on the ground. Where that is undefined or turns all round: the facing of
// the first frame that has one, otherwise the way from the first to the last frame, otherwise +X.
Vector3 mean_facing(const Clip& clip);

}  // namespace mocap::draw
