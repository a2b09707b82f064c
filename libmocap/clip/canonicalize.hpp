// The whole way from a clip as read to a clip as trained on.
#pragma once
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "libmocap/clip/clip.hpp"
#include "libmocap/clip/ground.hpp"
#include "libmocap/clip/resample.hpp"
#include "libmocap/clip/retarget.hpp"
#include "libmocap/clip/retarget_report.hpp"
#include "libmocap/clip/source_body.hpp"
#include "libmocap/clip/trim.hpp"

namespace mocap {

// Where the orientation of a rig's joints comes from: its rest pose, joint positions over the motion, or the rest pose where it stands.
enum class Alignment { automatic, rest, motion };

struct CanonicalizeOptions {
  double rate_hz = 30;
  std::shared_ptr<const Skeleton> body;  // a source rig that all clips are kept on (source_body.hpp); empty: the canonical body
  Alignment alignment = Alignment::automatic;
  bool mirror = false;         // a mirrored copy after each clip
  bool all_phases = false;     // every decimation offset of a higher source rate, each a clip of its own
  std::string contacts = "default";
  double min_seconds = 0;  // after trimming
  Trim trim;               // cut off before anything else
  AntiAlias anti_alias = AntiAlias::none;
};

// Resampled, retargeted, on the ground (sole at z = 0), first frame above the origin facing +X, contacts labelled.
// `clip` in metres, Z up, as formats::open_motion returns it; a clip already on the canonical body is not retargeted.
// Returns one clip, or one per phase with "@1", "@2", ... appended to the names of all but the first, each followed by its mirrored
// copy, "@m" appended, where that is asked for. Error(data) where the skeleton cannot be mapped, where its left and right are
// exchanged (world_frame.hpp), where trimming leaves nothing or the clip is shorter than min_seconds.
// One object serves many clips and threads; retargeting is prepared once per skeleton that stands at rest.
class Canonicalizer {
 public:
  explicit Canonicalizer(CanonicalizeOptions options);  // Error(usage) for an unknown contact preset or a rate <= 0
  struct Result {
    std::vector<Clip> clips;
    std::vector<std::string> notes;                     // what a careful reader would want to know
    std::optional<RetargetReport> report;               // of the first clip, where it was retargeted and `report` asked for
  };
  Result operator()(const Clip& clip, bool report = false) const;

 private:
  std::shared_ptr<const Retargeter> retargeter_for(const Clip& clip, std::vector<std::string>& notes) const;

  CanonicalizeOptions options_;
  const ContactPreset& preset_;
  mutable std::mutex mutex_;
  mutable std::vector<std::pair<std::shared_ptr<const Skeleton>, std::shared_ptr<const Retargeter>>> known_;
};

}  // namespace mocap
