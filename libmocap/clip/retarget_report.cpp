#include "libmocap/clip/retarget_report.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "libmocap/skeleton/canonical_body.hpp"

namespace mocap {

RetargetReport report_retargeting(const Retargeter& retargeter, const Clip& source, const Clip& result) {
  const auto body = canonical_body();
  const JointMap& map = retargeter.map();
  RetargetReport report;
  struct Pair {
    std::size_t joint, child, source_joint, source_child;
    double sum = 0;
  };
  std::vector<Pair> pairs;
  for (std::size_t c = 1; c < 22; ++c) {
    const auto p = static_cast<std::size_t>(body->parents[c]);
    if (map.source[c] < 0 || map.source[p] < 0) continue;
    pairs.push_back({p, c, static_cast<std::size_t>(map.source[p]), static_cast<std::size_t>(map.source[c])});
    report.bones.push_back({body->joint_names[p], body->joint_names[c], source.skeleton->joint_names[pairs.back().source_joint]});
  }
  // The result may have been turned to face forward: directions and velocities are compared in the source's heading.
  const Quaternion back = yaw_rotation(result.source.yaw - source.source.yaw);
  Pose theirs, ours;
  std::array<Vector3, 2> their_foot, our_foot;
  std::array<std::size_t, 2> theirs_at{}, ours_at{};
  for (const std::size_t k : {0, 1}) {
    const std::string p = k == 0 ? "left_" : "right_";
    const bool toe = map.source_of(p + "foot") >= 0;
    report.feet[k].joint = p + (toe ? "foot" : "ankle");
    theirs_at[k] = static_cast<std::size_t>(map.source_of(report.feet[k].joint));
    ours_at[k] = static_cast<std::size_t>(body->find(report.feet[k].joint));
  }
  const std::size_t frames = std::min(source.frames(), result.frames());
  for (std::size_t t = 0; t < frames; ++t) {
    world_pose(source, t, theirs);
    world_pose(result, t, ours);
    for (std::size_t b = 0; b < pairs.size(); ++b) {
      const Vector3 v = theirs.positions[pairs[b].source_child] - theirs.positions[pairs[b].source_joint], w = back * (ours.positions[pairs[b].child] - ours.positions[pairs[b].joint]);
      if (v.norm() < 1e-6) continue;
      const double angle = std::atan2(v.cross(w).norm(), v.dot(w)) * 180 / std::numbers::pi;
      pairs[b].sum += angle;
      if (angle > report.bones[b].worst_deg) report.bones[b].worst_deg = angle, report.bones[b].worst_frame = t;
    }
    for (const std::size_t k : {0, 1}) {
      const Vector3 a = retargeter.scale() * theirs.positions[theirs_at[k]], b = back * ours.positions[ours_at[k]];
      if (t > 0) {
        const Vector3 moved = (a - their_foot[k]) * source.frame_rate_hz, added = (b - our_foot[k]) * source.frame_rate_hz - moved;
        if (moved.norm() < RetargetReport::kStillFoot) {
          ++report.feet[k].still_frames;
          report.feet[k].added_slide_mps += added.head<2>().norm();
        }
      }
      their_foot[k] = a, our_foot[k] = b;
    }
  }
  for (std::size_t b = 0; b < pairs.size(); ++b) report.bones[b].mean_deg = frames > 0 ? pairs[b].sum / static_cast<double>(frames) : 0;
  for (auto& foot : report.feet)
    if (foot.still_frames > 0) foot.added_slide_mps /= static_cast<double>(foot.still_frames);
  return report;
}

void RetargetTable::add(const std::string& clip, const RetargetReport& report) {
  for (const auto& b : report.bones) {
    rows_ += fmt::format("{}\t{}\t{}\t{}\t{:.3f}\t{:.3f}\t{}\t\t\n", clip, b.joint, b.child, b.source_joint, b.mean_deg, b.worst_deg, b.worst_frame);
    const bool trunk = b.joint.starts_with("spine") || b.joint == "neck";
    if (b.joint == "pelvis" || b.joint.ends_with("_ankle") || (trunk && b.child.ends_with("_collar"))) continue;
    auto& [sum, count] = trunk ? trunk_ : limbs_;
    sum += b.mean_deg;
    ++count;
  }
  for (const auto& f : report.feet) {
    rows_ += fmt::format("{}\t{}\t\t\t\t\t\t{}\t{:.3f}\n", clip, f.joint, f.still_frames, 1000 * f.added_slide_mps);
    slide_.first += 1000 * f.added_slide_mps * static_cast<double>(f.still_frames);
    slide_.second += f.still_frames;
  }
}

std::string RetargetTable::text() const { return "clip\tjoint\tchild\tsource_joint\tmean_deg\tworst_deg\tworst_frame\tstill_frames\tadded_slide_mm_s\n" + rows_; }

std::string RetargetTable::summary() const {
  const auto mean = [](const std::pair<double, std::size_t>& s) { return s.second > 0 ? s.first / static_cast<double>(s.second) : 0; };
  return fmt::format("bone directions against the source: limbs {:.2f} degrees on average, spine and neck {:.2f}; slide added to standing feet {:.2f} mm/s", mean(limbs_), mean(trunk_), mean(slide_));
}

}  // namespace mocap
