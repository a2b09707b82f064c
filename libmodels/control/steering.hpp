// Motion that obeys commands as they come (Wang, Chai, Xia 2018, section 5.3): at any time a speed and a direction to face.
//
// Window by window, the commands' speed is asked of the mean over the window (eq. 22) and their direction of its last frame (eq. 23), turned towards it by no more than the turn limit allows within the
// window. A command counts from the first window on that begins at its time or later. Time is that of the motion: frame n is at n / rate.
#pragma once
#include <vector>

#include "libmocap/formats/steering_commands.hpp"
#include "libmodels/control/planner.hpp"

namespace mocap::control {

using Command = formats::SteeringCommand;

struct SteeringSettings {
  double speed_sigma = 0.02, direction_sigma = 0.02;  // m/s, rad
  double turn_limit = 2.4;                           // rad/s
};

class Steering {
 public:
  // `terms`: those beside the commands'. All are kept by reference but the start.
  Steering(const MotionModel& model, const lstm_gmm::Sampler& sampler, Carried start, Terms terms, const SteeringSettings& settings, const PlanOptions& options);
  Planned next(const Command& command);
  const Carried& now() const { return planner_.now(); }

 private:
  Terms terms_;
  SteeringSettings settings_;
  double seconds_;  // of a window
  Planner planner_;
};

// How a command was obeyed: mean speed and facing over half a second around each frame.
struct Obeyed {
  std::optional<double> settled_s;  // after which both stay within tolerance until the next command; none: they never do
  double speed = 0, heading = 0;    // in the end: m/s; rad
};
// One for each command, which lasts until the next one's time or the clip's end. Tolerances: 0.15 m/s or a tenth of the speed, and 0.2 rad.
std::vector<Obeyed> obeyed(const Clip& clip, const std::vector<Command>& commands);

}  // namespace mocap::control
