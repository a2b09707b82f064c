#include "libmocap/clip/source_body.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "libmocap/base/error.hpp"
#include "libmocap/skeleton/rest_pose.hpp"

namespace mocap {
namespace {

constexpr double kStill = 1e-3;       // metres: joints that move less are not worth a word
constexpr double kShortBone = 0.01;   // metres: its direction says nothing
constexpr double kSameDirection = 0.94;

// Whether joint 0 is a mere carrier: one child, which is not a part of the body's own chain.
bool carries_only(const Skeleton& s) {
  const int pelvis = s.find_role("root");
  return s.joint_count() > 1 && pelvis > 0 && std::count(s.parents.begin(), s.parents.end(), 0) == 1 &&
         std::none_of(s.end_sites.begin(), s.end_sites.end(), [](const auto& e) { return e.parent == 0; });
}

}  // namespace

Clip without_translations(const Clip& clip, std::vector<std::string>& notes) {
  Clip out = clip;
  const Skeleton& s = *clip.skeleton;
  const auto joints = static_cast<std::size_t>(s.joint_count());
  const bool moves = !clip.translations.empty(), carrier = carries_only(s);
  if (!moves && !carrier) return out;
  auto skeleton = std::make_shared<Skeleton>(s);
  for (std::size_t j = 1; moves && j < joints; ++j) {
    if (j == 1 && carrier) {
      skeleton->rest_offsets[j] = Vector3(0, 0, s.rest_offsets[j].z());  // straight below: writers put the first frame's place there
      continue;
    }
    Vector3 low = clip.translations[j], high = low;
    for (std::size_t t = 0; t < clip.frames(); ++t) {
      low = low.cwiseMin(clip.translations[t * joints + j]);
      high = high.cwiseMax(clip.translations[t * joints + j]);
    }
    skeleton->rest_offsets[j] = low + (high - low) / 2;
    if ((high - low).norm() > kStill)
      notes.push_back(fmt::format("joint {} moves by {:.3g} m against its parent, which an archive cannot hold: it stays in the middle", s.joint_names[j], (high - low).norm()));
  }
  out.translations.clear();
  if (carrier) {
    const auto t_pose = t_pose_orientations(s, map_to_canonical(s));
    for (std::size_t t = 0; t < clip.frames(); ++t) {
      const Quaternion root = clip.rotations[t * joints], body = root * clip.rotations[t * joints + 1];
      const Vector3 place = clip.root_position[t] + root * (moves ? clip.translations[t * joints + 1] : s.rest_offsets[1]);
      const Quaternion heading = t_pose ? yaw_rotation(yaw_of(body * (*t_pose)[1].conjugate())) : root;
      out.rotations[t * joints] = heading;
      out.rotations[t * joints + 1] = heading.conjugate() * body;
      out.root_position[t] = place - heading * skeleton->rest_offsets[1];
    }
    make_sign_continuous(out);
  }
  out.skeleton = std::move(skeleton);
  return out;
}

Clip on_body(const Clip& clip, const std::shared_ptr<const Skeleton>& body, std::vector<std::string>& notes) {
  const Skeleton &theirs = *clip.skeleton, &ours = *body;
  const auto differs = [&](const std::string& what) { refuse({{}, 0, "skeleton"}, what, "--body source keeps one rig for all inputs; --body canonical takes any"); };
  if (theirs.joint_count() != ours.joint_count()) differs(fmt::format("{} joints, expected the {} of the first input", theirs.joint_count(), ours.joint_count()));
  const bool carried = carries_only(ours);
  double most = 0;
  for (std::size_t j = 0; j < ours.parents.size(); ++j) {
    if (theirs.joint_names[j] != ours.joint_names[j]) differs(fmt::format("joint {} is '{}', expected '{}' as in the first input", j, theirs.joint_names[j], ours.joint_names[j]));
    if (theirs.parents[j] != ours.parents[j]) differs(fmt::format("joint {} hangs on another parent than in the first input", theirs.joint_names[j]));
    if (j == 0 || (j == 1 && carried)) continue;
    const Vector3 &a = theirs.rest_offsets[j], &b = ours.rest_offsets[j];
    if (std::min(a.norm(), b.norm()) > kShortBone && a.normalized().dot(b.normalized()) < kSameDirection)
      differs(fmt::format("joint {} lies in another direction at rest than in the first input", theirs.joint_names[j]));
    most = std::max(most, std::abs(a.norm() - b.norm()));
  }
  Clip out = clip;
  out.skeleton = body;
  const auto joints = static_cast<std::size_t>(ours.joint_count());
  if (carried)  // where the carrier stands is no part of the motion: the body stays where it is
    for (std::size_t t = 0; t < out.frames(); ++t) out.root_position[t] += out.rotations[t * joints] * (theirs.rest_offsets[1] - ours.rest_offsets[1]);
  if (most <= 1e-4) return out;
  const double from = leg_length(theirs, map_to_canonical(theirs)), to = leg_length(ours, map_to_canonical(ours));
  const double scale = from > 0 && to > 0 ? to / from : 1;
  notes.push_back(fmt::format("bones differ from the first input's by up to {:.3g} m: its bones are used, travel scaled by {:.4g}", most, scale));
  for (auto& p : out.root_position) p *= scale;
  out.source.scale *= scale;
  out.source.origin *= scale;
  return out;
}

}  // namespace mocap
