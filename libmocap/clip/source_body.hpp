// One rig for a folder of clips: archives have one skeleton, and joints that only turn.
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "libmocap/clip/clip.hpp"

namespace mocap {

// The clip with rotations only. Joints that move against their parents come to rest at the middle of where they were, which becomes
// their offset. A root that only carries the body (one child, no limb of its own: `joint_Root` above `Hips`) is brought along instead: it
// takes up the travel and the heading of the joint below it, so that nothing else moves and the root tells where the body faces.
// `notes` gets a line where a joint was moved by more than a millimetre. Roles must be filled. Positions of all other joints are kept to 1e-9 m.
Clip without_translations(const Clip& clip, std::vector<std::string>& notes);

// The clip on `body`, which must have the same joint names and parents, and bones in the same directions at rest (20 degrees, joints
// closer than a centimetre to their parents aside): rotations are kept, travel is scaled by the ratio of leg lengths (source.scale), and a line
// in `notes` says by how much bones differ (beyond 0.1 mm). Error(data) names the first joint that differs.
Clip on_body(const Clip& clip, const std::shared_ptr<const Skeleton>& body, std::vector<std::string>& notes);

}  // namespace mocap
