#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>
#include <utility>

#include "libmocap/base/checked.hpp"
#include "libmocap/base/error.hpp"
#include "libmocap/io/bvh.hpp"
#include "libmocap/io/bvh_frames.hpp"
#include "libmocap/io/bvh_hierarchy.hpp"

namespace mocap::io {
namespace {

constexpr double kHugeAngleDeg = 1e15;
constexpr const char* kLenientHint = "--lenient keeps the whole frames";

// Sine and cosine of half of each angle, up to a common sign (q and -q are the same rotation); |deg| <= kHugeAngleDeg.
// Reducing by whole turns in degrees is exact; Taylor series of the quarter angle, |x| <= pi/4, are exact to 1e-16, and
// the double-angle formulas follow. No calls and no branches, so that the compiler takes several angles at once: a
// third of the time of sincos(), which would take longer than parsing the numbers.
void half_angle_sin_cos(const double* deg, double* sine, double* cosine, std::size_t n) {
  constexpr double kRound = 0x1.8p52;  // adding and subtracting it rounds to a whole number
  const auto series = [](double y, const auto&... coefficients) {
    double sum = 0;
    ((sum = sum * y + coefficients), ...);
    return sum;
  };
  for (std::size_t i = 0; i < n; ++i) {
    const double turns = (deg[i] * (1.0 / 360) + kRound) - kRound;
    const double x = (deg[i] - 360 * turns) * (std::numbers::pi / 720), y = x * x;
    const double s = x * series(y, -1. / 1307674368000, 1. / 6227020800, -1. / 39916800, 1. / 362880, -1. / 5040,
                                1. / 120, -1. / 6, 1.);
    const double c = series(y, 1. / 20922789888000, -1. / 87178291200, 1. / 479001600, -1. / 3628800, 1. / 40320,
                            -1. / 720, 1. / 24, -1. / 2, 1.);
    sine[i] = 2 * s * c;
    cosine[i] = 1 - 2 * s * s;
  }
}

// Axes of a joint's three rotation slots and the parity of their order.
struct AxisOrder {
  std::array<std::uint8_t, 3> axes{0, 1, 2};
  double parity = 1;
};

// Where the numbers of a row go: angles of joint j at 3j in channel order, the root's position at 3J, then the
// positions of the other joints that have position channels. Slots without a channel keep what they start with: angle
// 0, OFFSET.
struct RowPlan {
  std::vector<std::uint32_t> slots;  // [channels]
  std::vector<AxisOrder> orders;     // [J]
  std::vector<std::size_t> moving;   // joints but the root with position channels
  std::vector<double> row;           // one row of slots
};

RowPlan plan_rows(const BvhHierarchy& h, std::vector<std::string>& order_texts) {
  const std::size_t joints = h.channels.size();
  RowPlan plan;
  plan.orders.resize(joints);
  plan.row.assign(3 * joints, 0.0);
  const auto add_position = [&](std::size_t j) {
    const std::size_t at = plan.row.size();
    for (int k = 0; k < 3; ++k) plan.row.push_back(h.skeleton.rest_offsets[j][k]);
    return at;
  };
  for (std::size_t j = 0; j < joints; ++j) {
    const BvhChannels& c = h.channels[j];
    const bool moves = std::any_of(c.kinds.begin(), c.kinds.begin() + c.count, [](std::uint8_t k) { return k < 3; });
    const std::size_t position = j == 0 || moves ? add_position(j) : 0;
    if (j > 0 && moves) plan.moving.push_back(j);
    auto& axes = plan.orders[j].axes;
    std::size_t turns = 0;
    std::string text;
    for (std::size_t i = 0; i < c.count; ++i) {
      const std::uint8_t kind = c.kinds[i];
      plan.slots.push_back(static_cast<std::uint32_t>(kind < 3 ? position + kind : 3 * j + turns));
      if (kind < 3) continue;
      text += static_cast<char>('X' + kind - 3);
      axes[turns++] = static_cast<std::uint8_t>(kind - 3);
    }
    for (std::uint8_t axis = 0; axis < 3; ++axis)  // axes without a channel fill up the order
      if (text.find(static_cast<char>('X' + axis)) == std::string::npos) axes[turns++] = axis;
    plan.orders[j].parity = (axes[1] - axes[0] + 3) % 3 == 1 ? 1 : -1;
    order_texts.push_back(text);
  }
  return plan;
}

// The product of three axis rotations i, j, k (all different), multiplied out.
void rotations_of_row(const RowPlan& plan, const double* sine, const double* cosine, Quaternion* out) {
  for (std::size_t j = 0; j < plan.orders.size(); ++j, sine += 3, cosine += 3) {
    const auto [axes, e] = plan.orders[j];
    const double cc = cosine[0] * cosine[1], ss = sine[0] * sine[1], sc = sine[0] * cosine[1], cs = cosine[0] * sine[1];
    auto& q = out[j].coeffs();
    q[3] = cc * cosine[2] - e * ss * sine[2];
    q[axes[0]] = sc * cosine[2] + e * cs * sine[2];
    q[axes[1]] = cs * cosine[2] - e * sc * sine[2];
    q[axes[2]] = cc * sine[2] + e * ss * cosine[2];
  }
}

std::string channel_text(const BvhHierarchy& h) {
  const std::size_t root = h.channels[0].count, others = h.channels.size() - 1;
  for (std::size_t j = 1; j <= others; ++j)
    if (h.channels[j].count != h.channels[1].count) return "(" + std::to_string(others + 1) + " joints)";
  if (others == 0) return "(1 joint)";
  return "(" + std::to_string(root) + " + " + std::to_string(others) + " x " + std::to_string(h.channels[1].count) +
         " channels)";
}

std::string listed(const Skeleton& s, const std::vector<std::size_t>& joints) {
  std::string text;
  for (std::size_t i = 0; i < joints.size(); ++i) {
    if (i == 8) return text + " and " + std::to_string(joints.size() - i) + " more";
    text += (i ? ", " : "") + s.joint_names[joints[i]];
  }
  return text;
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
  std::vector<double> sine_, cosine_, moved_;
  long frames_line_ = 0;
  std::uint64_t declared_ = 0;
  std::size_t frames_ = 0;   // stored
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
  out_.clip.frame_rate_hz = snap_frame_rate(time_s, decimals == 4 ? 5e-5 : decimals == 5 ? 5e-6 : 1e-6);
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
  double* const row = plan_.row.data();
  std::size_t n = 0;
  for (; n < channels; ++n) {
    while (p != end && is_blank(*p)) ++p;
    if (p == end || is_line_end(*p)) break;
    const char* const next = read_number(p, end, row[slots[n]]);
    if (!next) {
      text_.p = p;
      fail(text_.line, "frame " + std::to_string(frames_ + surplus_ + misfits_) + " has " + text_.shown() +
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
  const std::string text = "frame " + std::to_string(frames_ + surplus_ + misfits_) + " has " +
                           std::to_string(numbers) + " numbers, expected " + std::to_string(plan_.slots.size()) + " " +
                           channel_text(hierarchy_);
  if (!options_.lenient) refuse({{}, line, {}}, text, kLenientHint);
  if (misfits_++ == 0) {
    first_misfit_ = line;
    first_misfit_text_ = text;
  }
}

void MotionReader::store_row() {
  const std::size_t joints = hierarchy_.channels.size();
  if (frames_ == out_.clip.root_position.size()) make_room(2 * frames_ + 1);
  double* const angles = plan_.row.data();
  int huge = 0;
  for (std::size_t i = 0; i < 3 * joints; ++i) huge |= std::abs(angles[i]) > kHugeAngleDeg;
  if (huge)
    for (std::size_t i = 0; i < 3 * joints; ++i) angles[i] = std::remainder(angles[i], 360.0);
  half_angle_sin_cos(angles, sine_.data(), cosine_.data(), 3 * joints);
  Quaternion* const q = out_.clip.rotations.data() + frames_ * joints;
  rotations_of_row(plan_, sine_.data(), cosine_.data(), q);
  // Sign continuity here and not by make_sign_continuous(clip): the frame before is still in the cache.
  if (frames_ == 0) {
    for (std::size_t j = 0; j < joints; ++j) make_sign_continuous(out_.clip.rotations, j, joints, 1);
  } else {
    for (std::size_t j = 0; j < joints; ++j) {
      const double sign = q[j].dot(*(q + j - joints)) < 0 ? -1 : 1;
      q[j].coeffs() *= sign;
    }
  }
  const double* const positions = angles + 3 * joints;
  out_.clip.root_position[frames_] = Vector3(positions[0], positions[1], positions[2]);
  moved_.insert(moved_.end(), positions + 3, positions + 3 + 3 * plan_.moving.size());
  ++frames_;
}

void MotionReader::place_translations(Skeleton& skeleton) {
  const std::size_t moving = plan_.moving.size();
  std::vector<std::size_t> still, varying, columns;
  for (std::size_t m = 0; m < moving; ++m) {
    const std::size_t j = plan_.moving[m];
    const Vector3 offset = skeleton.rest_offsets[j];
    const auto position = [&](std::size_t t) { return Vector3::Map(moved_.data() + 3 * (t * moving + m)); };
    const auto fixed = still_position(frames_, position);
    if (fixed) {
      skeleton.rest_offsets[j] = *fixed;
      still.push_back(j);
    } else {
      varying.push_back(j);
      columns.push_back(m);
    }
    const Vector3 typical = fixed ? *fixed : Vector3(position(0));
    if (offset.norm() > 10 * kStillTranslation && typical.norm() < 0.1 * offset.norm())
      out_.notes.push_back("joint " + skeleton.joint_names[j] + ": positions near 0 replace an OFFSET of length " +
                           fmt::format("{:.6g}", offset.norm()) + "; some writers mean them to be added");
  }
  if (!still.empty()) out_.notes.push_back("positions that do not vary became offsets: " + listed(skeleton, still));
  if (varying.empty()) return;
  out_.notes.push_back("positions that vary are kept as translations: " + listed(skeleton, varying));
  const std::size_t joints = skeleton.parents.size();
  auto& all = out_.clip.translations;
  all.reserve(frames_ * joints);
  for (std::size_t t = 0; t < frames_; ++t) {
    all.insert(all.end(), skeleton.rest_offsets.begin(), skeleton.rest_offsets.end());
    for (std::size_t v = 0; v < varying.size(); ++v)
      all[t * joints + varying[v]] = Vector3::Map(moved_.data() + 3 * (t * moving + columns[v]));
  }
}

void MotionReader::run() {
  head();
  const std::size_t joints = hierarchy_.channels.size(), channels = plan_.slots.size();
  sine_.resize(3 * joints);
  cosine_.resize(3 * joints);
  // A frame is at least a digit and a separator for each channel: a declared 2^50 takes no memory.
  const auto possible = static_cast<std::size_t>(text_.end - text_.p + 1) / (2 * channels);
  make_room(static_cast<std::size_t>(std::min<std::uint64_t>(declared_, possible)));
  bool one_line = false;
  for (text_.skip_space(); !text_.done(); text_.skip_space()) {
    const long line = text_.line;
    const std::size_t before = frames_ + surplus_ + misfits_, numbers = read_row();
    const bool more = !text_.at_line_end();
    if (more && before == 0) one_line = all_on_this_line(numbers + count_rest_of_line());
    if (numbers < channels || (more && !one_line)) {
      misfit(line, numbers + count_rest_of_line());
      text_.skip_to_line_end();
    } else if (options_.lenient || frames_ < declared_) {
      store_row();
    } else {
      ++surplus_;
    }
  }
  if (!options_.lenient && frames_ + surplus_ != declared_)
    refuse({{}, frames_line_, {}},
           "Frames: " + std::to_string(declared_) + " declared, found " + std::to_string(frames_ + surplus_) + " rows",
           kLenientHint);
  if (frames_ == 0)
    fail(frames_line_,
         misfits_ ? "no row of the right width: " + first_misfit_text_ : "no frames, expected at least one");
  if (misfits_)
    out_.notes.push_back("line " + std::to_string(first_misfit_) + ": " + first_misfit_text_ +
                         "; rows like it left out: " + std::to_string(misfits_));
  if (frames_ != declared_)
    out_.notes.push_back("Frames: " + std::to_string(declared_) + " declared, kept " + std::to_string(frames_) +
                         " whole ones");
  out_.clip.rotations.resize(frames_ * joints);
  out_.clip.root_position.resize(frames_);
  Skeleton skeleton = hierarchy_.skeleton;
  place_translations(skeleton);
  out_.clip.skeleton = std::make_shared<const Skeleton>(std::move(skeleton));
}

}  // namespace

double snap_frame_rate(double frame_time_s, double tolerance_s) {
  const double whole = std::round(1 / frame_time_s);
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
