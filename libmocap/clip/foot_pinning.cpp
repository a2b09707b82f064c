#include "libmocap/clip/foot_pinning.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "libmocap/base/error.hpp"
#include "libmocap/skeleton/rest_pose.hpp"

namespace mocap {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
// Toes above the heel, radians: between these the toe base takes over from the heel; and with the heel so far above the toes it alone is down. On Bandai-Namco's
// walks and runs and CMU's clips heel and toe base are about equally slow between them; beyond, the one that is down is the slower.
constexpr double kOnHeel = 10 * kDegree, kNearlyFlat = 3 * kDegree, kOnToes = -10 * kDegree;
constexpr double kTurns = 0.10;       // m/s between heel and toe: a flat foot that turns faster is held where it turns
constexpr double kStands = 0.05;      // m/s: frames much faster count little for where a run should be
constexpr double kFree = 0.15, kFurthest = 0.30;  // metres: corrections beyond the first are taken ever shorter, and never attain the second
constexpr double kMostExcess = 0.02;  // metres by which a correction may grow after a foot let go, however fast it was
constexpr double kMostPull = 0.005;   // metres by which a foot is pulled down: more than it trembles, less than is seen
constexpr double kMostLift = 0.05;    // metres by which a foot is lifted out of the ground: deeper, the ground is not where it stands
constexpr double kBothDown = 0.004;   // metres: heel and toe less far apart in height share the ground
// Shares of a leg's full length: from the first on its knee moves much for little, beyond the second the root sinks, within the third of 1 reach goes ever slower.
constexpr double kBent = 0.97, kStraight = 0.99, kSoft = 0.005;
constexpr double kReluctance = 0.25;  // weight of a root that stays where it is, that of a straight leg being 1
constexpr double kSlanting = 0.5, kUpright = 0.7;  // height of a leg by its length: between these the root begins to make up for its reach
constexpr double kOwnPlane = 0.15;    // sine of the knee's bend from which its own plane counts more than that of the whole clip
constexpr double kMissed = 1e-3;      // metres

using Path = std::vector<Vector3>;

double smoothstep(double x) {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * (3 - 2 * x);
}

struct Run {  // frames first..last in which a foot is down
  std::size_t first, last;
};

struct Leg {
  std::size_t hip, knee, ankle, toe;
  // Of each frame.
  Path hip_place, ankle_place, toe_place, heel_place;
  std::vector<double> length, lift;  // of thigh and shank together, metres; of the toes above the heel, radians
  Vector3 hinge = Vector3::Zero();   // about which the knee bends, in the frame of the hip
  std::vector<Run> runs;
  Path correction;
  std::vector<double> held;  // 1 in runs, 0 where nothing is corrected
  std::vector<double> lost;  // of the correction because it was too long, metres
};

Leg leg_of(const Skeleton& skeleton, const std::string& side, const std::string& clip) {
  const auto joint = [&](const char* part) {
    const int j = skeleton.find_role(side + part);
    if (j < 0) refuse({{}, 0, "clip " + clip}, "a skeleton without the role " + side + part + ", expected hip, knee, ankle and foot of both sides");
    return static_cast<std::size_t>(j);
  };
  Leg leg{};
  leg.hip = joint("hip"), leg.knee = joint("knee"), leg.ankle = joint("ankle"), leg.toe = joint("foot");
  const auto below = [&](std::size_t j, std::size_t above) {
    for (int p = skeleton.parents[j]; p >= 0; p = skeleton.parents[static_cast<std::size_t>(p)])
      if (static_cast<std::size_t>(p) == above) return true;
    return false;
  };
  const auto in_line = [&](std::size_t j, std::size_t above, const char* part, const char* from) {
    if (!below(j, above)) refuse({{}, 0, "clip " + clip}, "joint " + skeleton.joint_names[j] + " as " + side + part + ", expected it below " + side + from);
  };
  in_line(leg.knee, leg.hip, "knee", "hip");
  in_line(leg.ankle, leg.knee, "ankle", "knee");
  if (leg.toe != leg.ankle) in_line(leg.toe, leg.ankle, "foot", "ankle");  // rigs without toes have the ankle as their foot
  return leg;
}

// Places of the legs' joints in all frames, and the axes about which the knees bend: of all frames, weighted by the sine of the bend. Where that is
// little - straight, or a little backwards - it is about the line from the right hip to the left.
void follow(const Clip& clip, std::array<Leg, 2>& legs) {
  constexpr double kLittle = 0.15;
  const SoleHeights sole = sole_heights(*clip.skeleton);
  Pose pose;
  for (std::size_t t = 0; t < clip.frames(); ++t) {
    world_pose(clip, t, pose);
    const auto& p = pose.positions;
    const Vector3 across = (p[legs[0].hip] - p[legs[1].hip]).stableNormalized();
    for (Leg& leg : legs) {
      const Vector3 thigh = p[leg.knee] - p[leg.hip], shank = p[leg.ankle] - p[leg.knee], foot = p[leg.toe] - p[leg.ankle];
      leg.hinge += pose.rotations[leg.hip].conjugate() * (thigh.stableNormalized().cross(shank.stableNormalized()) + kLittle * across);
      leg.hip_place.push_back(p[leg.hip]);
      leg.ankle_place.push_back(p[leg.ankle]);
      leg.toe_place.push_back(p[leg.toe]);
      leg.length.push_back(thigh.norm() + shank.norm());
      // On a flat foot the toe base lies below the ankle by as much as their heights above the sole differ. Read from places alone this takes any rig.
      const double size = foot.norm(), fall = size > 1e-6 ? std::asin(std::clamp((sole.ankle - sole.toe) / size, -1.0, 1.0)) : 0;
      const double lift = size > 1e-6 ? std::asin(std::clamp(foot.z() / size, -1.0, 1.0)) + fall : 0;
      const Vector3 ahead = Vector3(foot.x(), foot.y(), 0).stableNormalized();
      leg.lift.push_back(lift);
      leg.heel_place.push_back(p[leg.ankle] + sole.ankle * (std::sin(lift) * ahead - std::cos(lift) * Vector3::UnitZ()));
    }
  }
  for (Leg& leg : legs) {
    leg.hinge.stableNormalize();
    for (Vector3& toe : leg.toe_place) toe.z() -= leg.toe == leg.ankle ? sole.ankle : sole.toe;
  }
}

// Share of the toe base in the point that is to stand still from t to t+1.
double toe_share(const Leg& leg, std::size_t t, double rate_hz) {
  const double lift = (leg.lift[t] + leg.lift[t + 1]) / 2;
  const double off_heel = smoothstep((kOnHeel - lift) / (kOnHeel - kNearlyFlat)), on_toes = smoothstep(lift / kOnToes);
  const Vector2 heel = rate_hz * (leg.heel_place[t + 1] - leg.heel_place[t]).head<2>(), toe = rate_hz * (leg.toe_place[t + 1] - leg.toe_place[t]).head<2>();
  // Least |(1 - s) heel + s toe|^2 + kTurns^2 (1 - s)^2.
  const double slowest = std::clamp((heel.dot(heel - toe) + kTurns * kTurns) / ((heel - toe).squaredNorm() + kTurns * kTurns), 0.0, 1.0);
  return off_heel * (on_toes + (1 - on_toes) * slowest);
}

// The lower of heel and toe above the ground, without a kink where one takes over from the other.
double sole_height(const Leg& leg, std::size_t t) {
  const double heel = leg.heel_place[t].z(), toe = leg.toe_place[t].z();
  return (heel + toe + kBothDown - std::hypot(heel - toe, kBothDown)) / 2;
}

// Corrections within a run, horizontally counted from its first frame; returns their mean, by which the run had best be shifted back. Frames in which the
// foot stands count most: where it slides in and then stands, it stands where it stood.
Vector2 hold_still(Leg& leg, const Run& run, double rate_hz) {
  std::vector<double> height, step;
  for (std::size_t t = run.first; t <= run.last; ++t) {
    height.push_back(sole_height(leg, t));
    if (t == run.last) break;
    const double s = toe_share(leg, t, rate_hz);
    const Vector2 moved = ((1 - s) * (leg.heel_place[t + 1] - leg.heel_place[t]) + s * (leg.toe_place[t + 1] - leg.toe_place[t])).head<2>();
    leg.correction[t + 1].head<2>() = leg.correction[t].head<2>() - moved;
    step.push_back(rate_hz * moved.norm());
  }
  std::vector<double> sorted = height;
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2), sorted.end());
  const double middle = sorted[sorted.size() / 2], level = middle < 0 ? std::min(0.0, middle + kMostLift) : middle;
  Vector2 sum = Vector2::Zero();
  double weights = 0;
  for (std::size_t i = 0; i < height.size(); ++i) {
    const std::size_t t = run.first + i;
    const double above = height[i] - level;
    leg.correction[t].z() = above > 0 ? -kMostPull * std::tanh(above / kMostPull) : std::min(-above, kMostLift);
    leg.held[t] = 1;
    double speed = step.empty() ? 0 : step[std::min(i, step.size() - 1)];
    if (i > 0) speed = std::min(speed, step[i - 1]);
    const double weight = 1 / (speed * speed + kStands * kStands);
    sum += weight * leg.correction[t].head<2>();
    weights += weight;
  }
  return sum / weights;
}

// The shifts of all runs: least sum of duration/blend^4 |mean + shift|^2 over runs and |jump|^2/gap^3 over the gaps too short to fade out and in, where jump
// is what c has to make up there: a cubic that makes up d in T seconds has a mean square acceleration of 12 d^2/T^4. Tridiagonal.
void shift_runs(Leg& leg, const std::vector<Vector2>& mean, std::size_t blend) {
  const std::size_t n = leg.runs.size();
  std::vector<double> diagonal(n), coupling(n, 0);
  std::vector<Vector2> right(n);
  for (std::size_t k = 0; k < n; ++k) {
    const double weight = static_cast<double>(leg.runs[k].last - leg.runs[k].first + 1) / std::pow(static_cast<double>(blend), 4);
    diagonal[k] = weight;
    right[k] = -weight * mean[k];
  }
  for (std::size_t k = 0; k + 1 < n; ++k) {
    const std::size_t gap = leg.runs[k + 1].first - leg.runs[k].last;
    if (gap > 2 * blend) continue;
    coupling[k] = 1 / std::pow(static_cast<double>(gap), 3);
    const Vector2 jump = (leg.correction[leg.runs[k + 1].first] - leg.correction[leg.runs[k].last]).head<2>();
    diagonal[k] += coupling[k], diagonal[k + 1] += coupling[k];
    right[k] += coupling[k] * jump, right[k + 1] -= coupling[k] * jump;
  }
  for (std::size_t k = 0; k + 1 < n; ++k) {
    const double factor = coupling[k] / diagonal[k];
    diagonal[k + 1] -= factor * coupling[k];
    right[k + 1] += factor * right[k];
  }
  Vector2 shift = Vector2::Zero();
  for (std::size_t k = n; k-- > 0;) {
    shift = (right[k] + coupling[k] * shift) / diagonal[k];
    for (std::size_t t = leg.runs[k].first; t <= leg.runs[k].last; ++t) leg.correction[t].head<2>() += shift;
  }
}

struct PathEnd {
  Vector3 place = Vector3::Zero(), change = Vector3::Zero();  // metres; metres a frame
};

// The cubic from `a` to `b` in `steps` frames, at frame i. A change alone leads as far as 4/27 of what it makes in that time.
Vector3 cubic(const PathEnd& a, const PathEnd& b, std::size_t steps, std::size_t i) {
  const double n = static_cast<double>(steps), x = static_cast<double>(i) / n, y = 1 - x, fastest = kMostExcess * 27 / 4 / n;
  const auto limited = [&](const Vector3& v) -> Vector3 { return v.norm() > fastest ? v * (fastest / v.norm()) : v; };
  return y * y * (1 + 2 * x) * a.place + x * x * (1 + 2 * y) * b.place + n * x * y * (y * limited(a.change) - x * limited(b.change));
}

// The paths between runs. With them the feet let go, by `held`, and take hold.
void join_runs(Leg& leg, std::size_t blend) {
  const std::size_t frames = leg.correction.size(), n = leg.runs.size();
  const auto end_of = [&](const Run& run) {
    const Vector3& c = leg.correction[run.last];
    return PathEnd{c, run.first == run.last ? Vector3::Zero() : Vector3(c - leg.correction[run.last - 1])};
  };
  const auto start_of = [&](const Run& run) {
    const Vector3& c = leg.correction[run.first];
    return PathEnd{c, run.first == run.last ? Vector3::Zero() : Vector3(leg.correction[run.first + 1] - c)};
  };
  const auto held = [&](std::size_t away) { return 1 - smoothstep(static_cast<double>(away) / static_cast<double>(blend)); };
  for (std::size_t k = 0; k <= n; ++k) {
    const Run *before = k > 0 ? &leg.runs[k - 1] : nullptr, *after = k < n ? &leg.runs[k] : nullptr;
    if (before && after && after->first - before->last <= 2 * blend) {
      const std::size_t gap = after->first - before->last;
      for (std::size_t i = 1; i < gap; ++i) {
        leg.correction[before->last + i] = cubic(end_of(*before), start_of(*after), gap, i);
        leg.held[before->last + i] = held(std::min(i, gap - i));
      }
      continue;
    }
    for (std::size_t i = 1; i < blend; ++i) {
      if (before && before->last + i < frames) {
        leg.correction[before->last + i] = cubic(end_of(*before), {}, blend, i);
        leg.held[before->last + i] = held(i);
      }
      if (after && after->first >= i) {
        leg.correction[after->first - i] = cubic({}, start_of(*after), blend, blend - i);
        leg.held[after->first - i] = held(i);
      }
    }
  }
}

// Who slides across the room with both feet down cannot be held: the feet slide on.
void shorten(Leg& leg) {
  for (const Run& run : leg.runs)
    for (std::size_t t = run.first; t <= run.last; ++t) {
      const double far = leg.correction[t].head<2>().norm();
      if (far <= kFree) continue;
      const double to = kFurthest - (kFurthest - kFree) * std::exp(-(far - kFree) / (kFurthest - kFree));
      leg.correction[t].head<2>() *= to / far;
      leg.lost[t] = far - to;
    }
}

void plan(const Clip& clip, std::size_t foot, Leg& leg, std::size_t blend) {
  leg.correction.assign(clip.frames(), Vector3::Zero());
  leg.held.assign(clip.frames(), 0);
  leg.lost.assign(clip.frames(), 0);
  for (std::size_t t = 0; t < clip.frames(); ++t) {
    if (clip.contacts[t][foot] == 0) continue;
    if (t == 0 || clip.contacts[t - 1][foot] == 0) leg.runs.push_back({t, t});
    leg.runs.back().last = t;
  }
  std::vector<Vector2> mean;
  for (const Run& run : leg.runs) mean.push_back(hold_still(leg, run, clip.frame_rate_hz));
  shift_runs(leg, mean, blend);
  shorten(leg);
  join_runs(leg, blend);
}

// A mean over `blend` frames to either side, weighted by a bell: smooth, and 0 where all of them are 0.
std::vector<double> smoothed(const std::vector<double>& x, std::size_t blend) {
  std::vector<double> out(x.size());
  for (std::size_t t = 0; t < x.size(); ++t) {
    double sum = 0, weights = 0;
    for (std::size_t u = t < blend ? 0 : t - blend; u <= std::min(x.size() - 1, t + blend); ++u) {
      const double away = (static_cast<double>(u) - static_cast<double>(t)) / static_cast<double>(blend + 1), weight = 1 + std::cos(std::numbers::pi * away);
      sum += weight * x[u];
      weights += weight;
    }
    out[t] = sum / weights;
  }
  return out;
}

// By how much the root rises in each frame, up to `most` either way and smoothly. First so that straight legs keep their length: to shorten one by
// 4 millimetres bends its knee by 10 degrees. Then it sinks at least by what legs lack: the largest need of the frames around, averaged over as many,
// is nowhere less than the need.
std::vector<double> root_rise(const std::array<Leg, 2>& legs, std::size_t frames, std::size_t blend, double most) {
  std::vector<double> rise(frames, 0), need(frames, 0), highest(frames, 0);
  // Who lies or sits with a leg along the floor reaches no farther for a lower root.
  const auto steep = [](const Vector3& leg) { return smoothstep((-leg.stableNormalized().z() - kSlanting) / (kUpright - kSlanting)); };
  // Of the root's height at which the ankle is `length` from the hip, above the one it has.
  const auto rise_for = [](const Vector3& wanted, double length) { return wanted.z() + std::sqrt(std::max(0.0, length * length - wanted.head<2>().squaredNorm())); };
  for (std::size_t t = 0; t < frames; ++t) {
    double weights = kReluctance;
    for (const Leg& leg : legs) {
      const Vector3 now = leg.ankle_place[t] - leg.hip_place[t];
      const double weight = leg.held[t] * steep(now) * smoothstep((now.norm() / leg.length[t] - kBent) / (kStraight - kBent));
      if (!(weight > 0)) continue;
      rise[t] += weight * rise_for(now + leg.correction[t], now.norm());
      weights += weight;
    }
    rise[t] = std::clamp(rise[t] / weights, -most / 2, most / 2);
  }
  rise = smoothed(rise, blend);
  for (const Leg& leg : legs)
    for (std::size_t t = 0; t < frames; ++t) {
      if (leg.correction[t].isZero(0)) continue;
      const Vector3 now = leg.ankle_place[t] - leg.hip_place[t], wanted = now + leg.correction[t];
      const double longest = std::max(kStraight * leg.length[t], now.norm());
      if ((wanted - rise[t] * Vector3::UnitZ()).norm() > longest)
        need[t] = std::max(need[t], steep(now) * std::clamp(rise[t] - rise_for(wanted, longest), 0.0, most / 2));
    }
  for (std::size_t t = 0; t < frames; ++t)
    for (std::size_t u = t < blend ? 0 : t - blend; u <= std::min(frames - 1, t + blend); ++u) highest[t] = std::max(highest[t], need[u]);
  highest = smoothed(highest, blend);
  for (std::size_t t = 0; t < frames; ++t) rise[t] -= highest[t];
  return rise;
}

struct Turns {  // in the world, on top of the rotations that thigh and shank have
  Quaternion thigh = Quaternion::Identity(), shank = Quaternion::Identity();
};

// The turns that bring thigh + shank to `wanted`. As reach() in clip/leg_reach.hpp, for bones and a hinge `k` of any direction.
Turns turns_to(const Vector3& thigh, const Vector3& shank, const Vector3& k, const Vector3& wanted, double held) {
  const double full = thigh.norm() + shank.norm(), now = (thigh + shank).norm(), soft = std::max(1e-13, std::min(kSoft * full, full - now));
  double distance = wanted.norm();
  if (distance < 1e-6 || now < 1e-6) return {};
  if (distance > full - soft) distance = full - soft * std::exp(-(distance - (full - soft)) / soft);
  Turns turns;
  const double along = thigh.dot(k) * shank.dot(k), a = thigh.dot(shank) - along, b = thigh.dot(k.cross(shank)), size = std::hypot(a, b);
  if (size > 1e-9 * full * full) {
    const double bent = std::atan2(b, a), product = (distance * distance - thigh.squaredNorm() - shank.squaredNorm()) / 2;
    double angle = bent + std::acos(std::clamp((product - along) / size, -1.0, 1.0));
    // A knee bent backwards would jump to the front from one frame to the next.
    angle -= 2 * (1 - held) * std::max(0.0, bent);
    turns.shank = Quaternion(Eigen::AngleAxisd(angle, k));
  }
  const Vector3 bent = thigh + turns.shank * shank;
  if (bent.norm() < 1e-6) return {};
  turns.thigh = rotation_between(bent, wanted);
  turns.shank = turns.thigh * turns.shank;
  return turns;
}

// Brings the foot of one leg to its place in frame t, the root already moved in `pose`; returns by how much it stays away.
double bring(Clip& clip, std::size_t t, const Leg& leg, const Pose& pose) {
  const auto& p = pose.positions;
  const Vector3 thigh = p[leg.knee] - p[leg.hip], shank = p[leg.ankle] - p[leg.knee];
  const Vector3 common = pose.rotations[leg.hip] * leg.hinge, own = thigh.stableNormalized().cross(shank.stableNormalized());
  const Vector3 hinge = (kOwnPlane * common + smoothstep(own.dot(common) / kOwnPlane) * own).stableNormalized();
  const Vector3 wanted = leg.ankle_place[t] + leg.correction[t] - p[leg.hip];
  const Turns turns = turns_to(thigh, shank, hinge, wanted, leg.held[t]);
  const auto local = clip.frame(t);
  const auto& parents = clip.skeleton->parents;
  const auto set = [&](std::size_t j, const Quaternion& above_it, const Quaternion& world) {
    Quaternion q = (above_it.conjugate() * world).normalized();
    if (q.dot(local[j]) < 0) q.coeffs() *= -1;
    local[j] = q;
  };
  const auto above = [&](std::size_t j) { return parents[j] < 0 ? Quaternion::Identity() : pose.rotations[static_cast<std::size_t>(parents[j])]; };
  set(leg.hip, above(leg.hip), turns.thigh * pose.rotations[leg.hip]);
  set(leg.knee, turns.thigh * above(leg.knee), turns.shank * pose.rotations[leg.knee]);
  set(leg.ankle, turns.shank * above(leg.ankle), pose.rotations[leg.ankle]);
  return (turns.thigh * thigh + turns.shank * shank - wanted).norm();
}

}  // namespace

PinningReport pin_feet(Clip& clip, const PinningOptions& options) {
  if (!(std::isfinite(options.blend_seconds) && options.blend_seconds >= 0)) refuse_usage("blend of " + std::to_string(options.blend_seconds) + " s, expected a finite number of at least 0");
  if (!(std::isfinite(options.most_root) && options.most_root >= 0)) refuse_usage("root shift of " + std::to_string(options.most_root) + " m, expected a finite number of at least 0");
  std::array<Leg, 2> legs = {leg_of(*clip.skeleton, "left_", clip.name), leg_of(*clip.skeleton, "right_", clip.name)};
  if (clip.contacts.size() != clip.frames() || clip.contacts.empty())
    refuse({{}, 0, "clip " + clip.name},
           (clip.contacts.empty() ? "no" : std::to_string(clip.contacts.size()) + " frames of") + std::string(" contact labels, expected them for ") + std::to_string(clip.frames()) +
               " frames: they say when a foot is down");
  const std::size_t frames = clip.frames(), blend = static_cast<std::size_t>(std::clamp(std::round(options.blend_seconds * clip.frame_rate_hz), 1.0, static_cast<double>(frames)));
  PinningReport report;
  follow(clip, legs);
  for (const std::size_t foot : {0, 1}) {
    plan(clip, foot, legs[foot], blend);
    report.runs += legs[foot].runs.size();
  }
  const std::vector<double> rise = root_rise(legs, frames, blend, options.most_root);
  Pose pose;
  for (std::size_t t = 0; t < frames; ++t) {
    const bool moved = rise[t] != 0;
    if (!moved && legs[0].correction[t].isZero(0) && legs[1].correction[t].isZero(0)) {
      for (const Leg& leg : legs) report.frames += leg.held[t] == 1;
      continue;
    }
    clip.root_position[t].z() += rise[t];
    world_pose(clip, t, pose);
    report.largest_root = std::max(report.largest_root, std::abs(rise[t]));
    for (const Leg& leg : legs) {
      report.frames += leg.held[t] == 1;
      if (!moved && leg.correction[t].isZero(0)) continue;
      const double miss = leg.lost[t] + bring(clip, t, leg, pose);
      report.largest_correction = std::max(report.largest_correction, leg.correction[t].norm());
      if (leg.held[t] < 1) continue;
      report.largest_miss = std::max(report.largest_miss, miss);
      report.unreached += miss > kMissed;
    }
  }
  const auto joints = static_cast<std::size_t>(clip.joints());
  for (const Leg& leg : legs)
    for (const std::size_t j : {leg.hip, leg.knee, leg.ankle}) make_sign_continuous(clip.rotations, j, joints, frames);
  return report;
}

}  // namespace mocap
