// A user's own table of which joint is which (`--joint-map FILE`), in TOML.
#pragma once
#include <map>
#include <string>

namespace mocap::formats {

// canonical joint name -> joint name of the rig, "" for none. The file:
//     [joints]
//     left_hip = "Bone.012"
//     left_foot = ""            # this rig has no toes, whatever its names say
// Joints that it does not name are found by name as without it. Error(data) with the line: no TOML, no table [joints], a key that is no joint of
// the canonical body, a value that is no text, a joint given twice.
struct JointMapFile {
  std::map<std::string, std::string> joints;
  std::string sha256;  // of the file's bytes
};
JointMapFile read_joint_map(const std::string& path);

}  // namespace mocap::formats
