#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <utility>

#include "libmocap/base/error.hpp"
#include "libmocap/io/bvh.hpp"
#include "libmocap/io/bvh_frames.hpp"

namespace mocap::io {
namespace {

constexpr double kDegrees = 180 / std::numbers::pi;
constexpr std::size_t kDeepestIndent =
    32;  // deeper blocks are not indented further: the text stays linear in the joints

class Writer {
 public:
  Writer(const Clip& clip, const BvhWriteOptions& options);
  std::string run();

 private:
  bool has_positions(std::size_t j) const { return j == 0 || moves_[j]; }
  double rounded(double v) const { return std::nearbyint(v * scale_) / scale_; }
  void number(double v);
  void vector(const Vector3& v) {
    for (int k = 0; k < 3; ++k) number(v[k]);
  }
  void hierarchy();
  void joint_head(std::size_t j, std::size_t depth);
  Vector3 printed_angles(const Quaternion& q, const Vector3& before, bool first) const;
  void motion();

  const Clip& clip_;
  const Skeleton& skeleton_;
  const int decimals_;
  const double scale_;
  const EulerOrder order_;
  std::vector<char> moves_;        // [J] joints with position channels of their own
  std::vector<Vector3> offsets_;   // [J]
  std::vector<std::size_t> rows_;  // joints in the order of the file
  fmt::memory_buffer out_;
};

Writer::Writer(const Clip& clip, const BvhWriteOptions& options)
    : clip_(clip),
      skeleton_(*clip.skeleton),
      decimals_(options.decimals),
      scale_(std::pow(10.0, options.decimals)),
      order_(EulerOrder::parse(options.order)),
      moves_(skeleton_.parents.size(), 0),
      offsets_(skeleton_.rest_offsets) {
  if (order_.count != 3 || order_.axes[0] == order_.axes[1] || order_.axes[1] == order_.axes[2] ||
      order_.axes[0] == order_.axes[2])
    refuse_usage("rotation order '" + options.order + "', expected three different axes");
  if (decimals_ < 0 || decimals_ > 15) refuse_usage(fmt::format("{} decimals, expected 0 to 15", decimals_));
  for (const std::string& name : skeleton_.joint_names)
    if (name.find_first_of("\n\r{") != std::string::npos)
      refuse({{}, 0, "joint " + name}, "a name with a line break or brace, which BVH cannot hold");
  if (clip.translations.empty()) return;
  const std::size_t joints = offsets_.size();
  for (std::size_t j = 1; j < joints; ++j) {
    // The reader's own rule, so that reading back and writing again gives the same text.
    const auto fixed = still_position(clip.frames(), [&](std::size_t t) { return clip.translations[t * joints + j]; });
    moves_[j] = !fixed;
    if (fixed) offsets_[j] = *fixed;
  }
}

void Writer::number(double v) {
  if (std::abs(v) * scale_ <= 0.5) v = 0;  // no "-0.000000"
  if (out_[out_.size() - 1] != '\n') out_.push_back(' ');
  fmt::format_to(std::back_inserter(out_), "{:.{}f}", v, decimals_);
}

void Writer::joint_head(std::size_t j, std::size_t depth) {
  const std::string indent(std::min(depth, kDeepestIndent), '\t');
  const auto to = std::back_inserter(out_);
  fmt::format_to(to, "{}{} {}\n{}{{\n{}\tOFFSET", indent, j == 0 ? "ROOT" : "JOINT", skeleton_.joint_names[j], indent,
                 indent);
  vector(offsets_[j]);
  fmt::format_to(to, "\n{}\tCHANNELS {}", indent, has_positions(j) ? "6 Xposition Yposition Zposition" : "3");
  for (const char axis : order_.text()) fmt::format_to(to, " {}rotation", axis);
  fmt::format_to(to, "\n");
}

void Writer::hierarchy() {
  const auto to = std::back_inserter(out_);
  const auto children = skeleton_.children();
  std::vector<std::vector<Vector3>> tips(children.size());
  for (const auto& e : skeleton_.end_sites) tips[static_cast<std::size_t>(e.parent)].push_back(e.offset);
  for (std::size_t j = 0; j < tips.size(); ++j)
    if (children[j].empty() && tips[j].empty()) tips[j].push_back(Vector3::Zero());

  fmt::format_to(to, "HIERARCHY\n");
  struct Open {
    std::size_t joint, next_child;
  };
  std::vector<Open> open;
  const auto enter = [&](std::size_t j) {
    const std::size_t depth = open.size();
    joint_head(j, depth);
    const std::string indent(std::min(depth, kDeepestIndent) + 1, '\t');
    for (const Vector3& tip : tips[j]) {
      fmt::format_to(to, "{}End Site\n{}{{\n{}\tOFFSET", indent, indent, indent);
      vector(tip);
      fmt::format_to(to, "\n{}}}\n", indent);
    }
    rows_.push_back(j);
    open.push_back({j, 0});
  };
  enter(0);
  while (!open.empty()) {
    Open& top = open.back();
    if (top.next_child < children[top.joint].size()) {
      enter(static_cast<std::size_t>(children[top.joint][top.next_child++]));
      continue;
    }
    open.pop_back();
    fmt::format_to(to, "{}}}\n", std::string(std::min(open.size(), kDeepestIndent), '\t'));
  }
}

// Degrees as they are printed, nearest to those printed before. What is read back gives the same angles again: where
// rounding errors could decide otherwise, a rule does.
Vector3 Writer::printed_angles(const Quaternion& q, const Vector3& before, bool first) const {
  const Vector3 near = before / kDegrees;
  Vector3 angles = to_euler(q, order_, first ? nullptr : &near) * kDegrees;
  angles[1] = rounded(angles[1]);
  const double pole = std::abs(std::cos(angles[1] / kDegrees));
  // Near gimbal lock the first angle is known to about 1e-13 / pole degrees, and the third makes up for any choice. It
  // is rounded to more than that; with the middle angle at the pole it stays as it was.
  const double step = std::pow(10.0, std::ceil(std::log10(1e-12 / pole)));
  if (step * scale_ > 1) {
    angles[0] = step > 10 ? before[0] : std::nearbyint(angles[0] / step) * step;
    const Quaternion rest = from_euler(Vector3(angles[0], angles[1], 0) / kDegrees, order_).conjugate() * q;
    angles[2] = 2 * std::atan2(rest.coeffs()[order_.axes[2]], rest.w()) * kDegrees;
    angles[2] += 360 * std::nearbyint((before[2] - angles[2]) / 360);
  }
  for (int k = 0; k < 3; ++k) {
    if (std::abs(angles[k] - before[k] + 180) * scale_ <= 1) angles[k] += 360;  // half a turn back: half a turn on
    angles[k] = rounded(angles[k]);
  }
  return angles;
}

void Writer::motion() {
  const auto to = std::back_inserter(out_);
  const std::size_t joints = offsets_.size();
  // With its zeros: fewer digits would mean a rounded rate to a reader (snap_frame_rate).
  fmt::format_to(to, "MOTION\nFrames: {}\nFrame Time: {:#.10g}\n", clip_.frames(), 1 / clip_.frame_rate_hz);
  std::vector<Vector3> before(joints, Vector3::Zero());  // angles as printed, degrees
  for (std::size_t t = 0; t < clip_.frames(); ++t) {
    for (const std::size_t j : rows_) {
      if (has_positions(j)) vector(j == 0 ? clip_.root_position[t] : clip_.translations[t * joints + j]);
      before[j] = printed_angles(clip_.rotations[t * joints + j], before[j], t == 0);
      vector(before[j]);
    }
    out_.push_back('\n');
  }
}

std::string Writer::run() {
  hierarchy();
  motion();
  return fmt::to_string(out_);
}

}  // namespace

std::string format_bvh(const Clip& clip, const BvhWriteOptions& options) {
  clip.validate();
  clip.skeleton->validate();
  return Writer(clip, options).run();
}

}  // namespace mocap::io
