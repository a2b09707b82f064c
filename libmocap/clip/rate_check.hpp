// Whether a clip's own motion contradicts its frame rate: gravity and legs keep their time whatever a file says.
//
// Played k times too fast, accelerations grow by k^2, frequencies by k, energies of motion by k^2; lengths stay. Checked, in
// this order:
//   falls   In flight the body's centre falls with g: least squares of z = c0 + c1 t - a t^2/2 over each flight; the rate that
//           the motion was recorded at is rate sqrt(9.81 / a). Contradiction: the median a of the flights below 5 or above 20 m/s^2.
//   drops   Feet push and do not pull: nothing draws the centre down much faster than g. Contradiction: three moments apart
//           with more than 28 m/s^2.
//   steps   Of at least three regular steps: fewer than 0.7 or more than 4.7 a second; steps longer than 0.95 m s times their
//           number a second (people's walk ratio is near 0.4 m s at all speeds, Sekiya et al. 1996; runners' is up to 0.8), than 0.8 m s
//           in a walk; a walk of more than 3.3 steps a second, each over 0.4 m. A walk: both soles within 0.05 m of the ground for
//           more than 0.3 of the time.
//   vaults  In a walk the centre pays for its rise with speed (Cavagna et al. 1976): the slope of its kinetic over its potential energy,
//           both less their mean of a step to either side, is about -1 where the two go against each other (correlation below
//           -0.6, at least four steps). Contradiction: steeper than -2.8 or flatter than -0.3.
// The limits leave room around what 1,006 CMU and Bandai-Namco files do at their own rates (none is doubted; docs/results.md
// has the shares found at twice, four times, half and a quarter of it). Somebody who stands and waves contradicts no rate.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "libmocap/clip/clip.hpp"

namespace mocap {

// What is measured. Metres and seconds of the clip's own clock.
struct RateEvidence {
  struct Flight {             // both feet at least 0.03 m up and 0.05 m at their highest, going where the body goes, on the ground before and after
    double gravity_mps2 = 0;  // a of the fit
    double seconds = 0;
    double rise_m = 0;        // of the centre above the higher end
    double residual_m = 0;    // root mean square
  };
  std::vector<Flight> flights;  // those that a parabola fits within 6 % of their rise
  double drop_mps2 = 0;         // downward acceleration that the centre reaches at three moments at least 4/30 s apart
  std::size_t steps = 0;        // of the longest run of regular steps; what follows is theirs, 0 where there are none
  double cadence_hz = 0;        // steps a second, median
  double step_m = 0;            // travel of the root a step, median
  double grounded = 0;          // share of frames with both soles within 0.05 m of the ground
  double exchange = 0, correlation = 0;  // of kinetic and potential energy: slope and correlation
};

// `clip`: metres, Z up, on the ground (set_on_ground()), with the roles of the legs, arms, neck and head; other skeletons and
// clips of fewer than 8 frames give no evidence. Cost: forward kinematics and O(1) a frame.
RateEvidence rate_evidence(const Clip& clip);

// What contradicts, in one phrase ("steps at 5.9 a second, expected 0.7 to 4.7"); nullopt where nothing does. Rates named are
// those of the clip's source.
std::optional<std::string> check_rate(const Clip& clip);

}  // namespace mocap
