#include <algorithm>
#include <cmath>

#include "libmocap/corpus/planning.hpp"
#include "libmocap/corpus/scripted.hpp"
#include "libmocap/corpus/stance.hpp"

namespace mocap::corpus {
namespace {

// One lift: when its phases end, how deep the body goes and where the box is.
struct Lift {
  double down, grasp, up, hold, lower, release, rise;  // durations
  double squat, drop, back, lean, twist;
  double half_box, ahead, chest_ahead, chest_drop, sway, arm_lag, trunk_lag, knee_in, pull;
  double duration() const { return down + grasp + up + hold + lower + release + rise; }
};

Lift draw_lift(const Subject& s, const Stance& stance, double habit, Random& random) {
  const auto vary = [&](double spread) { return 1 + spread * std::clamp(random.normal(), -2.0, 2.0); };
  Lift l{};
  const double pace = s.tempo * vary(0.08);
  l.down = 1.15 * pace * vary(0.08);
  l.grasp = random.uniform(0.25, 0.5);
  l.up = 1.25 * pace * vary(0.08);
  l.hold = random.uniform(0.4, 1.3);
  l.lower = 1.25 * pace * vary(0.08);
  l.release = random.uniform(0.2, 0.45);
  l.rise = 1.05 * pace * vary(0.08);
  l.squat = std::clamp(habit + 0.08 * random.normal(), 0.0, 1.0);
  l.drop = mix(0.14, 0.44, l.squat) * s.body.leg() * vary(0.05);
  l.back = mix(0.15, 0.13, l.squat) * s.body.leg_scale;
  l.lean = radians(mix(92, 62, l.squat)) * vary(0.04);
  l.twist = radians(3.0) * std::exp(0.24 * stance.day[kThoraxYaw]) * (random.uniform() < 0.5 ? -1 : 1);
  l.half_box = random.uniform(0.14, 0.22);
  l.ahead = random.uniform(0.10, 0.22);
  l.chest_ahead = random.uniform(0.50, 0.60);
  l.chest_drop = random.uniform(0.42, 0.58);
  l.sway = 0.018 * std::exp(0.25 * stance.day[kPelvisSway]) * (random.uniform() < 0.5 ? -1 : 1);
  l.arm_lag = 0.045 * stance.day[kArmLag];
  l.trunk_lag = 0.055 * stance.day[kThoraxLag];
  l.knee_in = radians(6) * std::exp(0.25 * stance.day[kPelvisRoll]);
  l.pull = 0.05 * std::exp(0.25 * stance.day[kElbowSwing]) * s.body.arm_scale;
  return l;
}

struct LiftCurves {
  Lift l;
  double end;
  QuinticPath depth;           // 0 upright, 1 at the box
  QuinticPath trunk;           // the same for the trunk, which leads or lags
  QuinticPath hands;           // 0 hanging, 1 on the box or at the chest
  QuinticPath carry;           // 0 box on the floor, 1 at the chest
  KeyCurve sway, turn, knees;  // -1 to 1
  Vector3 box[2];              // handles on the floor, world

  LiftCurves(const Subject& s, const Stance& stance, const Lift& lift) : l(lift) {
    const double t1 = l.down, t2 = t1 + l.grasp, t3 = t2 + l.up, t4 = t3 + l.hold, t5 = t4 + l.lower,
                 t6 = t5 + l.release;
    end = t6 + l.rise;
    const auto both = [&](QuinticPath& p, double lag) {
      p.add(0, 0);
      p.add(t1 + lag, 1);
      p.add(t2 + lag, 1);
      p.add(t3 + lag, 0);
      p.add(t4 + lag, 0);
      p.add(t5 + lag, 1);
      p.add(t6 + lag, 1);
      p.add(end, 0);
    };
    both(depth, 0);
    both(trunk, l.trunk_lag);
    // The hands close on the box when the body is down, and let go after it has been put down.
    hands.add(0.35 * t1, 0);
    hands.add(t1, 1);
    hands.add(t6, 1);
    hands.add(mix(t6, end, 0.65), 0);
    const double lag = 0.12 + l.arm_lag;
    carry.add(t2, 0);
    carry.add(t3 + lag, 1);
    carry.add(t4 + 0.5 * lag, 1);
    carry.add(t5, 0);
    for (const auto& [t, v] : {std::pair{0.0, 0.0},
                               {0.6 * t1, 1.0},
                               {t2, -0.4},
                               {mix(t2, t3, 0.6), -1.0},
                               {t4, 0.5},
                               {mix(t4, t5, 0.6), 1.0},
                               {t6, 0.2},
                               {end, 0.0}})
      sway.add(t, v);
    sway.finish();
    // What a trait adds swings about zero, so that it shows in the course of the lift and hardly in its mean.
    for (const auto& [t, v] : {std::pair{0.0, 0.0},
                               {0.5 * t1, -1.0},
                               {t2, 1.0},
                               {t3, -1.0},
                               {t4, 1.0},
                               {t5, -1.0},
                               {mix(t6, end, 0.5), 1.0},
                               {end, 0.0}})
      turn.add(t, v);
    turn.finish();
    for (const auto& [t, v] : {std::pair{0.0, 0.0},
                               {0.5 * t1, -0.6},
                               {t2, 0.3},
                               {mix(t2, t3, 0.5), 1.0},
                               {t3, 0.0},
                               {t4, 0.0},
                               {mix(t4, t5, 0.5), -1.0},
                               {t6, 0.4},
                               {mix(t6, end, 0.5), 0.6},
                               {end, 0.0}})
      knees.add(t, v);
    knees.finish();
    place_box(s, stance);
  }

  // Everything but the arms.
  BodyState posture(const Subject& s, const Stance& stance, double t, double clock) const {
    BodyState b = stance.upright(s, clock);
    const double d = depth(t), bend = trunk(t) * l.lean, w = sway(t);
    b.pelvis.z() -= d * l.drop;
    b.pelvis.head<2>() += -d * l.back * stance.forward() + w * l.sway * stance.left();
    const double share = mix(0.62, 0.55, l.squat);  // of the pelvis in the bend
    b.tilt += share * bend;
    b.lean += (1 - share) * bend;
    b.head_pitch -= 0.42 * bend;
    b.knee_in = knees(t) * l.knee_in;
    const double yaw = radians(2.2) * std::exp(0.25 * stance.day[kPelvisYaw]) * w;
    b.yaw += yaw;
    b.twist += turn(t) * l.twist - yaw;
    b.side += radians(2.4) * w * std::exp(0.25 * stance.day[kThoraxSway]);
    // Holding a weight: lean back a little.
    b.lean -= radians(5) * carry(t);
    return b;
  }

  // Where hanging arms meet the box at the lowest point: in reach by construction.
  void place_box(const Subject& s, const Stance& stance) {
    BodyState b = posture(s, stance, l.down + 0.5 * l.grasp, 0);
    Pose pose = world(s.body, b);
    const Vector3 middle = (pose.positions[kLeftShoulder] + pose.positions[kRightShoulder]) / 2;
    const double arm =
        s.body.skeleton->rest_offsets[kLeftElbow].norm() + s.body.skeleton->rest_offsets[kLeftWrist].norm();
    const double aside = l.half_box - (pose.positions[kLeftShoulder] - pose.positions[kRightShoulder]).norm() / 2;
    const double length = 0.965 * arm, ahead = l.ahead * s.body.arm_scale;
    const double below = std::sqrt(std::max(0.04, length * length - aside * aside - ahead * ahead));
    for (int side = 0; side < 2; ++side) {
      const Vector2 p = middle.head<2>() + ahead * stance.forward() + (side == 0 ? 1 : -1) * l.half_box * stance.left();
      box[side] = Vector3(p.x(), p.y(), std::max(0.14, middle.z() - below));
    }
  }

  static Pose world(const BodyPlan& body, const BodyState& b) {
    std::array<Quaternion, kJoints> local;
    Pose pose;
    pose_body(body, b, local);
    forward_kinematics(*body.skeleton, local, b.pelvis, pose);
    return pose;
  }

  BodyState state(const Subject& s, const Stance& stance, double t, double clock) const {
    BodyState b = posture(s, stance, t, clock);
    const double hold = hands(t), up = carry(t);
    // Free arms hang from the bent trunk.
    for (ArmState& arm : b.arms) arm.swing += 0.85 * trunk(t) * l.lean;
    if (hold <= 0) return b;
    const Pose pose = world(s.body, b);
    const Vector3 middle = (pose.positions[kLeftShoulder] + pose.positions[kRightShoulder]) / 2;
    const double arm_length =
        s.body.skeleton->rest_offsets[kLeftElbow].norm() + s.body.skeleton->rest_offsets[kLeftWrist].norm();
    const Vector2 across = (pose.positions[kLeftShoulder] - pose.positions[kRightShoulder]).head<2>().normalized();
    const Vector2 ahead(across.y(), -across.x());
    for (int side = 0; side < 2; ++side) {
      Vector3 chest = middle;
      chest.head<2>() += l.chest_ahead * arm_length * ahead + (side == 0 ? 1 : -1) * l.half_box * across;
      chest.z() -= l.chest_drop * arm_length;
      ArmState& arm = b.arms[static_cast<std::size_t>(side)];
      arm.reach = hold;
      arm.hand = box[side] + up * (chest - box[side]);
      // The box comes up close to the body.
      arm.hand.head<2>() -= 4 * up * (1 - up) * l.pull * ahead;
      arm.elbow_out = radians(15) + radians(16) * std::exp(0.24 * stance.day[kArmWidth]) * turn(t);
    }
    return b;
  }
};

}  // namespace

Clip make_lifting(const Subject& subject, Random& random, std::size_t frames, double rate_hz) {
  const Stance stance(subject, random);
  const double seconds = static_cast<double>(frames) / rate_hz;
  std::vector<Lift> lifts;
  std::vector<double> durations;
  double total = 0;
  while (total < seconds) {
    lifts.push_back(draw_lift(subject, stance, subject.squat, random));
    durations.push_back(lifts.back().duration());
    total += durations.back();
  }
  const std::vector<double> starts = schedule(durations, seconds, 0.25, random);
  std::vector<LiftCurves> curves;
  for (std::size_t i = 0; i < starts.size(); ++i) curves.emplace_back(subject, stance, lifts[i]);

  Clip clip = empty_clip(subject.body, frames, rate_hz);
  std::size_t current = 0;
  for (std::size_t f = 0; f < frames; ++f) {
    const double t = static_cast<double>(f) / rate_hz;
    while (current < starts.size() && t >= starts[current] + curves[current].end) ++current;
    const bool busy = current < starts.size() && t > starts[current];
    put_frame(subject.body,
              busy ? curves[current].state(subject, stance, t - starts[current], t) : stance.upright(subject, t), f,
              clip);
  }
  make_sign_continuous(clip);
  return clip;
}

}  // namespace mocap::corpus
