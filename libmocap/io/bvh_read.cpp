#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <utility>

#include "libmocap/base/checked.hpp"
#include "libmocap/base/error.hpp"
#include "libmocap/io/bvh.hpp"
#include "libmocap/io/bvh_frames.hpp"
#include "libmocap/io/bvh_hierarchy.hpp"
#include "libmocap/io/frame_rows.hpp"

namespace mocap::io {
namespace {

constexpr const char* kLenientHint = "--lenient keeps the whole frames";

// Where the numbers of a row go. Slots without a channel keep what they start with: angle 0, OFFSET.
struct RowPlan {
  std::vector<std::uint32_t> slots;  // [channels]
  FrameRows rows;
};

RowPlan plan_rows(const BvhHierarchy& h, std::vector<std::string>& order_texts) {
  const std::size_t joints = h.channels.size();
  RowPlan plan;
  FrameRows& rows = plan.rows;
  rows.row.assign(3 * joints, 0.0);
  const auto add_position = [&](std::size_t j) {
    const std::size_t at = rows.row.size();
    for (int k = 0; k < 3; ++k) rows.row.push_back(h.skeleton.rest_offsets[j][k]);
    return at;
  };
  for (std::size_t j = 0; j < joints; ++j) {
    const BvhChannels& c = h.channels[j];
    const bool moves = std::any_of(c.kinds.begin(), c.kinds.begin() + c.count, [](std::uint8_t k) { return k < 3; });
    const std::size_t position = j == 0 || moves ? add_position(j) : 0;
    if (j > 0 && moves) rows.moving.push_back(j);
    std::array<std::uint8_t, 3> axes{};
    std::size_t turns = 0;
    std::string text;
    for (std::size_t i = 0; i < c.count; ++i) {
      const std::uint8_t kind = c.kinds[i];
      plan.slots.push_back(static_cast<std::uint32_t>(kind < 3 ? position + kind : 3 * j + turns));
      if (kind < 3) continue;
      text += static_cast<char>('X' + kind - 3);
      axes[turns++] = static_cast<std::uint8_t>(kind - 3);
    }
    rows.orders.push_back(axis_order({axes.data(), turns}));
    order_texts.push_back(text);
  }
  return plan;
}

std::string channel_text(const BvhHierarchy& h) {
  const std::size_t root = h.channels[0].count, others = h.channels.size() - 1;
  for (std::size_t j = 1; j <= others; ++j)
    if (h.channels[j].count != h.channels[1].count) return "(" + std::to_string(others + 1) + " joints)";
  if (others == 0) return "(1 joint)";
  return "(" + std::to_string(root) + " + " + std::to_string(others) + " x " + std::to_string(h.channels[1].count) +
         " channels)";
}

class MotionReader {
 public:
  MotionReader(TextCursor& text, std::size_t text_size, const BvhHierarchy& hierarchy, const BvhReadOptions& options,
               BvhFile& out)
      : text_(text),
        text_size_(text_size),
        hierarchy_(hierarchy),
        options_(options),
        out_(out),
        plan_(plan_rows(hierarchy, out.orders)) {}
  void run();

 private:
  [[noreturn]] void fail(long line, const std::string& what) const { refuse({{}, line, {}}, what); }
  void head();
  void make_room(std::size_t frames);
  std::size_t read_row();
  std::size_t count_rest_of_line() const;
  bool all_on_this_line(std::size_t numbers) const;
  void misfit(long line, std::size_t numbers);
  void store_row();
  void place_translations(Skeleton& skeleton);

  TextCursor& text_;
  const std::size_t text_size_;
  const BvhHierarchy& hierarchy_;
  const BvhReadOptions& options_;
  BvhFile& out_;
  RowPlan plan_;
  long frames_line_ = 0;
  std::uint64_t declared_ = 0;
  std::size_t surplus_ = 0;  // whole rows beyond the declared number
  std::size_t misfits_ = 0;
  long first_misfit_ = 0;
  std::string first_misfit_text_;
};

void MotionReader::head() {
  const auto expect = [&](const char* keyword) {
    text_.skip_space();
    const std::string shown = text_.shown();
    // "Frames:12" is one word up to the colon.
    const char* const first = text_.p;
    while (text_.p != text_.end && !is_separator(*text_.p) && *text_.p != ':') ++text_.p;
    if (!same_ignoring_case({first, static_cast<std::size_t>(text_.p - first)}, keyword))
      fail(text_.line, shown + " after MOTION, expected 'Frames:' and 'Frame Time:'");
  };
  const auto colon = [&] {
    text_.skip_blanks();
    if (!text_.done() && *text_.p == ':') ++text_.p;
    text_.skip_blanks();
  };
  expect("Frames");
  colon();
  frames_line_ = text_.line;
  const std::string count = text_.shown();
  const auto r = std::from_chars(text_.p, text_.end, declared_);
  if (r.ec != std::errc{} || (r.ptr != text_.end && !is_separator(*r.ptr)) || declared_ == 0)
    fail(text_.line, "Frames: " + count + ", expected a whole number of at least 1");
  text_.p = r.ptr;
  expect("Frame");
  text_.skip_blanks();
  expect("Time");
  colon();
  const std::string shown = text_.shown();
  const char* const first = text_.p;
  double time_s = 0;
  const char* const last = read_number(first, text_.end, time_s);
  if (!last || !(time_s > 0) || !std::isfinite(1 / time_s))
    fail(text_.line, "Frame Time: " + shown + ", expected a finite number of seconds above 0");
  text_.p = last;
  // What was written with few digits means any rate within half a unit of the last one.
  const std::string_view digits(first, static_cast<std::size_t>(last - first));
  const auto point = digits.find('.');
  const auto decimals = point == std::string_view::npos || digits.find_first_of("eE") != std::string_view::npos
                            ? 0
                            : digits.size() - point - 1;
  out_.clip.frame_rate_hz = snap_frame_rate(time_s, decimals == 3 ? 5e-4 : decimals == 4 ? 5e-5 : decimals == 5 ? 5e-6 : 1e-6);
}

void MotionReader::make_room(std::size_t frames) {
  const std::size_t joints = hierarchy_.channels.size();
  const std::size_t bytes = checked_product(checked_product(frames, joints), sizeof(Quaternion));
  if (bytes / 512 > text_size_ + (1 << 12))
    fail(frames_line_, std::to_string(frames) + " frames of " + std::to_string(joints) + " joints with " +
                           std::to_string(hierarchy_.channel_count) +
                           " channels between them, expected channels on most joints");
  out_.clip.rotations.resize(frames * joints);
  out_.clip.root_position.resize(frames);
}

// Numbers up to the end of a full row or of the line, whichever comes first.
std::size_t MotionReader::read_row() {
  const char* p = text_.p;
  const char* const end = text_.end;
  const std::uint32_t* const slots = plan_.slots.data();
  const std::size_t channels = plan_.slots.size();
  double* const row = plan_.rows.row.data();
  std::size_t n = 0;
  for (; n < channels; ++n) {
    while (p != end && is_blank(*p)) ++p;
    if (p == end || is_line_end(*p)) break;
    const char* const next = read_number(p, end, row[slots[n]]);
    if (!next) {
      text_.p = p;
      fail(text_.line, "frame " + std::to_string(plan_.rows.frames + surplus_ + misfits_) + " has " + text_.shown() +
                           " as number " + std::to_string(n + 1) + ", expected a finite number");
    }
    p = next;
  }
  text_.p = p;
  text_.skip_blanks();
  return n;
}

std::size_t MotionReader::count_rest_of_line() const {
  std::size_t n = 0;
  for (TextCursor c = text_; !c.at_line_end(); c.skip_blanks(), ++n)
    while (!c.at_line_end() && !is_blank(*c.p)) ++c.p;
  return n;
}

// Whether the line of the first frame is the only one and holds every frame.
bool MotionReader::all_on_this_line(std::size_t numbers) const {
  TextCursor rest = text_;
  rest.skip_to_line_end();
  rest.skip_space();
  const std::size_t channels = plan_.slots.size();
  return rest.done() && numbers / channels >= 2 &&
         (options_.lenient || (numbers % channels == 0 && numbers / channels == declared_));
}

void MotionReader::misfit(long line, std::size_t numbers) {
  const std::string text = "frame " + std::to_string(plan_.rows.frames + surplus_ + misfits_) + " has " +
                           std::to_string(numbers) + " numbers, expected " + std::to_string(plan_.slots.size()) + " " +
                           channel_text(hierarchy_);
  if (!options_.lenient) refuse({{}, line, {}}, text, kLenientHint);
  if (misfits_++ == 0) {
    first_misfit_ = line;
    first_misfit_text_ = text;
  }
}

void MotionReader::store_row() {
  FrameRows& rows = plan_.rows;
  if (rows.frames == out_.clip.root_position.size()) make_room(2 * rows.frames + 1);
  rows.rotations_of_row(out_.clip.rotations.data() + rows.frames * rows.orders.size());
  rows.finish_frame(out_.clip);
}

void MotionReader::place_translations(Skeleton& skeleton) {
  const FrameRows& rows = plan_.rows;
  for (std::size_t m = 0; m < rows.moving.size(); ++m) {
    const std::size_t j = rows.moving[m];
    const double offset = skeleton.rest_offsets[j].norm();
    if (offset > 10 * kStillTranslation && rows.position(0, m).norm() < 0.1 * offset)
      out_.notes.push_back("joint " + skeleton.joint_names[j] + ": positions near 0 replace an OFFSET of length " +
                           fmt::format("{:.6g}", offset) + "; some writers mean them to be added");
  }
  rows.place_translations(skeleton, out_.clip, out_.notes);
}

void MotionReader::run() {
  head();
  const std::size_t joints = hierarchy_.channels.size(), channels = plan_.slots.size();
  // A frame is at least a digit and a separator for each channel: a declared 2^50 takes no memory.
  const auto possible = static_cast<std::size_t>(text_.end - text_.p + 1) / (2 * channels);
  make_room(static_cast<std::size_t>(std::min<std::uint64_t>(declared_, possible)));
  bool one_line = false;
  for (text_.skip_space(); !text_.done(); text_.skip_space()) {
    const long line = text_.line;
    const std::size_t before = plan_.rows.frames + surplus_ + misfits_, numbers = read_row();
    const bool more = !text_.at_line_end();
    if (more && before == 0) one_line = all_on_this_line(numbers + count_rest_of_line());
    if (numbers < channels || (more && !one_line)) {
      misfit(line, numbers + count_rest_of_line());
      text_.skip_to_line_end();
    } else if (options_.lenient || plan_.rows.frames < declared_) {
      store_row();
    } else {
      ++surplus_;
    }
  }
  if (!options_.lenient && plan_.rows.frames + surplus_ != declared_)
    refuse({{}, frames_line_, {}},
           "Frames: " + std::to_string(declared_) + " declared, found " + std::to_string(plan_.rows.frames + surplus_) + " rows",
           kLenientHint);
  if (plan_.rows.frames == 0)
    fail(frames_line_,
         misfits_ ? "no row of the right width: " + first_misfit_text_ : "no frames, expected at least one");
  if (misfits_)
    out_.repairs.push_back("line " + std::to_string(first_misfit_) + ": " + first_misfit_text_ +
                         "; rows like it left out: " + std::to_string(misfits_));
  if (plan_.rows.frames != declared_)
    out_.repairs.push_back("Frames: " + std::to_string(declared_) + " declared, kept " + std::to_string(plan_.rows.frames) +
                         " whole ones");
  out_.clip.rotations.resize(plan_.rows.frames * joints);
  out_.clip.root_position.resize(plan_.rows.frames);
  Skeleton skeleton = hierarchy_.skeleton;
  place_translations(skeleton);
  out_.clip.skeleton = std::make_shared<const Skeleton>(std::move(skeleton));
}

}  // namespace

double snap_frame_rate(double frame_time_s, double tolerance_s) {
  const double whole = std::round(1 / frame_time_s);
  // 0.008 is 125 Hz; 0.0042 is nearer to 238 Hz than to the 240 that were meant.
  if (whole >= 1 && std::abs(frame_time_s - 1 / whole) <= 1e-9) return whole;
  double common = 0;
  for (const double hz : {24.0, 25.0, 30.0, 48.0, 50.0, 60.0, 72.0, 75.0, 90.0, 100.0, 120.0, 144.0, 150.0, 180.0, 200.0, 240.0, 250.0, 300.0, 360.0, 480.0, 500.0, 600.0, 1000.0})
    if (const double off = std::abs(frame_time_s - 1 / hz); off <= tolerance_s && (common == 0 || off < std::abs(frame_time_s - 1 / common))) common = hz;
  if (common > 0) return common;
  if (tolerance_s > 1e-4) tolerance_s = 1e-6;  // three decimals would mean any rate
  if (whole >= 1 && std::abs(frame_time_s - 1 / whole) <= tolerance_s) return whole;
  const double ntsc = std::round(1.001 / frame_time_s);
  if (ntsc >= 1 && std::abs(frame_time_s - 1.001 / ntsc) <= tolerance_s) return ntsc * 1000 / 1001;
  return 1 / frame_time_s;
}

BvhFile parse_bvh(std::string_view text, const BvhReadOptions& options) {
  TextCursor cursor(text);
  const BvhHierarchy hierarchy = read_hierarchy(cursor);
  BvhFile file;
  file.notes = hierarchy.notes;
  MotionReader(cursor, text.size(), hierarchy, options, file).run();
  file.clip.skeleton->validate();
  return file;
}

}  // namespace mocap::io
