// Left and right exchanged.
#pragma once
#include "libmocap/clip/clip.hpp"

namespace mocap {

// The clip as a mirror in the plane y = 0 shows it, on the same skeleton: positions (x, y, z) -> (x, -y, z), and with M = diag(1, -1, 1), Q_j
// the world rotation of joint j since T-pose, R_j = Q_j T_j (skeleton/rest_pose.hpp), and j' its counterpart on the other side,
//     Q'_j = M Q_j' M.
// Contacts change feet, source.mirrored its value; attributes and segments stay. Exact on a symmetric skeleton (the canonical body: twice is
// the clip again); on another its small asymmetries stay where they are. Error(data) where a joint has no counterpart, or where joint frames
// cannot be told because the rest pose does not stand.
Clip mirror(const Clip& clip);

// The counterpart of every joint; joints of the trunk are their own. Error(data) names a joint that has none. [J]
std::vector<int> counterparts(const Skeleton& skeleton);

}  // namespace mocap
