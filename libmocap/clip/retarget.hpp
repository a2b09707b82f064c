// Motion of any mapped skeleton onto the canonical body.
//
// Rotations. With R_s(t) the world rotation of the source joint s that stands for canonical joint c, the canonical joint gets
//     R_c(t) = R_s(t) A_c.
// Where the rig has a usable rest pose, A_c = T_s^-1 M_c: T_s is the joint's orientation in T-pose (skeleton/rest_pose.hpp) and M_c
// turns the canonical rest bone onto the source's own bone direction there, the shortest rotation from the parent's, M_c = M_p
// between(d_c, M_p^-1 d_s). Where it has none, A_c comes from joint positions (clip/pose_alignment.hpp). Either way bone directions
// agree and twist is the source's. Pelvis and head stand upright in T-pose (M = identity); feet are flat in T-pose (M_c turns about
// the vertical only) unless the toes hang (foot_hangs()). Joints without a source keep their parent's rotation. Where a rig has joints between two that are mapped (a second
// neck joint, a divided thigh), R_c(t) is turned on by the shortest rotation to where the next mapped joint really is.
//
// Travel. The midpoint of the hips follows the source's, scaled by the ratio s of leg lengths, so that steps fit the legs.
//
// Feet. Legs of other proportions would carry the feet elsewhere, and feet that stand would slide. So the ankle is brought to
//     a(t) = s p_ankle(t) + (s l - L) z + w c(t),    c = [v_s - v_c](t) - Y(t) [v_s - v_c](T-pose),
// by bending the knee about its own axis and turning the whole leg (foot orientation kept). l and L are the lengths of this leg, so
// that legs of unequal length do not change how far a knee is bent; v_s and v_c lead from ankle to toe base on the scaled source and on
// the canonical foot, Y is the foot's heading, and w rises from 0 to 1 as the foot comes down from 15 to 5 degrees on its heel: on the
// heel the ankle moves as the source's does, flat (c = 0) and on the toes the toe base does. With the heel lifted from 45 to 75 degrees w
// falls to 0 again: the foot swings. Reach is limited softly over the last 0.5 % of the leg, unless the source's own knee is as straight.
#pragma once
#include <memory>

#include "libmocap/clip/clip.hpp"
#include "libmocap/skeleton/joint_map.hpp"

namespace mocap {

class Retargeter {
 public:
  // `source` in metres, Z up. From its rest pose; Error(data) listing the joints that could not be placed, or where the rest pose
  // does not stand (rest_pose_stands() tells before).
  explicit Retargeter(std::shared_ptr<const Skeleton> source);
  // From joint positions over the motion, whatever the rest pose. Error(data) listing the joints that could not be placed.
  Retargeter(std::shared_ptr<const Skeleton> source, const Clip& motion);
  static bool rest_pose_stands(const Skeleton& source);

  // The clip on canonical_body(), same rate and metadata, without translations and contacts; source.scale is set. Heights are the
  // source's scaled; set_on_ground() comes next. Cost O(J) a frame.
  Clip apply(const Clip& clip) const;

  const JointMap& map() const { return map_; }
  double scale() const { return scale_; }

 private:
  struct Bone {  // from joint to child: canonical direction at rest, and the source joints at its ends
    std::size_t joint, from, to;
    Vector3 direction;
  };
  struct Leg {  // canonical joints, and what ties the foot to the source's
    std::size_t hip, knee, ankle, foot;
    std::size_t source_ankle;
    int source_toe = -1;
    double thigh = 0, shank = 0;         // canonical lengths
    double lift = 0;                     // s l - L
    Vector3 foot_offset;                 // canonical ankle to toe base, in the ankle's frame
    Vector3 toe_difference;              // [v_s - v_c] in T-pose
  };

  void require_joints() const;
  void find_bones();
  void align_from_rest(const std::vector<Quaternion>& t_pose);
  void measure_legs();
  Vector3 ankle_target(const Leg& leg, const Pose& source, const Quaternion& foot) const;

  std::shared_ptr<const Skeleton> source_;
  JointMap map_;
  std::vector<Quaternion> alignment_;  // [22] A_c
  std::vector<Bone> bones_;
  std::array<Leg, 2> legs_;
  double scale_ = 1;
};

}  // namespace mocap
