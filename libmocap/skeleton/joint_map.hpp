// Which joint of somebody's skeleton plays which part of the canonical body.
#pragma once
#include <array>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "libmocap/skeleton/skeleton.hpp"

namespace mocap {

// source[c] is the joint of the source skeleton that stands for canonical joint c, or -1.
struct JointMap {
  std::array<int, 22> source;
  std::string family;  // convention the rig follows ("cmu", "mixamo", ...), "roles", or "unknown"

  int source_of(std::string_view canonical_name) const;
  // Joints retargeting cannot do without: pelvis, hips, knees, ankles, shoulders, elbows. Canonical names of those absent.
  std::vector<std::string> missing() const;
};

// By the skeleton's roles where it has them all (they come from a map already made), otherwise by names: sides and words in any
// spelling (joint_names.hpp), each limb down its own branch, so that fewer or more joints in spine, neck, clavicle, arms, legs
// and toes do not matter. The pelvis is where the legs meet, the spine runs from there to the neck and is matched by the share
// of its length. Known by name: CMU (BVH and ASF), SMPL, Mixamo, HumanIK, Rokoko, LaFAN1, SFU, Bandai-Namco, MakeHuman,
// Biovision, Xsens, Motive, Poser/DAZ, 3ds Max Biped, Unreal, Kinect, Blender, and what is spelt like any of them.
JointMap map_to_canonical(const Skeleton& skeleton);

// The same with some joints named by hand: canonical name -> joint name, "" for none; the others are looked for around them (a toe below
// the ankle that was named). Error(data) where either does not exist.
JointMap map_to_canonical(const Skeleton& skeleton, const std::map<std::string, std::string>& by_hand);

// role -> joint name for every joint that is mapped: the canonical names, but `root` for pelvis, `left_hand` for left_wrist and
// `right_hand` for right_wrist (motion-archive.md). A rig without toe joints has its ankles as `left_foot` and `right_foot`.
std::map<std::string, std::string> roles_of(const Skeleton& skeleton, const JointMap& map);

// "no joint found for left_knee, ...; not placed: Bone12, ...", for an Error about map.missing().
std::string describe_missing(const Skeleton& skeleton, const JointMap& map);

}  // namespace mocap
