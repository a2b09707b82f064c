// Motion denoising as a MAP problem (Wang, Chai, Xia 2018, section 5.4): of all motions the one that is most probable under the generator and under what was measured,
//
//   min over s, d of  -log p(s_1 .. s_T | s_0, d) + |d|^2 / (2 sigma^2) + contacts (eq. 18)
//                     + sum_t |root_t - root^_t|^2 / (2 sigma_root^2) + sum_t |angles_t - angles^_t|^2 / (2 sigma_angle^2)            eq. 24, 25
//
// by L-BFGS, in windows of 34 frames that overlap by 17 (planner.hpp): of each all but the overlap is kept, and the overlap is where the next one begins to look. Memory does not grow with the clip but for the
// clip itself. What is looked for are the states, with the root's place and heading in place of its steps: measured places hold each frame by itself then.
//
// The first frame is as noisy as all others and the network's state before it unknown. Both are unknowns of the first window beside the rest: they start from the smoothed first two frames and eq. 26; frame 0 is
// held by its own measurements, the state by a unit normal about what eq. 26 found. What comes before the first frame then is whatever makes the whole first window most probable.
//
// The objective is flat and far too high where L-BFGS would begin in noise: the network, given noise, expects noise, and its deviations grow tenfold. So frames that no window has seen start from the generator running on by itself
// and drawn to the measurements, value by value with the gain of a steady Kalman filter of a random walk: its input stays like motion, and what is left out it fills in.
//
// A Gaussian believes every value. So groups of three (the root's position, a joint's rotation) that look like spikes and dropouts (outliers.hpp) are left out of the first run; after each run a suspect stays left out
// where it lies further than `outlier_sigmas` deviations from what was found - a held run as one - and is taken back where it does not. Deviations are sigma_root and sigma_angle, or the motion's own noise where that is larger; never
// is the limit nearer than four times the median distance in the window: where what was found is far from all values, it is not the values that are wrong.
// Contacts are read from the network at the same times; at first they are those of the smoothed motion by the rule `default`.
#pragma once
#include <vector>

#include "libmodels/control/outliers.hpp"
#include "libmodels/control/planner.hpp"

namespace mocap::control {

struct MapSettings {
  double sigma_root = 0.0025, sigma_angle = 0.01;  // m, rad
  double outlier_sigmas = 8;

  void validate() const;  // Error(usage)
};

// What served noise of known truth best (docs/results.md). The noise of the input is smaller than the paper's 0.05, under which jitter passes; feet may be at any height, since heels come down before toes do.
inline constexpr double kMapNoiseSigma = 0.01, kMapContactSigma = 0.01, kMapHeightSigma = 0.05;
inline LbfgsOptions map_lbfgs() {
  LbfgsOptions o;
  o.iterations = 20;
  o.rereads = 3;
  o.noise_sigma = kMapNoiseSigma;
  return o;
}

struct MapDenoised {
  Clip clip;                       // rotations, root positions and contacts anew, all else as it was
  std::vector<Outlier> outliers;
  std::size_t windows = 0, lowered = 0;  // by L-BFGS, of the objective
};

// `terms`: those beside the observation's. Of `options` window, overlap and lbfgs count; lbfgs.rereads: runs, between which values are judged. A clip's first contacts are those of the rule `default`, since the network tells
// of the next frame; all others are the network's, with a refiner as it refines them.
// Error(data) naming the clip for another skeleton or rate than the model's, fewer than 2 frames, joint translations, numbers that are not finite. Thread-safe for models of one's own; depends on the clip alone.
// Cost: 0.4 s a window of a network of 2.6 million weights on one core at 3 GHz.
MapDenoised denoise_map(const MotionModel& model, const Terms& terms, const MapSettings& settings, const PlanOptions& options, const Clip& clip);

}  // namespace mocap::control
