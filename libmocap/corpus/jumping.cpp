#include <algorithm>
#include <cmath>
#include <numbers>

#include "libmocap/corpus/leg_ik.hpp"
#include "libmocap/corpus/planning.hpp"
#include "libmocap/corpus/scripted.hpp"
#include "libmocap/corpus/stance.hpp"

namespace mocap::corpus {
namespace {

constexpr double kGravity = 9.81;
constexpr double kLeaveOver = 0.035;  // metres of pelvis travel over which the feet gather speed around take-off

// Highest pelvis over feet on the ground at a pitch of the feet and a flexion of the knees, both short of their limits.
double extended_height(const BodyPlan& body, double pitch, double knee) {
  return ankle_position(body, standing_foot(body, {0, 0}, 0, pitch)).z() +
         0.996 * two_bone_reach(body.thigh, body.shank, knee) + body.hip_drop;
}

// 0 below -w, x above w, a parabola between: feet leave the ground without a kick.
double lift_off(double x) {
  const double w = kLeaveOver;
  return x <= -w ? 0 : x >= w ? x : (x + w) * (x + w) / (4 * w);
}

struct Jump {
  double crouch_time, push_time, flight_time, absorb_time, recover_time;
  double height, depth, land_depth, distance;
  double take_off_speed, land_speed, take_off_z, land_z;  // of the pelvis
  double lean, arm_back, arm_up, tuck, sway, arm_lag, trunk_lag, side_lag;
  double duration() const { return crouch_time + push_time + flight_time + absorb_time + recover_time; }
};

constexpr double kPushPitch = -62, kLandPitch = -34;

Jump draw_jump(const Subject& s, const Stance& stance, double eagerness, Random& random) {
  const BodyPlan& body = s.body;
  const double stand = stance.pelvis_height(body);
  const auto vary = [&](double spread) { return 1 + spread * std::clamp(random.normal(), -2.0, 2.0); };
  Jump j{};
  j.height = std::clamp(s.jump_height * eagerness * vary(0.10), 0.08, 0.42);
  j.depth = s.crouch * body.leg() * vary(0.10);
  j.land_depth = j.depth * (0.55 + 0.8 * j.height) * vary(0.12);
  j.distance = std::max(0.0, 0.20 + 0.15 * random.normal()) * body.leg_scale;
  j.take_off_z = extended_height(body, radians(kPushPitch), radians(14));
  j.land_z = extended_height(body, radians(kLandPitch), radians(24));
  j.take_off_speed = std::sqrt(2 * kGravity * j.height);
  j.land_speed = std::sqrt(2 * kGravity * (j.take_off_z + j.height - j.land_z));
  j.flight_time = (j.take_off_speed + j.land_speed) / kGravity;
  j.crouch_time = 0.62 * s.tempo * vary(0.10);
  j.push_time = 1.75 * (j.take_off_z - stand + j.depth) / j.take_off_speed;
  j.absorb_time = 1.9 * (j.land_z - stand + j.land_depth) / j.land_speed * vary(0.05);
  j.recover_time = 0.75 * s.tempo * vary(0.12);
  j.lean = radians(44) * vary(0.10) * std::exp(0.10 * stance.day[kThoraxSway]);
  j.arm_back = radians(45) * vary(0.10) * std::exp(0.16 * stance.day[kThoraxYaw]);
  j.arm_up = radians(100) * vary(0.08) * std::exp(0.12 * stance.day[kArmSwing]);
  j.tuck = body.leg_scale * 0.03 * std::max(0.0, vary(0.4));
  j.sway = random.normal();
  j.arm_lag = 0.030 * stance.day[kArmLag];
  j.trunk_lag = 0.030 * stance.day[kThoraxLag];
  j.side_lag = 0.015 * random.normal();
  return j;
}

// The curves of one jump, time 0 at its start.
struct JumpCurves {
  Jump j;
  double bottom, off, apex, down, low, end;
  QuinticPath height, ahead;  // of the pelvis; ahead of the stance before the jump
  KeyCurve lean, arm, elbow, abduction, knee_in, roll;

  JumpCurves(const Subject& s, const Stance& stance, const Jump& jump) : j(jump) {
    const double stand = stance.pelvis_height(s.body);
    bottom = j.crouch_time;
    off = bottom + j.push_time;
    down = off + j.flight_time;
    apex = off + j.take_off_speed / kGravity;
    low = down + j.absorb_time;
    end = low + j.recover_time;
    height.add(0, stand);
    // The turning points curve upwards, but not so much that the curve before or after would swing past its end.
    const auto turn = [](double wanted, double depth, double t) { return std::min(wanted, 4 * depth / (t * t)); };
    height.add(bottom, stand - j.depth, 0, turn(0.5 * j.take_off_speed / j.push_time, j.depth, j.crouch_time));
    height.add(off, j.take_off_z, j.take_off_speed, -kGravity);
    height.add(down, j.land_z, -j.land_speed, -kGravity);
    height.add(low, stand - j.land_depth, 0, turn(0.3 * j.land_speed / j.absorb_time, j.land_depth, j.recover_time));
    height.add(end, stand);

    const double lean_back = -0.05 - 0.05 * j.depth, leave = 0.05 + 0.10 * j.distance,
                 meet = j.distance - 0.04 - 0.12 * j.distance;
    const double speed = (meet - leave) / j.flight_time;
    ahead.add(0, 0);
    ahead.add(bottom, lean_back);
    ahead.add(off, leave, speed);
    ahead.add(down, meet, speed);
    ahead.add(low, j.distance + 0.5 * lean_back);
    ahead.add(end, j.distance);

    const auto keys = [&](KeyCurve& c, double lag, std::initializer_list<double> values) {
      const double times[] = {0, bottom, off, apex, down, low, end};
      auto v = values.begin();
      for (const double t : times) c.add(t + (t > 0 && t < end ? lag : 0), *v++);
      c.finish();
    };
    const double d = j.lean;
    keys(lean, j.trunk_lag, {0, d, radians(-2), radians(5), radians(12), 0.62 * d, 0});
    keys(arm, j.arm_lag, {0, -j.arm_back, 0.85 * j.arm_up, j.arm_up, 0.62 * j.arm_up, 0.15 * j.arm_up, 0});
    // What a trait adds swings about zero, so that it shows in the course of the jump and hardly in its mean.
    const double bend = radians(9) * std::exp(0.24 * stance.day[kElbowSwing]),
                 wide = radians(5) * std::exp(0.24 * stance.day[kArmWidth]);
    const double in = radians(6) * std::exp(0.24 * stance.day[kPelvisRoll]);
    keys(elbow, j.arm_lag,
         {0, radians(12) - bend, radians(22) + 0.7 * bend, radians(36), radians(30) - 0.6 * bend,
          radians(12) + 0.6 * bend, 0});
    keys(abduction, j.arm_lag,
         {0, radians(8) - 0.8 * wide, radians(9) + wide, radians(13), radians(13) - 0.8 * wide, radians(8) + 0.7 * wide,
          0});
    keys(knee_in, 0, {0, in, -0.8 * in, 0, -0.7 * in, 0.8 * in, 0});
    const double shift = 0.012 * std::exp(0.20 * stance.day[kPelvisSway]) * (j.sway > 0 ? 1 : -1);
    keys(roll, 0, {0, shift, 0.3 * shift, 0, -0.6 * shift, -1.2 * shift, 0});
  }
};

void add_jump(const Subject& s, const Stance& stance, const JumpCurves& c, double t, double moved, BodyState& b) {
  const BodyPlan& body = s.body;
  const Jump& j = c.j;
  const double stand = stance.pelvis_height(body), z = c.height(t);
  b.pelvis.z() = z;
  b.pelvis.head<2>() += c.ahead(t) * stance.forward() + c.roll(t) * stance.left();
  const double lean = c.lean(t);
  b.tilt += 0.58 * lean;
  b.lean += 0.42 * lean;
  b.head_pitch -= 0.55 * lean;
  const double yaw_swing = radians(1.2) * std::exp(0.2 * stance.day[kPelvisYaw]) * (j.sway > 0 ? 1 : -1);
  b.yaw += yaw_swing * (c.roll(t) / 0.012);
  b.twist -= 1.5 * yaw_swing * (c.roll(t) / 0.012);
  b.knee_in = c.knee_in(t);
  for (int side = 0; side < 2; ++side) {
    ArmState& arm = b.arms[static_cast<std::size_t>(side)];
    const double at = t - (side == 0 ? j.side_lag : -j.side_lag);
    const double swing = c.arm(at) * s.side_asymmetry[side];
    arm.swing += swing;
    arm.lift = 0.16 * std::max(0.0, swing - radians(30));
    arm.elbow += c.elbow(at);
    arm.abduction += c.abduction(at);

    FootState& foot = b.feet[static_cast<std::size_t>(side)];
    if (t <= c.bottom || t >= c.low) {
      foot = standing_foot(body, stance.ball(body, side, t >= c.low ? moved + j.distance : moved), foot.yaw, 0);
      foot.planted = true;
      continue;
    }
    // From push-off to landing the feet follow the pelvis: heels rise as it rises over the standing height, and the
    // balls leave the ground where legs and feet are stretched. The stretch itself changes in flight, for the landing.
    const double u = std::clamp((t - c.off) / j.flight_time, 0.0, 1.0), flown = smoothstep(u),
                 wave = std::sin(std::numbers::pi * u);
    const double z_full = mix(j.take_off_z, j.land_z, flown), z_flat = stand - 0.15 * body.leg();
    const double pitch =
        radians(mix(kPushPitch, kLandPitch, flown)) * smoothstep((z - z_flat) / (z_full - kLeaveOver - z_flat));
    const double rise = lift_off(z - z_full + j.tuck * wave * wave);
    foot = standing_foot(body, stance.ball(body, side, moved + j.distance * flown), foot.yaw, pitch);
    foot.toe *= 1 - smoothstep(rise / (1.3 * body.ankle_to_ball.x()));
    foot.ball.z() += rise;
    foot.planted = rise <= 0 && (t <= c.off || t >= c.down);
  }
}

}  // namespace

Clip make_jumping(const Subject& subject, Random& random, std::size_t frames, double rate_hz) {
  const Stance stance(subject, random);
  const double eagerness = random.uniform(0.75, 1.25), seconds = static_cast<double>(frames) / rate_hz;
  std::vector<Jump> jumps;
  std::vector<double> durations;
  double total = 0;
  while (total < seconds) {
    jumps.push_back(draw_jump(subject, stance, eagerness, random));
    durations.push_back(jumps.back().duration());
    total += durations.back();
  }
  const std::vector<double> starts = schedule(durations, seconds, 0.25, random);
  std::vector<JumpCurves> curves;
  for (std::size_t i = 0; i < starts.size(); ++i) curves.emplace_back(subject, stance, jumps[i]);

  Clip clip = empty_clip(subject.body, frames, rate_hz);
  std::size_t current = 0;
  double moved = 0;
  for (std::size_t f = 0; f < frames; ++f) {
    const double t = static_cast<double>(f) / rate_hz;
    while (current < starts.size() && t >= starts[current] + curves[current].end) moved += curves[current++].j.distance;
    BodyState state = stance.upright(subject, t, moved);
    if (current < starts.size() && t > starts[current])
      add_jump(subject, stance, curves[current], t - starts[current], moved, state);
    put_frame(subject.body, state, f, clip);
  }
  make_sign_continuous(clip);
  return clip;
}

}  // namespace mocap::corpus
