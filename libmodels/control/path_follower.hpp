// Motion along a curve on the ground (Wang, Chai, Xia 2018, section 5.2).
//
// Windows are solved one after the other (planner.hpp) under the terms given and the curve's, eq. 17, with a soft wish to face along it. Nearest points are sought from just behind the place that was reached up to what four metres a
// second would reach within a window, so that curves may cross themselves. Beyond its end the curve goes on straight: the last window is not drawn back to the end. A window behind one that hardly got on is
// solved four times over. The motion ends with the frame that is first at the end; where three seconds bring it less than a quarter of a metre further along, it stalls and ends.
#pragma once
#include <optional>

#include "libmocap/math/ground_curve.hpp"
#include "libmodels/control/planner.hpp"

namespace mocap::control {

inline constexpr double kFarFromCurve = 0.25;  // m in the mean: said to the user

struct FollowSettings {
  double curve_sigma = 0.05, facing_sigma = 0.5;  // m; rad, 0: facing is free
  std::optional<double> speed, step_length;  // no speed: that of the start
  double speed_sigma = 0.05, step_sigma = 0.05, most_seconds = 0;
};

struct FollowedWindow {
  std::int64_t first = 0;  // frame of the motion that it begins with
  double after_swarm = 0, after_lbfgs = 0, prior_per_frame = 0;
  double mean_distance = 0;  // of the frames that were kept, m
  std::vector<std::pair<std::string, double>> terms;
};

struct Followed {
  Clip clip;  // with path: the curve, every 5 cm
  std::vector<FollowedWindow> windows;
  bool reached_end = false, stalled = false;
  double followed_m = 0, mean_distance = 0, largest_distance = 0, mean_speed = 0, prior_per_frame = 0;
};

// `terms`: those beside the curve's. `number` tells curves of one seed apart.
Followed follow_path(const MotionModel& model, const lstm_gmm::Sampler& sampler, const GroundCurve& curve, const Terms& terms, const FollowSettings& settings, const PlanOptions& options, std::uint64_t number = 0);

}  // namespace mocap::control
