// Figures of single clips: what their feet do, how roughly they move, whether they die or explode, and how near they lie to a
// training clip. Clips in metres, Z up, ground at 0 (contract/motion-archive.md).
#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "libmocap/clip/clip.hpp"

namespace mocap::metrics {

inline constexpr double kSkateHeight = 0.06;  // metres; a foot joint below it at both ends of a step counts as standing

struct ClipFigures {
  double skate_mps = 0;      // mean horizontal speed of the foot joints (roles left_foot, right_foot) over steps from t to t+1 that stand, m/s; NaN: none stands
  double skate_gmd = 0;      // share of steps in which a foot skates as guided-motion-diffusion has it: below 0.05 m at both ends, faster than 0.5 m/s horizontally,
                             // and so on the mean of 5 steps around it (0 beyond the ends). Theirs is at 20 Hz; here at the clip's rate
  double contact_speed_mps = 0;  // as skate_mps, over the steps that the clip's contacts call down at both ends, whatever the height; NaN: no contacts, or none is down
  double contact_height_m = 0;   // mean height of a foot joint over the frames that it is down in by the clip's contacts, metres; NaN likewise
  double penetration_m = 0;  // mean depth of the joints below the ground over all joints and frames (0 where above), metres
  double jerk = 0;           // mean |third difference of a joint's place in the world| f^3, m/s^3; NaN below 4 frames
  double energy = 0;         // mean of joint_energy (motion_statistics.hpp), rad m / s; NaN below 2 frames
  double thirds[3] = {};     // the same of each third of the clip; NaN below 4 frames
};
// Error(data) where the skeleton has no foot roles. Cost O(T J).
ClipFigures clip_figures(const Clip& clip);
std::vector<ClipFigures> clip_figures(const std::vector<Clip>& clips, int threads);

// Against the real mean energy of the clip's class: frozen where the last third has less than a fifth of it, exploding where some third
// has more than five times it. Neither for clips below 4 frames.
enum class Liveliness { alive, frozen, exploding };
Liveliness liveliness(const ClipFigures& clip, double real_energy);

// Lengths to which two sets are cut so that both have the same distribution of lengths: with u the rank of a clip in its set (by length,
// then order; (rank + 1/2) / N), the smaller of the quantiles at u of either set, and no more than `longest` (0: no limit). No clip is
// lengthened or left out. [frames of each clip of a, of b]. Without it a figure compares durations, not motions.
std::pair<std::vector<std::size_t>, std::vector<std::size_t>> common_lengths(const std::vector<std::size_t>& a, const std::vector<std::size_t>& b, std::size_t longest = 0);

// The middle window of each clip against every window of `training` at offsets of `stride` frames: the nearest by features every `step`
// frames, then, of it and those less than a stride from it, the smallest root-mean-square distance per column over all frames, in
// deviations of the training columns (features/motion_cell.hpp). Samples that copy their training data lie nearer to it than unseen real clips do.
struct Neighbour {
  std::size_t clip = 0, training_clip = 0, frame = 0;  // `frame`: where the window begins in the training clip
  double distance = 0;
};
struct NeighbourOptions {
  int window = 60, step = 6, stride = 0;  // stride 0: as small as keeps the windows of all training clips under 300,000
  std::size_t most = 500;  // clips looked at, evenly chosen
  int threads = 1;
};
// Clips shorter than the window are left out. The same for any number of threads.
std::vector<Neighbour> nearest_training_clips(const std::vector<Clip>& clips, const std::vector<Clip>& training, const NeighbourOptions& options);

}  // namespace mocap::metrics
