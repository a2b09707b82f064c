// What a joint's name says: a side and words, whatever the writer's spelling.
#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "libmocap/skeleton/skeleton.hpp"

namespace mocap {

enum class Side { none, left, right };

// "mixamorig:LeftUpLeg", "thigh.L", "Bip01 L Thigh", "lfemur", "upperleg01.L", "L_Hip", "LUArm". Words are lower case,
// in one spelling each ("toes" is "toe", "upper" is "up"), sorted, without the side, numbers and words that say nothing ("C_Neck", "lThighBend").
struct JointName {
  Side side = Side::none;
  std::vector<std::string> words;
  std::string numbers;  // "01", "5-1"
  bool helper = false;  // "__UpLeg_L": stands in for a link, not for the joint
};

// Of one name alone, without a namespace ("rig:", "rig|").
JointName parse_joint_name(std::string_view name);

// Of every joint; first words that most joints share ("Character1", "CC_Base") are left out, unless they name a side or part alone. [J]
std::vector<JointName> joint_names_of(const Skeleton& skeleton);

}  // namespace mocap
