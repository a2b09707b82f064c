#include "libmocap/corpus/subject.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "libmocap/corpus/curves.hpp"
#include "libmocap/skeleton/canonical_body.hpp"

namespace mocap::corpus {
namespace {

// A normal number kept within 2.3 standard deviations: nobody in the corpus is out of proportion.
double bounded_normal(Random& random) {
  while (true) {
    const double x = random.normal();
    if (std::abs(x) < 2.3) return x;
  }
}

}  // namespace

std::string text(Gender gender) { return gender == Gender::female ? "female" : "male"; }

std::uint64_t subject_stream(Gender gender, int number) {
  return (gender == Gender::female ? 0x100000000ULL : 0x200000000ULL) + static_cast<std::uint64_t>(number);
}

BodyPlan make_body(double stature, double leg_ratio, double trunk_ratio, double arm_ratio, double shoulder_ratio,
                   double hip_ratio) {
  Skeleton s = *canonical_body();
  const double size = stature / 1.70, leg = size * leg_ratio, trunk = size * trunk_ratio, arm = size * arm_ratio;
  const auto scale = [&](std::initializer_list<int> joints, double x, double y, double z) {
    for (const int j : joints)
      s.rest_offsets[static_cast<std::size_t>(j)] =
          s.rest_offsets[static_cast<std::size_t>(j)].cwiseProduct(Vector3(x, y, z));
  };
  scale({kLeftHip, kRightHip}, leg, size * hip_ratio, leg);
  scale({kLeftKnee, kRightKnee, kLeftAnkle, kRightAnkle, kLeftFoot, kRightFoot}, leg, leg, leg);
  scale({kSpine1, kSpine2, kSpine3, kNeck, kHead}, trunk, trunk, trunk);
  scale({kLeftCollar, kRightCollar, kLeftShoulder, kRightShoulder}, trunk, size * shoulder_ratio, trunk);
  scale({kLeftElbow, kRightElbow, kLeftWrist, kRightWrist}, arm, arm, arm);
  for (auto& e : s.end_sites)
    e.offset *= e.parent == kHead ? trunk : e.parent == kLeftFoot || e.parent == kRightFoot ? leg : arm;

  BodyPlan b;
  b.stature = stature;
  b.leg_scale = leg;
  b.arm_scale = arm;
  b.thigh = s.rest_offsets[kLeftKnee].norm();
  b.shank = s.rest_offsets[kLeftAnkle].norm();
  b.ankle_to_ball = s.rest_offsets[kLeftFoot];
  b.ankle_height = kAnkleSoleHeight * leg;
  b.ball_height = kFootSoleHeight * leg;
  b.heel_back = 0.048 * leg;
  b.hip_half_width = s.rest_offsets[kLeftHip].y();
  b.hip_drop = -s.rest_offsets[kLeftHip].z();
  b.skeleton = std::make_shared<const Skeleton>(std::move(s));
  return b;
}

Subject draw_subject(std::uint64_t seed, Gender gender, int number) {
  Random random(seed, stream_of(subject_stream(gender, number), 0));
  const bool female = gender == Gender::female;
  const auto factor = [&](double spread) { return 1 + spread * bounded_normal(random); };
  Subject s;
  s.gender = gender;
  s.number = number;
  s.name = fmt::format("{}{:03d}", female ? 'f' : 'm', number);

  // Bodies differ far less between the genders than within them, so that no length tells the label.
  const double stature = (female ? 1.685 : 1.715) + 0.07 * bounded_normal(random);
  const double leg = factor(0.02), trunk = 1 - 0.6 * (leg - 1) + 0.01 * bounded_normal(random), arm = factor(0.025);
  const double shoulder = (female ? 0.99 : 1.01) + 0.05 * bounded_normal(random);
  const double hip = (female ? 1.01 : 0.99) + 0.06 * bounded_normal(random);
  s.body = make_body(stature, leg, trunk, arm, shoulder, hip);

  for (std::size_t i = 0; i < s.style.size(); ++i) {
    const double side = (i < kThoraxYaw) == female ? 0.5 : -0.5;
    s.style[i] = bounded_normal(random) + side * kGenderShift;
  }
  s.walk_speed = factor(0.10);
  s.walk_cadence = factor(0.04);
  s.jog_speed = factor(0.09);
  s.jog_cadence = s.walk_cadence + 0.02 * bounded_normal(random);
  s.step_width = factor(0.2);
  s.bounce = factor(0.12);
  s.foot_roll = factor(0.10);
  s.knee_lift = factor(0.10);
  s.lean = radians(2.5) * bounded_normal(random);
  s.head_pitch = radians(4) * bounded_normal(random);
  s.toe_out = radians(3.5) * bounded_normal(random);
  s.arm_abduction = radians(2.5) * bounded_normal(random);
  s.elbow = radians(6) * bounded_normal(random);
  s.arm_posture = radians(4) * bounded_normal(random);
  for (double& side : s.side_asymmetry) side = factor(0.05);
  s.step_asymmetry = 0.008 * bounded_normal(random);
  s.squat = random.uniform(0.05, 0.95);
  s.jump_height = std::max(0.10, 0.25 * factor(0.22));
  s.crouch = 0.30 * factor(0.15);
  s.tempo = factor(0.10);
  return s;
}

}  // namespace mocap::corpus
