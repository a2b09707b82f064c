#include "libmocap/corpus/stance.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "libmocap/corpus/leg_ik.hpp"

namespace mocap::corpus {

Stance::Stance(const Subject& subject, Random& random)
    : sway_ahead(random, 0.1, 0.6), sway_aside(random, 0.1, 0.5), turn(random), nod(random), arms(random) {
  for (std::size_t i = 0; i < day.size(); ++i) day[i] = subject.style[i] + 0.25 * random.normal();
  place = Vector2(random.uniform(-3, 3), random.uniform(-3, 3));
  heading = random.uniform(-std::numbers::pi, std::numbers::pi);
  half_width = 0.095 * subject.body.leg_scale * subject.step_width * random.uniform(0.9, 1.3);
  for (double& angle : toe_out) angle = std::max(0.0, radians(9) + subject.toe_out + radians(1.5) * random.normal());
}

Vector2 Stance::forward() const { return {std::cos(heading), std::sin(heading)}; }
Vector2 Stance::left() const { return {-std::sin(heading), std::cos(heading)}; }

Vector2 Stance::ball(const BodyPlan& body, int side, double ahead) const {
  const double sign = side == 0 ? 1 : -1, foot = body.ankle_to_ball.x(), out = toe_out[side];
  return place + (ahead + foot * std::cos(out)) * forward() + sign * (half_width + foot * std::sin(out)) * left();
}

double Stance::pelvis_height(const BodyPlan& body) const {
  const double reach = two_bone_reach(body.thigh, body.shank, radians(11)), aside = half_width - body.hip_half_width,
               ahead = 0.045;
  return body.ankle_height + std::sqrt(reach * reach - aside * aside - ahead * ahead) + body.hip_drop;
}

BodyState Stance::upright(const Subject& subject, double t, double ahead) const {
  const BodyPlan& body = subject.body;
  BodyState s;
  s.pelvis.head<2>() = place + (ahead + 0.035 + 0.006 * sway_ahead(t)) * forward() + 0.005 * sway_aside(t) * left();
  s.pelvis.z() = pelvis_height(body);
  s.yaw = heading + radians(1.0) * turn(t);
  s.tilt = radians(4);
  s.lean = 0.6 * subject.lean - radians(2);
  s.twist = radians(1.0) * turn(t + 40);
  s.head_pitch = subject.head_pitch - 0.8 * (s.tilt + s.lean) + radians(1.5) * nod(t);
  s.head_yaw = radians(4) * nod(t + 30);
  for (int side = 0; side < 2; ++side) {
    ArmState& arm = s.arms[static_cast<std::size_t>(side)];
    arm.swing = radians(2) + 0.5 * subject.arm_posture + radians(1.2) * arms(t + 9.0 * side);
    arm.abduction = std::max(radians(4), radians(8) + subject.arm_abduction);
    arm.elbow = std::max(radians(8), radians(16) + 0.5 * subject.elbow);
    arm.twist = radians(12);
    const double sign = side == 0 ? 1 : -1;
    s.feet[static_cast<std::size_t>(side)] =
        standing_foot(body, ball(body, side, ahead), heading + sign * toe_out[side], 0);
    s.feet[static_cast<std::size_t>(side)].planted = true;
  }
  return s;
}

std::vector<double> schedule(const std::vector<double>& durations, double seconds, double shortest_pause,
                             Random& random) {
  std::size_t count = 0;
  double used = shortest_pause;
  while (count < durations.size() && used + durations[count] + shortest_pause <= seconds)
    used += durations[count++] + shortest_pause;
  count = std::max<std::size_t>(count, 1);
  const double spare = std::max(0.0, seconds - used);
  std::vector<double> share(count + 1), starts;
  double total = 0;
  for (double& x : share) total += x = random.uniform(0.3, 1);
  double t = shortest_pause;
  for (std::size_t i = 0; i < count; ++i) {
    t += spare * share[i] / total;
    starts.push_back(t);
    t += durations[i] + shortest_pause;
  }
  return starts;
}

}  // namespace mocap::corpus
