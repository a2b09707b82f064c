// Everything readable, probed by content: the one place that sees text formats, npz and archives.
#pragma once
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "libmocap/base/history.hpp"
#include "libmocap/clip/clip.hpp"
#include "libmocap/clip/world_frame.hpp"

namespace mocap::io {
class BodyModel;
}

namespace mocap::formats {

class RateRules;

struct ReadOptions {
  Unit unit = Unit::automatic;
  UpAxis up = UpAxis::automatic;
  FirstFrame first_frame = FirstFrame::automatic;
  bool lenient = false;
  std::map<std::string, std::string> joints{};       // canonical name -> joint, by hand (joint_map_file.hpp)
  std::string asf{};                                 // path of the skeleton of AMC files; empty: it is looked for beside each
  std::shared_ptr<const RateRules> rates{};          // rate_rules.hpp: files whose rate is not what they say
  std::shared_ptr<const io::BodyModel> body_model{};  // io/body_model.hpp: rest joints of AMASS files
};

// One opened file: one clip (BVH, AMC, npz) or many (archive). Clips come out in metres, Z up, local rotations unit and
// sign-continuous, named after the file's stem (archives: their own names), with source path, digest and rate filled, and the roles of
// their skeletons from the joint map.
class MotionInput {
 public:
  virtual ~MotionInput() = default;
  virtual std::string format() const = 0;  // "bvh", "amc", "npz (source)", "npz (SMPL+H)", "archive"
  virtual std::size_t size() const = 0;
  virtual Clip read(std::size_t i) const = 0;
  // Of clip i; archives answer from their index, without reading frames.
  virtual std::string name(std::size_t i) const { return read(i).name; }
  virtual Attributes attributes(std::size_t i) const { return read(i).attributes; }
  virtual const History& history() const = 0;              // what the file itself carries
  virtual const std::vector<std::string>& notes() const = 0;  // what was detected, one line each
  virtual std::vector<std::string> doubts() const { return {}; }  // what is worth a warning: repairs, units and axes that are guesses
  virtual std::string sha256() const = 0;                  // of the file's bytes
  virtual std::vector<HistoryInput> companions() const { return {}; }  // files read along with it: an AMC's ASF
  virtual std::string contacts_rule() const { return {}; }  // archives: theirs
  virtual std::map<std::string, std::vector<std::string>> attribute_classes() const { return {}; }  // archives: what classifiers told apart in them
};

// Opens `path` ("-": standard input); `label` is what provenance calls it. Error(data) with the file named.
//
// An AMC needs its ASF: options.asf, else in the same folder (endings in any case, .gz too) the ASF of the same stem, else the
// one with the longest stem that the AMC's begins with, up to a '_' (07_05.amc: 07.asf), else the only one there is. An
// ASF alone is refused.
std::unique_ptr<MotionInput> open_motion(const std::string& path, const std::string& label, const ReadOptions& options = {});

// What companions() of the opened file would be, from the bytes alone; empty where the file is no AMC or its ASF is not found.
std::vector<HistoryInput> companions_of(const std::string& path, const std::string& label, const ReadOptions& options);

// Whether a file looks like something open_motion reads, by its first bytes and, of a zip, its directory: how folders are
// searched. An npz file without motion (AMASS's shape.npz, *_stagei.npz) is none, and `why_not` says why; else that is empty.
struct Probe {
  bool motion = false;
  std::string why_not;
};
Probe probe_motion(const std::string& path);

}  // namespace mocap::formats
