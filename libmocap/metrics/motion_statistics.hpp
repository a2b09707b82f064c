// Figures about motion that need no classifier: how much it moves, how smoothly, how its feet stand.
#pragma once
#include <string>
#include <vector>

#include "libmocap/clip/clip.hpp"
#include "libmocap/features/motion_cell.hpp"

namespace mocap::metrics {

// Joint speed weighted by the impact factors alpha_k of Ghorbani eq. 23 (metres), the root's own rotation left out:
//   E(t) = sum_k alpha_k d(q_k(t), q_k(t+1)) f,  rad m / s.  One value a step, [T-1].
std::vector<double> joint_energy(const Clip& clip);

struct MotionStatistics {
  std::size_t clips = 0, frames = 0;
  double energy = 0;                       // mean of joint_energy over all steps, rad m / s
  double root_height_low = 0, root_height_high = 0;  // 1st and 99th percentile over frames, metres
  double root_speed = 0;                   // mean horizontal speed, m/s
  double skate_mps = 0;                    // mean horizontal speed of the toe bases over steps with contact at both ends, m/s
  double contact_share = 0;                // share of frames with a foot down
  double jerkiness = 0;                    // mean |second difference| over mean |first difference| of the rotations
  double frozen_share = 0;                 // clips whose last third has under a fifth of `reference_energy`
};

// `reference_energy`: of the real motion (0: the set's own mean).
MotionStatistics motion_statistics(const std::vector<Clip>& clips, double reference_energy = 0);

// For each window of `window` frames cut from `clips` every `stride` frames: the root-mean-square distance per column, in
// deviations of the training columns, to the nearest window of `training` (all offsets a multiple of `training_stride`).
// Only windows of clips with equal values of all `match` attributes are compared. Samples that copy their training data
// lie nearer to it than unseen real clips do. Returns the distances; clips shorter than the window give none.
struct NearestOptions {
  int window = 60, stride = 30, training_stride = 3;
  std::vector<std::string> match;
  int threads = 1;
};
std::vector<double> nearest_training_distances(const std::vector<Clip>& clips, const std::vector<Clip>& training, const NearestOptions& options);

double median(std::vector<double> values);  // NaN where empty

}  // namespace mocap::metrics
