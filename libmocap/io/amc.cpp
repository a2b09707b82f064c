#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <numbers>
#include <unordered_map>
#include <utility>

#include "libmocap/base/checked.hpp"
#include "libmocap/base/error.hpp"
#include "libmocap/io/asf.hpp"
#include "libmocap/io/frame_rows.hpp"
#include "libmocap/io/text_cursor.hpp"

namespace mocap::io {
namespace {

constexpr double kCmuRate = 120;
constexpr const char* kLenientHint = "--lenient keeps the whole frames";
constexpr std::uint32_t kNowhere = UINT32_MAX;

std::string dof_text(const Asf::Joint& joint) {
  static constexpr const char* kNames[] = {"tx", "ty", "tz", "rx", "ry", "rz"};
  if (joint.count == 0) return "";
  std::string text = " (";
  for (std::size_t i = 0; i < joint.count; ++i) text += (i ? " " : "") + std::string(kNames[joint.dofs[i]]);
  return text + ")";
}

class AmcReader {
 public:
  AmcReader(std::string_view text, const Asf& asf, const AmcReadOptions& options, AmcFile& out)
      : text_(text), text_size_(text.size()), asf_(asf), options_(options), out_(out) {
    plan();
  }
  void run();

 private:
  struct Target {  // of a line
    const Asf::Joint* bone;
    std::array<std::uint32_t, 6> slots;  // of its values in values_
  };

  [[noreturn]] void fail(long line, const std::string& what, const char* hint = "") const {
    refuse({{}, line, frame_object()}, what, hint);
  }
  std::string frame_object() const { return number_seen_ ? "frame " + std::to_string(number_) : std::string(); }
  void plan();
  void header();
  bool more();
  std::string_view word();
  bool frame_number(std::string_view word);
  std::uint32_t find(long line);
  void bone_line();
  void defect(long line, const std::string& what);
  void close_frame();
  void make_room(std::size_t frames);
  void store_frame();

  TextCursor text_;
  const std::size_t text_size_;
  const Asf& asf_;
  const AmcReadOptions& options_;
  AmcFile& out_;
  FrameRows rows_;
  // One frame as written: angles of joint j from 3j on, the root's translation, those of rows_.moving; last what goes nowhere.
  std::vector<double> values_;
  std::vector<Target> targets_;  // joints, then bones outside of the hierarchy
  std::unordered_map<std::string_view, std::uint32_t> by_name_;
  std::vector<std::uint32_t> usual_;  // targets in the order of the first frame
  std::vector<std::size_t> behind_;   // of each target: its place in `usual_` + 1, 0 where it has none
  std::vector<std::size_t> seen_in_;  // of each target: `opened_` of the last frame that lists it
  std::vector<char> needed_;          // of each target
  std::size_t needed_count_ = 0;
  std::vector<std::pair<std::size_t, RotationMatrix>> turned_;  // joints with an axis, and it
  double angle_scale_ = 1;
  bool number_seen_ = false, broken_ = false;
  std::uint64_t number_ = 0;
  long number_line_ = 0, first_line_ = 0;  // of this frame's number and of the first
  std::size_t opened_ = 0, listed_ = 0, at_ = 0;  // frames begun; needed bones and lines of this one
  std::size_t left_out_ = 0, unknown_ = 0, jumps_ = 0;
  std::string first_left_out_, first_unknown_, first_jump_, held_;
  long first_left_out_line_ = 0;
};

void AmcReader::plan() {
  const std::size_t joints = asf_.joints.size();
  rows_.row.assign(3 * joints + 3, 0.0);
  for (std::size_t j = 0; j < joints; ++j) {
    const Asf::Joint& bone = asf_.joints[j];
    Target target{&bone, {}};
    const auto dofs = std::span(bone.dofs).first(bone.count);
    const bool moves = j > 0 && std::any_of(dofs.begin(), dofs.end(), [](std::uint8_t k) { return k < 3; });
    const std::size_t place = j == 0 ? 3 * joints : rows_.row.size();
    if (moves) {
      rows_.moving.push_back(j);
      rows_.row.resize(rows_.row.size() + 3);
    }
    auto turns = static_cast<std::size_t>(std::count_if(dofs.begin(), dofs.end(), [](std::uint8_t k) { return k >= 3; }));
    std::array<std::uint8_t, 3> axes{};
    const std::size_t all = turns;
    // The first listed turns first, which is the last factor of the product.
    for (std::size_t i = 0; i < dofs.size(); ++i) {
      if (dofs[i] < 3) {
        target.slots[i] = static_cast<std::uint32_t>(place + dofs[i]);
      } else {
        axes[--turns] = static_cast<std::uint8_t>(dofs[i] - 3);
        target.slots[i] = static_cast<std::uint32_t>(3 * j + turns);
      }
    }
    rows_.orders.push_back(axis_order({axes.data(), all}));
    if (j > 0 && !bone.axis.isApprox(Quaternion::Identity(), 0)) turned_.emplace_back(j, to_matrix(bone.axis));
    targets_.push_back(target);
  }
  values_.assign(rows_.row.size() + 1, 0.0);
  const auto spare = static_cast<std::uint32_t>(rows_.row.size());
  for (const auto& bone : asf_.outside) targets_.push_back({&bone, {spare, spare, spare, spare, spare, spare}});
  for (std::size_t i = 0; i < targets_.size(); ++i) {
    by_name_.emplace(targets_[i].bone->written, static_cast<std::uint32_t>(i));
    needed_.push_back(i < joints && targets_[i].bone->count > 0);
    needed_count_ += static_cast<std::size_t>(needed_.back());
  }
  seen_in_.assign(targets_.size(), 0);
  behind_.assign(targets_.size(), 0);
}

bool AmcReader::more() {
  for (text_.skip_space(); !text_.done() && *text_.p == '#'; text_.skip_space()) text_.skip_to_line_end();
  return !text_.done();
}

std::string_view AmcReader::word() {
  const char* const first = text_.p;
  while (text_.p != text_.end && !is_separator(*text_.p)) ++text_.p;
  return {first, static_cast<std::size_t>(text_.p - first)};
}

void AmcReader::header() {
  bool radians = asf_.radians, said = false;
  out_.clip.frame_rate_hz = kCmuRate;
  while (more() && *text_.p == ':') {
    const std::string shown = text_.shown();
    const auto key = word();
    const auto is = [&](const char* name) { return same_ignoring_case(key, name); };
    if (is(":DEGREES") || is(":RADIANS")) {
      radians = is(":RADIANS");
      said = true;
    } else if (is(":SAMPLES-PER-SECOND")) {
      text_.skip_blanks();
      const std::string rate = text_.shown();
      const char* const next = read_number(text_.p, text_.end, out_.clip.frame_rate_hz);
      if (!next || !(out_.clip.frame_rate_hz > 0)) fail(text_.line, shown + " " + rate + ", expected a finite number above 0");
      out_.rate_known = true;
    } else if (!is(":FULLY-SPECIFIED") && !is(":ASF-FILE") && !is(":ASF-PATH") && !is(":FRAME-RANGE")) {
      out_.notes.push_back("line " + std::to_string(text_.line) + ": " + shown + " is not known and skipped");
    }
    text_.skip_to_line_end();
  }
  angle_scale_ = radians ? 180 / std::numbers::pi : 1;
  if (!said) out_.notes.push_back(fmt::format("neither :DEGREES nor :RADIANS: {} taken from the skeleton", radians ? "radians" : "degrees"));
  if (!out_.rate_known) out_.notes.push_back(fmt::format("no frame rate in the file: {} Hz assumed", kCmuRate));
}

bool AmcReader::frame_number(std::string_view w) {
  std::uint64_t n = 0;
  const auto r = std::from_chars(w.data(), w.data() + w.size(), n);
  if (r.ec != std::errc{} || r.ptr != w.data() + w.size()) return false;
  close_frame();
  if (number_seen_ && n != number_ + 1) {
    const std::string text = fmt::format("frame {} follows frame {}, expected {}", n, number_, number_ + 1);
    if (!options_.lenient) refuse({{}, text_.line, {}}, text, kLenientHint);
    if (jumps_++ == 0) first_jump_ = "line " + std::to_string(text_.line) + ": " + text;
  }
  if (!number_seen_) first_line_ = text_.line;
  number_ = n;
  number_seen_ = true;
  number_line_ = text_.line;
  ++opened_;
  listed_ = at_ = 0;
  broken_ = false;
  return true;
}

// What makes this frame not whole.
void AmcReader::defect(long line, const std::string& what) {
  if (!options_.lenient) fail(line, what, kLenientHint);
  if (!broken_ && left_out_ == 0) {
    first_left_out_ = frame_object() + ": " + what;
    first_left_out_line_ = line;
  }
  broken_ = true;
}

// The target of the line's bone; kNowhere where there is none and the line is to be skipped.
std::uint32_t AmcReader::find(long line) {
  if (at_ < usual_.size()) {
    const std::string& name = targets_[usual_[at_]].bone->written;
    const auto size = name.size();
    const auto ahead = static_cast<std::size_t>(text_.end - text_.p);
    if (ahead >= size && std::memcmp(text_.p, name.data(), size) == 0 && (ahead == size || is_separator(text_.p[size]))) {
      text_.p += size;
      return usual_[at_++];
    }
  }
  const std::string shown = text_.shown();
  const auto name = word();
  if (frame_number(name)) return kNowhere;
  if (!number_seen_) fail(line, shown + " before the first frame, expected its number");
  const auto it = by_name_.find(name);
  if (it == by_name_.end()) {
    const std::string text = "bone " + shown + " is not in the skeleton, expected one of its " + std::to_string(asf_.joints.size()) + " names";
    if (!options_.lenient) fail(line, text, "--lenient leaves out such lines; --asf names another skeleton");
    if (unknown_++ == 0) first_unknown_ = "line " + std::to_string(line) + ": " + text;
    text_.skip_to_line_end();
    return kNowhere;
  }
  const std::uint32_t found = it->second;
  if (opened_ == 1) {
    usual_.push_back(found);
    behind_[found] = usual_.size();
  }
  if (behind_[found] > 0) at_ = behind_[found];
  return found;
}

void AmcReader::bone_line() {
  const long line = text_.line;
  const std::uint32_t found = find(line);
  if (found == kNowhere) return;
  const Target& target = targets_[found];
  const std::size_t count = target.bone->count;
  const char* p = text_.p;
  const char* const end = text_.end;
  std::size_t n = 0;
  for (; n < count; ++n) {
    while (p != end && is_blank(*p)) ++p;
    if (p == end || is_line_end(*p)) break;
    const char* const next = read_number(p, end, values_[target.slots[n]]);
    if (!next) {
      text_.p = p;
      const std::string what = fmt::format("bone {} has {} as value {}, expected a finite number", target.bone->written, text_.shown(), n + 1);
      word();
      if (!text_.done()) fail(line, what);
      defect(line, what);  // cut in a number
      return;
    }
    p = next;
  }
  text_.p = p;
  text_.skip_blanks();
  if (n < count || !text_.at_line_end()) {
    for (; !text_.at_line_end() && *text_.p != '#'; text_.skip_blanks(), ++n) word();
    text_.skip_to_line_end();
    if (n != count) {
      return defect(line, fmt::format("bone {} has {} value{}, expected {}{}", target.bone->written, n, n == 1 ? "" : "s", count, dof_text(*target.bone)));
    }
  }
  if (seen_in_[found] == opened_) return defect(line, "bone " + target.bone->written + " a second time, expected it once in a frame");
  seen_in_[found] = opened_;
  listed_ += static_cast<std::size_t>(needed_[found]);
}

void AmcReader::close_frame() {
  if (!number_seen_) return;
  if (!broken_ && listed_ < needed_count_) {
    std::string absent;
    std::size_t n = 0;
    for (std::size_t i = 0; i < targets_.size(); ++i)
      if (needed_[i] && seen_in_[i] != opened_ && ++n <= 4) absent += (n > 1 ? ", " : "") + targets_[i].bone->written;
    if (n > 4) absent += fmt::format(" and {} more", n - 4);
    const std::string what = fmt::format("{} bones, expected {}: without {}", listed_, needed_count_, absent);
    if (opened_ == 1 && options_.lenient && needed_[0] && seen_in_[0] == opened_) {
      held_ = frame_object() + ": " + what;
      out_.repairs.push_back("bones that the first frame lacks are held at 0: " + absent);
      for (std::size_t i = 0; i < targets_.size(); ++i)
        if (needed_[i] && seen_in_[i] != opened_) {
          needed_[i] = 0;
          --needed_count_;
          targets_[i].slots.fill(static_cast<std::uint32_t>(values_.size() - 1));
        }
    } else {
      defect(number_line_, what);
    }
  }
  if (broken_)
    ++left_out_;
  else
    store_frame();
}

void AmcReader::make_room(std::size_t frames) {
  const std::size_t joints = asf_.joints.size();
  const std::size_t bytes = checked_product(checked_product(frames, joints), sizeof(Quaternion));
  if (bytes / 512 > text_size_ + joints + (1 << 12))
    fail(number_line_, fmt::format("{} frames of {} joints with {} bones listed in each, expected dof on most bones", frames, joints, needed_count_));
  out_.clip.rotations.resize(frames * joints);
  out_.clip.root_position.resize(frames);
}

void AmcReader::store_frame() {
  const std::size_t joints = asf_.joints.size();
  Clip& clip = out_.clip;
  if (rows_.frames == clip.root_position.size()) {
    // The rest is likely to be frames of as many lines as those so far: room taken once, a copy of all frames saved.
    const auto lines = static_cast<std::size_t>(std::count(text_.p, text_.end, '\n'));
    const auto so_far = static_cast<std::size_t>(std::max(1L, text_.line - first_line_));
    const double likely = static_cast<double>(lines) / static_cast<double>(so_far) * static_cast<double>(opened_);
    make_room(rows_.frames + rows_.frames / 2 + 2 + static_cast<std::size_t>(likely));
  }
  double* const row = rows_.row.data();
  for (std::size_t i = 0; i < 3 * joints; ++i) row[i] = values_[i] * angle_scale_;
  Quaternion* const q = clip.rotations.data() + rows_.frames * joints;
  rows_.rotations_of_row(q);
  // C M C^-1 turns the axis of M and keeps its angle.
  for (const auto& [j, axis] : turned_) q[j].vec() = axis * Vector3(q[j].vec());
  q[0] = asf_.joints[0].axis * q[0];
  const auto place = [&](std::size_t at, std::size_t j) {
    Vector3::Map(row + at) = asf_.skeleton->rest_offsets[j] + asf_.joints[j].axis * Vector3(Vector3::Map(values_.data() + at));
  };
  place(3 * joints, 0);
  for (std::size_t m = 0; m < rows_.moving.size(); ++m) place(3 * joints + 3 + 3 * m, rows_.moving[m]);
  rows_.finish_frame(clip);
}

void AmcReader::run() {
  header();
  while (more()) bone_line();
  close_frame();
  if (!number_seen_) fail(text_.line, "no frames, expected at least one");
  if (rows_.frames == 0) refuse({{}, first_left_out_line_, {}}, "no whole frame: " + first_left_out_);
  if (rows_.frames == 1 && !held_.empty()) refuse({{}, number_line_, {}}, "no whole frame: " + held_);
  if (left_out_ > 0)
    out_.repairs.push_back(fmt::format("line {}: {}; frames left out: {}, kept: {}", first_left_out_line_, first_left_out_, left_out_, rows_.frames));
  if (unknown_ > 0) out_.repairs.push_back(fmt::format("{}; lines left out: {}", first_unknown_, unknown_));
  if (jumps_ > 0) out_.repairs.push_back(fmt::format("{}; jumps kept as they are: {}", first_jump_, jumps_));
  out_.clip.rotations.resize(rows_.frames * asf_.joints.size());
  out_.clip.root_position.resize(rows_.frames);
  out_.clip.skeleton = asf_.skeleton;
  if (rows_.moving.empty()) return;
  Skeleton skeleton = *asf_.skeleton;
  rows_.place_translations(skeleton, out_.clip, out_.notes);
  out_.clip.skeleton = std::make_shared<const Skeleton>(std::move(skeleton));
}

}  // namespace

AmcFile parse_amc(std::string_view text, const Asf& asf, const AmcReadOptions& options) {
  AmcFile file;
  AmcReader(text, asf, options, file).run();
  return file;
}

}  // namespace mocap::io
