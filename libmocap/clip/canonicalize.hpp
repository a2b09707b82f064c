// The whole way from a clip as read to a clip as trained on.
#pragma once
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "libmocap/clip/clip.hpp"
#include "libmocap/clip/ground.hpp"
#include "libmocap/clip/resample.hpp"
#include "libmocap/clip/retarget.hpp"
#include "libmocap/clip/trim.hpp"

namespace mocap {

struct CanonicalizeOptions {
  double rate_hz = 30;
  bool all_phases = false;     // every decimation offset of a higher source rate, each a clip of its own
  std::string contacts = "default";
  double min_seconds = 0;  // after trimming
  Trim trim;               // cut off before anything else
  AntiAlias anti_alias = AntiAlias::none;
};

// Resampled, retargeted, on the ground (sole at z = 0), first frame above the origin facing +X, contacts labelled.
// `clip` in metres, Z up, as formats::open_motion returns it; a clip already on the canonical body is not retargeted.
// Returns one clip, or one per phase with "@1", "@2", ... appended to the names of all but the first. Error(data) where
// the skeleton cannot be mapped, trimming leaves nothing or the clip is shorter than min_seconds.
// One object serves many clips and threads; retargeting is prepared once per skeleton.
class Canonicalizer {
 public:
  explicit Canonicalizer(CanonicalizeOptions options);  // Error(usage) for an unknown contact preset or a rate <= 0
  std::vector<Clip> operator()(const Clip& clip) const;

 private:
  std::shared_ptr<const Retargeter> retargeter_for(const std::shared_ptr<const Skeleton>& skeleton) const;

  CanonicalizeOptions options_;
  const ContactPreset& preset_;
  mutable std::mutex mutex_;
  mutable std::vector<std::pair<std::shared_ptr<const Skeleton>, std::shared_ptr<const Retargeter>>> known_;
};

}  // namespace mocap
