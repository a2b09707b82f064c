#include "libmocap/corpus/gait.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "libmocap/corpus/body_state.hpp"
#include "libmocap/corpus/leg_ik.hpp"
#include "libmocap/corpus/planning.hpp"

namespace mocap::corpus {
namespace {

constexpr double kTau = 2 * std::numbers::pi;

// One gait as numbers, so that two gaits can be mixed. Angles in degrees, lengths in metres of a 1.70 m body.
// clang-format off
enum Number {
  kSpeed, kCadence, kDuty, kStepWidth, kToeOut, kBallAhead,
  // Height of the hips over the ankles in leg lengths, and its second harmonic in metres.
  kHipHeight, kBobCos, kBobSin,
  kSway, kSurge, kYawAmplitude, kRollAmplitude, kTilt, kTiltAmplitude, kLean, kThoraxYawAmplitude, kSideAmplitude,
  kArmMean, kArmAmplitude, kElbowMean, kElbowAmplitude, kAbduction, kAbductionAmplitude, kTwist, kTwistAmplitude,
  // Stance: pitch of the foot when the heel strikes, the parts of stance at which it is flat and its heel rises, pitch at
  // lift-off.
  kStrikePitch, kFlatAt, kRiseAt, kOffPitch,
  // Swing: pitch of the foot and height of its ball at kSwingTimes.
  kSwingPitch1, kSwingPitch2, kSwingPitch3, kSwingPitch4, kSwingLift1, kSwingLift2, kSwingLift3, kSwingLift4,
  kNumbers
};
// clang-format on
using Gait = std::array<double, kNumbers>;
constexpr std::array<double, 4> kSwingTimes = {0.14, 0.35, 0.60, 0.84};
constexpr double kLandingSpeed = 0.65;  // of the mean speed of the swing

Gait walking() {
  Gait g{};
  g[kSpeed] = 1.25, g[kCadence] = 0.97, g[kDuty] = 0.60, g[kStepWidth] = 0.135, g[kToeOut] = 7, g[kBallAhead] = 0.060;
  g[kHipHeight] = 0.978;
  const double bob = 0.018, highest = 0.31;
  g[kBobCos] = bob * std::cos(2 * kTau * highest), g[kBobSin] = bob * std::sin(2 * kTau * highest);
  g[kSway] = 0.020, g[kSurge] = 0.007, g[kYawAmplitude] = 5, g[kRollAmplitude] = 3.6, g[kTilt] = 5,
  g[kTiltAmplitude] = 0.8;
  g[kLean] = -2, g[kThoraxYawAmplitude] = 4.5, g[kSideAmplitude] = 2.2;
  g[kArmMean] = -3, g[kArmAmplitude] = 20, g[kElbowMean] = 21, g[kElbowAmplitude] = 9, g[kAbduction] = 8,
  g[kAbductionAmplitude] = 2.2;
  g[kTwist] = 14, g[kTwistAmplitude] = 3;
  g[kStrikePitch] = 19, g[kFlatAt] = 0.16, g[kRiseAt] = 0.56, g[kOffPitch] = -60;
  g[kSwingPitch1] = -66, g[kSwingPitch2] = -42, g[kSwingPitch3] = -4, g[kSwingPitch4] = 17;
  g[kSwingLift1] = 0.042, g[kSwingLift2] = 0.064, g[kSwingLift3] = 0.044, g[kSwingLift4] = 0.052;
  return g;
}

Gait jogging() {
  Gait g{};
  g[kSpeed] = 2.6, g[kCadence] = 1.36, g[kDuty] = 0.37, g[kStepWidth] = 0.085, g[kToeOut] = 5, g[kBallAhead] = 0.0;
  g[kHipHeight] = 0.941;
  const double bob = 0.036, highest = 0.185 + 0.25;
  g[kBobCos] = bob * std::cos(2 * kTau * highest), g[kBobSin] = bob * std::sin(2 * kTau * highest);
  g[kSway] = 0.010, g[kSurge] = 0.006, g[kYawAmplitude] = 6, g[kRollAmplitude] = 3.6, g[kTilt] = 10,
  g[kTiltAmplitude] = 1.5;
  g[kLean] = 2, g[kThoraxYawAmplitude] = 8, g[kSideAmplitude] = 2.2;
  g[kArmMean] = -12, g[kArmAmplitude] = 26, g[kElbowMean] = 82, g[kElbowAmplitude] = 11, g[kAbduction] = 13,
  g[kAbductionAmplitude] = 3.5;
  g[kTwist] = 22, g[kTwistAmplitude] = 10;
  g[kStrikePitch] = 8, g[kFlatAt] = 0.16, g[kRiseAt] = 0.42, g[kOffPitch] = -56;
  g[kSwingPitch1] = -84, g[kSwingPitch2] = -98, g[kSwingPitch3] = -42, g[kSwingPitch4] = -2;
  g[kSwingLift1] = 0.085, g[kSwingLift2] = 0.24, g[kSwingLift3] = 0.14, g[kSwingLift4] = 0.065;
  return g;
}

Gait mixed(const Gait& a, const Gait& b, double u) {
  Gait g;
  for (std::size_t i = 0; i < g.size(); ++i) g[i] = mix(a[i], b[i], u);
  return g;
}

// What the subject makes of the two gaits; `day` holds the traits as they are in this clip.
struct Performer {
  Gait walk, jog;
  Style day;

  Performer(const Subject& s, Random& random) {
    for (std::size_t i = 0; i < day.size(); ++i) day[i] = s.style[i] + 0.25 * random.normal();
    const double speed = 1 + 0.04 * random.normal(), cadence = 1 + 0.015 * random.normal();
    const double root = std::sqrt(s.body.leg_scale);
    walk = walking(), jog = jogging();
    for (Gait* g : {&walk, &jog}) {
      const bool walks = g == &walk;
      Gait& n = *g;
      // Equal Froude number for every leg length; a faster walker takes both longer and quicker steps.
      const double pace = (walks ? s.walk_speed : s.jog_speed) * speed;
      n[kSpeed] *= pace * root;
      n[kCadence] *= (walks ? s.walk_cadence : s.jog_cadence) * cadence * std::pow(pace, walks ? 0.5 : 0.3) / root;
      for (const Number i : {kStepWidth, kBallAhead, kSurge, kSwingLift1, kSwingLift2, kSwingLift3, kSwingLift4})
        n[i] *= s.body.leg_scale;
      for (const Number i : {kBobCos, kBobSin}) n[i] *= s.body.leg_scale * s.bounce * std::pow(pace, walks ? 0.6 : 0.3);
      n[kStepWidth] *= s.step_width;
      n[kToeOut] += s.toe_out * 360 / kTau;
      for (const Number i : {kStrikePitch, kOffPitch, kSwingPitch1}) n[i] *= s.foot_roll;
      for (const Number i : {kSwingLift1, kSwingLift2}) n[i] *= s.knee_lift;
      n[kSway] *= s.body.leg_scale * std::exp(0.20 * day[kPelvisSway]);
      n[kRollAmplitude] *= std::exp(0.22 * day[kPelvisRoll]);
      n[kYawAmplitude] *= std::exp(0.20 * day[kPelvisYaw]);
      n[kThoraxYawAmplitude] *= std::exp(0.22 * day[kThoraxYaw]);
      n[kSideAmplitude] *= std::exp(0.22 * day[kThoraxSway]);
      n[kAbductionAmplitude] *= std::exp(0.24 * day[kArmWidth]);
      n[kArmAmplitude] *= std::exp(0.20 * day[kArmSwing]);
      n[kElbowAmplitude] *= std::exp(0.22 * day[kElbowSwing]);
      n[kLean] += s.lean * 360 / kTau;
      n[kArmMean] += s.arm_posture * 360 / kTau;
      n[kElbowMean] = std::max(n[kElbowMean] + s.elbow * 360 / kTau, n[kElbowAmplitude] + 5);
      n[kAbduction] = std::max(n[kAbduction] + s.arm_abduction * 360 / kTau, n[kAbductionAmplitude] + 2);
    }
  }
  Gait at(double jogging) const { return jogging <= 0 ? walk : jogging >= 1 ? jog : mixed(walk, jog, jogging); }
};

// The course of the clip on a grid of times with a margin before and after, so that every step has its neighbours.
struct Course {
  double rate, margin;
  std::vector<double> phase, heading;
  std::vector<Vector2> place;

  double time(std::size_t i) const { return static_cast<double>(i) / rate - margin; }
  std::size_t size() const { return phase.size(); }
  double time_of_phase(double wanted) const {
    const auto next = std::upper_bound(phase.begin(), phase.end(), wanted);
    const auto i = static_cast<std::size_t>(
        std::clamp<std::ptrdiff_t>(next - phase.begin(), 1, static_cast<std::ptrdiff_t>(size()) - 1));
    return time(i - 1) + (wanted - phase[i - 1]) / (phase[i] - phase[i - 1]) / rate;
  }
  // Linear between grid points.
  template <class T>
  T at(const std::vector<T>& values, double t) const {
    const double x = std::clamp((t + margin) * rate, 0.0, static_cast<double>(size() - 1) - 1e-9);
    const auto i = static_cast<std::size_t>(x);
    return values[i] + (values[i + 1] - values[i]) * (x - static_cast<double>(i));
  }
};

struct Step {
  double down, flat, rise, off;  // times
  Vector2 ball;
  double yaw;
  Gait gait;
};

// One foot's whole course: steps, and the curves of pitch and lift through stance and swing.
struct FootCourse {
  std::vector<Step> steps;
  KeyCurve pitch;
  std::vector<KeyCurve> lift;  // of the swing after each step
};

FootCourse plan_foot(const Subject& s, int side, const Course& course, const Performer& performer,
                     const KeyCurve& jogging, Random& random) {
  FootCourse foot;
  const double sign = side == 0 ? 1 : -1, shift = side == 0 ? 0 : 0.5 + s.step_asymmetry;
  for (double phase = std::ceil(course.phase.front() - shift) + shift; phase + 1.2 < course.phase.back(); phase += 1) {
    Step step;
    step.down = course.time_of_phase(phase);
    step.gait = performer.at(jogging(step.down));
    step.off = course.time_of_phase(phase + step.gait[kDuty]);
    const double middle = (step.down + step.off) / 2, heading = course.at(course.heading, middle);
    const double ahead = step.gait[kBallAhead] + 0.008 * random.normal();
    const double aside = sign * step.gait[kStepWidth] / 2 + 0.006 * random.normal();
    step.ball = course.at(course.place, middle) + ahead * Vector2(std::cos(heading), std::sin(heading)) +
                aside * Vector2(-std::sin(heading), std::cos(heading));
    step.yaw = heading + sign * radians(step.gait[kToeOut]) + radians(1.0) * random.normal();
    step.flat = mix(step.down, step.off, step.gait[kFlatAt]);
    step.rise = mix(step.down, step.off, step.gait[kRiseAt]);
    foot.steps.push_back(step);
  }
  for (std::size_t i = 0; i + 1 < foot.steps.size(); ++i) {
    const Step &now = foot.steps[i], &next = foot.steps[i + 1];
    const Gait& g = now.gait;
    foot.pitch.add(now.down, radians(g[kStrikePitch]));
    foot.pitch.add(now.flat, 0);
    foot.pitch.add(now.rise, 0);
    foot.pitch.add(mix(now.rise, now.off, 0.55), radians(0.28 * g[kOffPitch]));
    foot.pitch.add(now.off, radians(g[kOffPitch]));
    KeyCurve lift;
    lift.add(now.off, 0);
    for (std::size_t k = 0; k < kSwingTimes.size(); ++k) {
      const double t = mix(now.off, next.down, kSwingTimes[k]);
      foot.pitch.add(t, radians(g[kSwingPitch1 + k]));
      lift.add(t, g[kSwingLift1 + k]);
    }
    lift.add(next.down,
             standing_foot(s.body, {0, 0}, 0, radians(next.gait[kStrikePitch])).ball.z() - s.body.ball_height);
    lift.finish();
    foot.lift.push_back(std::move(lift));
  }
  foot.pitch.finish();
  return foot;
}

FootState foot_at(const FootCourse& foot, const BodyPlan& body, double t) {
  const auto after =
      std::upper_bound(foot.steps.begin(), foot.steps.end(), t, [](double x, const Step& s) { return x < s.down; });
  const auto i = static_cast<std::size_t>(
      std::clamp<std::ptrdiff_t>(after - foot.steps.begin() - 1, 0, static_cast<std::ptrdiff_t>(foot.lift.size()) - 1));
  const Step &now = foot.steps[i], &next = foot.steps[i + 1];
  const double pitch = foot.pitch(t);
  if (t < now.off) {
    FootState f = standing_foot(body, now.ball, now.yaw, pitch);
    f.planted = t >= now.flat;
    return f;
  }
  const double u = (t - now.off) / (next.down - now.off);
  // The foot still moves forwards when it comes down: the hip must not overtake it.
  const double go = smoothstep(u) + kLandingSpeed * u * u * (u - 1);
  const double yaw = now.yaw + wrap_angle(next.yaw - now.yaw) * go;
  const Vector3 from = standing_foot(body, now.ball, now.yaw, 0).ball;
  const Vector3 to = standing_foot(body, next.ball, next.yaw, radians(next.gait[kStrikePitch])).ball;
  FootState f;
  f.yaw = yaw;
  f.pitch = pitch;
  f.ball = from + go * (to - from);
  f.ball.z() = body.ball_height + foot.lift[i](t);
  // The toes straighten while the foot lifts; until then they must not dip into the ground.
  const double toe_length = body.skeleton->end_sites.back().offset.x();
  f.toe = std::max(radians(-now.gait[kOffPitch]) * (1 - smoothstep(u / 0.45)),
                   -pitch - std::asin(std::min(1.0, 0.8 * foot.lift[i](t) / toe_length)));
  return f;
}

}  // namespace

GaitPlan GaitPlan::steady(bool jogging) {
  GaitPlan plan;
  plan.jogging.add(0, jogging ? 1 : 0);
  plan.jogging.finish();
  return plan;
}

GaitPlan GaitPlan::walk_jog_walk(Random& random, double seconds, double rate_hz) {
  const double up = seconds * random.uniform(0.25, 0.38), down = seconds * random.uniform(0.62, 0.75);
  const double change = std::min(0.75, 0.1 * seconds) * random.uniform(0.85, 1.15);  // half the duration of a change
  GaitPlan plan;
  plan.jogging.add(up - change, 0);
  plan.jogging.add(up + change, 1);
  plan.jogging.add(down - change, 1);
  plan.jogging.add(down + change, 0);
  plan.jogging.finish();
  const auto frame = [&](double t) { return static_cast<std::int64_t>(std::lround(t * rate_hz)); };
  const std::int64_t first = frame(up), second = frame(down), end = frame(seconds);
  plan.segments = {{0, first, {{"action", "walking"}}},
                   {first, second - first, {{"action", "jogging"}}},
                   {second, end - second, {{"action", "walking"}}}};
  return plan;
}

Clip make_gait(const Subject& subject, const GaitPlan& plan, Random& random, std::size_t frames, double rate_hz) {
  const BodyPlan& body = subject.body;
  const Performer performer(subject, random);
  const Style& day = performer.day;
  const SlowNoise cadence(random), speed(random), turn(random, 0.03, 0.15), arms(random), trunk(random), look(random),
      bend(random), wide(random);
  const double turning = radians(5) * random.normal(), heading0 = random.uniform(-std::numbers::pi, std::numbers::pi);
  const Vector2 start(random.uniform(-3, 3), random.uniform(-3, 3));
  const double phase0 = random.uniform();

  Course course;
  course.rate = rate_hz;
  course.margin = 3.0;
  const auto before = static_cast<std::size_t>(std::lround(course.margin * rate_hz));
  const std::size_t grid = frames + 2 * before;
  Vector2 place = start;
  double phase = phase0 - 4;
  for (std::size_t i = 0; i < grid; ++i) {
    const double t = course.time(i), heading = heading0 + plan.turning * (turning * t + radians(9) * turn(t));
    const Gait g = performer.at(plan.jogging(t));
    course.phase.push_back(phase);
    course.heading.push_back(heading);
    course.place.push_back(place);
    phase += g[kCadence] * (1 + 0.015 * cadence(t)) / rate_hz;
    place += g[kSpeed] * (1 + 0.03 * speed(t)) / rate_hz * Vector2(std::cos(heading), std::sin(heading));
  }
  const FootCourse feet[2] = {plan_foot(subject, 0, course, performer, plan.jogging, random),
                              plan_foot(subject, 1, course, performer, plan.jogging, random)};

  std::vector<BodyState> states(grid);
  std::vector<double> deficit(grid, 0.0);
  for (std::size_t i = 0; i < grid; ++i) {
    const double t = course.time(i), p = course.phase[i], heading = course.heading[i];
    const Gait g = performer.at(plan.jogging(t));
    BodyState& s = states[i];
    const double middle = g[kDuty] / 2;
    const double sway = Fourier{0, g[kSway], middle}(p), surge = Fourier{0, 0, 0, g[kSurge], middle + 0.25}(p);
    const Vector2 forward(std::cos(heading), std::sin(heading)), left(-forward.y(), forward.x());
    s.pelvis.head<2>() = course.place[i] + surge * forward + sway * left;
    s.pelvis.z() = body.ankle_height + g[kHipHeight] * body.leg() + body.hip_drop +
                   g[kBobCos] * std::cos(2 * kTau * p) + g[kBobSin] * std::sin(2 * kTau * p);
    const double amount = 1 + 0.06 * trunk(t);
    s.yaw = heading - radians(Fourier{0, g[kYawAmplitude] * amount, 0.02}(p));
    s.roll = radians(Fourier{0, g[kRollAmplitude] * amount, 0.15, 0.15 * g[kRollAmplitude], 0.1}(p));
    s.tilt = radians(Fourier{g[kTilt], 0, 0, g[kTiltAmplitude], 0.08}(p));
    const double thorax = 0.02 + 0.030 * day[kThoraxLag];
    const double thorax_yaw = radians(Fourier{0, g[kThoraxYawAmplitude] * amount, thorax}(p));
    s.twist = thorax_yaw + (heading - s.yaw);
    s.lean = radians(Fourier{g[kLean], 0, 0, 1.0, 0.10}(p) + 0.8 * bend(t));
    s.side = radians(Fourier{0, -g[kSideAmplitude] * amount, 0.15 + 0.6 * (thorax - 0.02)}(p)) - 0.7 * s.roll;
    s.head_pitch = subject.head_pitch - 0.75 * (s.tilt + s.lean) + radians(1.5 * look(t * 0.7));
    s.head_yaw = -0.8 * thorax_yaw + radians(3) * look(t);
    for (int side = 0; side < 2; ++side) {
      ArmState& arm = s.arms[static_cast<std::size_t>(side)];
      const double lag = 0.02 + 0.030 * day[kArmLag], opposite = p + (side == 0 ? 0.5 : 0.0);
      const double gain = subject.side_asymmetry[side] * (1 + 0.10 * arms(t + 7.0 * side));
      arm.swing = radians(Fourier{g[kArmMean], g[kArmAmplitude] * gain, lag, 0.06 * g[kArmAmplitude], lag}(opposite));
      arm.elbow = radians(
          Fourier{g[kElbowMean], g[kElbowAmplitude] * gain, lag + 0.06, 0.15 * g[kElbowAmplitude], lag}(opposite));
      arm.abduction = radians(Fourier{g[kAbduction], -g[kAbductionAmplitude] * gain, lag}(opposite) + 0.8 * wide(t));
      arm.twist = radians(Fourier{g[kTwist], g[kTwistAmplitude] * gain, lag}(opposite));
      s.feet[static_cast<std::size_t>(side)] = foot_at(feet[side], body, t);
    }
    deficit[i] = reach_deficit(body, s);
  }
  // Steps longer than the legs are met by a lower pelvis, smoothly.
  const std::vector<double> sink = smooth_cover(deficit, static_cast<std::size_t>(0.16 * rate_hz));

  Clip clip = empty_clip(body, frames, rate_hz);
  clip.segments = plan.segments;
  for (std::size_t t = 0; t < frames; ++t) {
    BodyState& s = states[t + before];
    s.pelvis.z() -= sink[t + before];
    put_frame(body, s, t, clip);
  }
  make_sign_continuous(clip);
  return clip;
}

}  // namespace mocap::corpus
