// Which values of a measured motion are not to be believed.
//
// Values come in groups of three: the root's position (m, world), then the rotation of each joint: heading, roll and pitch of the root, rotation vectors of the others (rad). What is found here before anything is solved
// are suspects, found liberally: map_denoiser.hpp solves without them and takes back those that agree with what it found.
//
//   spike    1 to 4 frames that all lie off the cubic through the two frames on either side (at an end of the motion: off the line through the two on its one side and off the nearer of them), by more than `sigmas` deviations, more than 4 times the
//            median of what runs of that length lie off within 15 frames, and 1.5 times the most that any but one of the others does within 45: feet come down hard, but in every stride.
//            Of those at an end only the ones of one frame are found for sure
//   dropout  a group that holds its value for 3 frames or more - exactly, as trackers do that have lost their target, or as far as the noise on it lets one see - and then jumps by
//            more than it moves afterwards; one that holds it exactly need not jump where it stopped suddenly or other frames are noisy. What hangs below
//            such a joint is suspected with it.
// Deviations are those given, or the motion's own where it is noisier: median distance from a local parabola over 7 frames, as a deviation of each of three normal numbers.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "libmocap/features/state.hpp"

namespace mocap::control {

using Values = features::FeatureMatrix;                                     // (F, 3 G)
using Marks = Eigen::Array<std::uint8_t, Eigen::Dynamic, Eigen::Dynamic>;   // (F, G), 1: left out

struct HeldRun {
  int group = 0;
  std::int64_t first = 0, last = 0;  // frames, both included
};
struct Suspects {
  Marks marks;
  std::vector<HeldRun> held;
};

// Continuous in time, so that differences mean something. `states`: encode_state(clip).
Values measured_values(const Clip& clip, const features::FeatureMatrix& states);
// State features of a motion given by its values; frame 0 has the step of frame 1.
features::FeatureMatrix states_of(const Values& values);

double median(std::vector<double> x);  // the upper one of an even number; 0 of none
// (G) of the motion's own noise, of each of the three numbers.
std::vector<double> noise_deviations(const Values& values);
Suspects find_suspects(const Values& values, const std::vector<double>& noise, double sigma_position, double sigma_angle, double sigmas, const Skeleton& skeleton);
// What is marked is bridged in a straight line, then every value replaced by a local parabola over 7 frames.
Values bridged(const Values& values, const Marks& marks);

struct Outlier {
  int joint = -1;                    // -1: the root's position
  std::int64_t first = 0, last = 0;  // frames, both included
  bool dropout = false;              // else a spike
  double largest = 0;                // rad or m that was put right, in the frame where most
};
// The runs of marked frames of each group in order of time; `off` (F, G): distance of measured values from those found. Runs of a joint within a dropout of a joint above it are part of that one.
std::vector<Outlier> list_outliers(const Marks& marks, const std::vector<HeldRun>& held, const Eigen::ArrayXXd& off, const Skeleton& skeleton);

}  // namespace mocap::control
