// Motion of any mapped skeleton onto the canonical body.
//
// With R_s(t) the world rotation of the source joint that stands for canonical joint c, and T_s its orientation when the
// source stands in T-pose (joint_map.hpp), the canonical joint gets
//     R_c(t) = R_s(t) T_s^-1 M_c,
// where M_c turns the canonical rest bone onto the source's own bone direction in T-pose: the shortest rotation from the
// parent's, M_c = M_p between(d_c, M_p^-1 d_s). Bone directions then agree, and twist is the source's. Pelvis and head
// stand upright in T-pose (M = identity); feet are flat in T-pose (M_c turns about the vertical only).
// Joints without a source keep their parent's rotation.
//
// Travel: the midpoint of the hips follows the source's, scaled by the ratio of leg lengths, so that steps fit the legs.
#pragma once
#include <memory>

#include "libmocap/clip/clip.hpp"
#include "libmocap/skeleton/joint_map.hpp"

namespace mocap {

class Retargeter {
 public:
  // `source` in metres, Z up. Throws Error(data) listing the joints that could not be placed, or where the rest pose is
  // no T-pose and the family is unknown.
  explicit Retargeter(std::shared_ptr<const Skeleton> source);

  // The clip on canonical_body(), same rate and metadata, without translations and contacts. Heights are the source's
  // scaled; set_on_ground() comes next. Cost O(J) a frame.
  Clip apply(const Clip& clip) const;

  const JointMap& map() const { return map_; }
  double scale() const { return scale_; }

 private:
  std::shared_ptr<const Skeleton> source_;
  JointMap map_;
  std::vector<Quaternion> alignment_;  // [22] T_s^-1 M_c
  double scale_ = 1;
};

}  // namespace mocap
