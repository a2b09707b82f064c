// Everything readable, probed by content: the one place that sees text formats, npz and archives.
#pragma once
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "libmocap/base/history.hpp"
#include "libmocap/clip/clip.hpp"
#include "libmocap/clip/world_frame.hpp"

namespace mocap::formats {

struct ReadOptions {
  Unit unit = Unit::automatic;
  UpAxis up = UpAxis::automatic;
  FirstFrame first_frame = FirstFrame::automatic;
  bool lenient = false;
  std::map<std::string, std::string> joints;  // canonical name -> joint, by hand (joint_map_file.hpp)
};

// One opened file: one clip (BVH, npz) or many (archive). Clips come out in metres, Z up, local rotations unit and
// sign-continuous, named after the file's stem (archives: their own names), with source path, digest and rate filled, and the roles of
// their skeletons from the joint map.
class MotionInput {
 public:
  virtual ~MotionInput() = default;
  virtual std::string format() const = 0;  // "bvh", "npz (source)", "npz (SMPL+H)", "archive"
  virtual std::size_t size() const = 0;
  virtual Clip read(std::size_t i) const = 0;
  // Of clip i; archives answer from their index, without reading frames.
  virtual std::string name(std::size_t i) const { return read(i).name; }
  virtual Attributes attributes(std::size_t i) const { return read(i).attributes; }
  virtual const History& history() const = 0;              // what the file itself carries
  virtual const std::vector<std::string>& notes() const = 0;  // what was detected or repaired, one line each
  virtual std::string sha256() const = 0;                  // of the file's bytes
  virtual std::string contacts_rule() const { return {}; }  // archives: theirs
};

// Opens `path` ("-": standard input); `label` is what provenance calls it. Error(data) with the file named.
std::unique_ptr<MotionInput> open_motion(const std::string& path, const std::string& label, const ReadOptions& options = {});

// Whether a file's first bytes look like something open_motion reads: how folders are searched.
bool looks_like_motion(const std::string& path);

}  // namespace mocap::formats
