#include "libmocap/draw/film_strip.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "libmocap/draw/strip_metrics.hpp"

namespace mocap::draw {
namespace {

constexpr Color kWhite{1, 1, 1}, kGround{0.45, 0.45, 0.45}, kSoil{0.955, 0.95, 0.94}, kFaint{0.86, 0.86, 0.86}, kText{0.15, 0.15, 0.15}, kQuiet{0.45, 0.45, 0.45};
constexpr const char* kDot = "  \xc2\xb7  ";

Color color_of(Side side) { return side == Side::left ? kLeftColor : side == Side::right ? kRightColor : kTrunkColor; }

bool level(View view) { return view == View::side || view == View::front; }

// The longest of 1, 2, 5, 10, ... (and fractions) metres that takes at most `room` pixels.
double bar_length(double pixels_per_metre, double room) {
  const double most = room / pixels_per_metre, decade = std::pow(10, std::floor(std::log10(most)));
  return (most >= 5 * decade ? 5 : most >= 2 * decade ? 2 : 1) * decade;
}

struct Bone {
  Vector2 from, to;
  Side side;
};

// The bones of one limb, or of the trunk, and how near to the viewer they are.
struct Limb {
  std::vector<Bone> bones;
  double nearness = 0;
};

std::vector<Limb> limbs_of(const StripPlan::Row& row, const StripFigure& f) {
  const Skeleton& s = *row.source->clip.skeleton;
  const Anatomy& a = row.anatomy;
  std::vector<Limb> limbs(static_cast<std::size_t>(*std::max_element(a.limbs.begin(), a.limbs.end())) + 1);
  const auto add = [&](int limb, const Vector2& from, const Vector2& to, Side side, double nearness) {
    auto& l = limbs[static_cast<std::size_t>(limb)];
    l.bones.push_back({from, to, side});
    l.nearness += nearness;
  };
  for (std::size_t j = 1; j < s.parents.size(); ++j) {
    const auto p = static_cast<std::size_t>(s.parents[j]);
    if ((f.joints[j] - f.joints[p]).norm() < 0.05 || static_cast<int>(j) == a.carried) continue;
    // Hip and collar bones leave the trunk: they belong to it.
    const bool girdle = a.sides[p] == Side::trunk;
    add(girdle ? 0 : a.limbs[j], f.joints[p], f.joints[j], girdle ? Side::trunk : a.sides[j], f.nearness[j]);
  }
  for (std::size_t e = 0; e < s.end_sites.size(); ++e) {
    const auto p = static_cast<std::size_t>(s.end_sites[e].parent);
    if (static_cast<int>(p) != a.head) add(a.limbs[p], f.joints[p], f.end_sites[e], a.sides[p], f.nearness[p]);
  }
  for (auto& l : limbs)
    if (!l.bones.empty()) l.nearness /= static_cast<double>(l.bones.size());
  std::stable_sort(limbs.begin(), limbs.end(), [](const Limb& x, const Limb& y) { return x.nearness < y.nearness; });
  return limbs;
}

void draw_figure(Canvas& canvas, const StripPlan& plan, const StripPlan::Row& row, const StripFigure& f) {
  const double scale = plan.pixels_per_metre, width = std::max(1.2, 0.033 * scale), halo = width + std::max(1.0, 0.016 * scale);
  const Skeleton& s = *row.source->clip.skeleton;
  if (!level(plan.options.view))
    for (std::size_t j = 1; j < s.parents.size(); ++j)
      if (static_cast<int>(j) != row.anatomy.carried) canvas.line(f.shadow[static_cast<std::size_t>(s.parents[j])], f.shadow[j], kFaint, width);
  for (const Limb& limb : limbs_of(row, f)) {
    // The trunk is heavier, so that it shows behind the arm that hangs before it.
    const double extra = limb.bones.empty() || limb.bones[0].side != Side::trunk ? 0 : 0.7 * width;
    for (const Bone& b : limb.bones) canvas.line(b.from, b.to, kWhite, halo + extra);
    for (const Bone& b : limb.bones) canvas.line(b.from, b.to, color_of(b.side), width + extra);
  }
  if (s.parents.size() == 1) canvas.disc(f.joints[0], 2 * width, kTrunkColor);
  if (row.anatomy.head >= 0) {
    const auto head = static_cast<std::size_t>(row.anatomy.head);
    const Vector2 base = f.joints[head];
    Vector2 centre = base;
    for (std::size_t e = 0; e < s.end_sites.size(); ++e)
      if (s.end_sites[e].parent == row.anatomy.head) centre = (base + f.end_sites[e]) / 2;
    canvas.disc(centre, 0.095 * scale + (halo - width) / 2, kWhite);
    canvas.disc(centre, 0.095 * scale, kTrunkColor);
  }
}

// A bar under each foot that is down, left above right; seen from above or obliquely a disc below it.
void draw_contacts(Canvas& canvas, const StripPlan& plan, const StripPlan::Row& row, const StripFigure& f) {
  const int feet[] = {row.anatomy.left_foot, row.anatomy.right_foot};
  for (int side = 0; side < 2; ++side) {
    if (!f.down[static_cast<std::size_t>(side)] || feet[side] < 0) continue;
    const auto j = static_cast<std::size_t>(feet[side]);
    const Color color = side == 0 ? kLeftColor : kRightColor;
    const double half = std::max(4.0, 0.09 * plan.pixels_per_metre);
    if (level(plan.options.view))
      canvas.rectangle({f.joints[j].x() - half, row.ground + 3 + side * 6}, {2 * half, 4}, color);
    else
      canvas.disc(f.shadow[j], 0.6 * half, color);
  }
}

void draw_ground(Canvas& canvas, const StripPlan& plan, const StripPlan::Row& row, double right) {
  if (!level(plan.options.view)) return;
  canvas.rectangle({kMargin, row.ground}, {right - kMargin, row.has_contacts ? kContactMarks : 5}, kSoil);
  canvas.line({kMargin, row.ground}, {right, row.ground}, kGround, 1.2);
}

// Times under the figures, left out where they would touch.
void draw_times(Canvas& canvas, const StripPlan::Row& row, double baseline) {
  double free_from = 0;
  for (const StripFigure& f : row.figures) {
    const std::string label = fmt::format("{:.2f} s", f.time_s);
    const double half = canvas.text_width(label, 11) / 2, at = std::max(f.anchor, kMargin + half);
    if (at - half < free_from) continue;
    canvas.text({at, baseline}, label, 11, kQuiet, Align::centre);
    free_from = at + half + 6;
  }
}

void draw_chart(Canvas& canvas, const StripPlan& plan, const StripPlan::Row& row, double top, double right) {
  const Clip& clip = row.source->clip;
  const bool along = plan.along_path || row.figures.size() < 2;
  // Under evenly spaced figures the chart's time is theirs.
  const double from = along ? kMargin + 40 : row.figures.front().anchor, to = along ? right - 4 : row.figures.back().anchor;
  const double n = static_cast<double>(std::max<std::size_t>(1, clip.frames() - 1)), frame = (to - from) / n;
  for (std::size_t side = 0; side < 2; ++side) {
    const double y = top + 4 + 13 * static_cast<double>(side);
    canvas.text({from - 6 - frame / 2, y + 9}, side == 0 ? "left" : "right", 10, side == 0 ? kLeftColor : kRightColor, Align::right);
    canvas.line({from, y + 5}, {to, y + 5}, kFaint, 1);
    for (std::size_t t = 0; t < clip.contacts.size();) {
      std::size_t end = t;
      while (end < clip.contacts.size() && clip.contacts[end][side]) ++end;
      if (end > t) {
        const double a = std::max(from, from + (static_cast<double>(t) - 0.5) * frame), b = std::min(to, from + (static_cast<double>(end) - 0.5) * frame);
        canvas.rectangle({a, y}, {b - a, 10}, side == 0 ? kLeftColor : kRightColor);
      }
      t = std::max(end, t + 1);
    }
  }
}

// The root's way from above, facing right, and the way it was asked to go.
void draw_track(Canvas& canvas, const StripPlan::Row& row, const Vector2& corner) {
  const Clip& clip = row.source->clip;
  const Camera camera = camera_for(View::top, row.forward);
  std::vector<Vector2> way, asked;
  for (const Vector3& p : clip.root_position) way.push_back(camera.project(p));
  for (const Vector2& p : clip.path) asked.push_back(camera.project({p.x(), p.y(), 0}));
  Vector2 low = way[0], high = way[0];
  for (const auto* list : {&way, &asked})
    for (const Vector2& p : *list) {
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
  const double inner = kInset - 30, scale = inner / std::max((high - low).maxCoeff(), 0.5), bar = bar_length(scale, inner);
  const Vector2 middle = (low + high) / 2, centre = corner + Vector2(kInset / 2, kInset / 2 - 6);
  const auto place = [&](const Vector2& p) { return Vector2(centre.x() + (p.x() - middle.x()) * scale, centre.y() - (p.y() - middle.y()) * scale); };
  for (auto* list : {&way, &asked})
    for (Vector2& p : *list) p = place(p);
  canvas.polyline({corner, corner + Vector2(kInset, 0), corner + Vector2(kInset, kInset), corner + Vector2(0, kInset), corner}, kFaint, 1);
  canvas.polyline(asked, kGround, 3, 5);
  canvas.polyline(way, kTrunkColor, 1.6);
  for (const StripFigure& f : row.figures) canvas.disc(way[f.frame], 2.2, kTrunkColor);
  canvas.disc(way[0], 4, kTrunkColor);
  canvas.disc(way[0], 2.4, kWhite);
  const Vector2 foot = corner + Vector2(8, kInset - 8);
  canvas.line(foot, foot + Vector2(bar * scale, 0), kQuiet, 2);
  canvas.text(foot + Vector2(0, -5), fmt::format("{:g} m", bar), 10, kQuiet);
}

void draw_header(Canvas& canvas, const StripPlan& plan) {
  double x = kMargin;
  const double y = 20;
  const auto key = [&](const char* word, const Color& color) {
    canvas.line({x + 3, y - 4}, {x + 19, y - 4}, color, 5);
    canvas.text({x + 28, y}, word, 12, kText);
    x += 28 + canvas.text_width(word, 12) + 20;
  };
  key("left", kLeftColor);
  key("right", kRightColor);
  bool marks = false;
  for (const auto& row : plan.rows) marks = marks || row.has_contacts;
  const std::string seen = plan.options.view == View::top ? "seen from above" : plan.options.view == View::oblique ? "seen obliquely" : fmt::format("seen from the {}", text(plan.options.view));
  const std::string places = plan.along_path ? "figures where they were" : "figures apart in time, not in place";
  const std::string legend = seen + kDot + places + (marks ? std::string(kDot) + (level(plan.options.view) ? "bars below the ground: feet in contact" : "discs: feet in contact") : "");
  const double metre = plan.pixels_per_metre, length = bar_length(metre, 200), end = plan.options.width - kMargin, bar = end - length * metre;
  const std::string size = fmt::format("{:g} m", length);
  canvas.text({x, y}, canvas.fitting(legend, 12, bar - 8 - canvas.text_width(size, 12) - 16 - x), 12, kQuiet);
  canvas.line({bar, y - 4}, {end, y - 4}, kText, 2);
  for (const double tick : {bar, end}) canvas.line({tick, y - 8}, {tick, y}, kText, 1.5);
  canvas.text({bar - 8, y}, size, 12, kText, Align::right);
}

}  // namespace

std::string describe(const Clip& clip) {
  std::string s;
  for (const auto& [name, value] : clip.attributes)
    if (!value.empty()) s += name + " " + value + kDot;
  return s + fmt::format("{:.1f} s", clip.seconds());
}

void draw_strip(Canvas& canvas, const StripPlan& plan) {
  draw_header(canvas, plan);
  const double right = plan.options.width - kMargin - (plan.options.trajectory ? kInset + kGap : 0);
  for (const auto& row : plan.rows) {
    const double caption = row.top + 14;
    const std::string title = canvas.fitting(row.source->title, 13, plan.options.width * 0.6, true);
    canvas.text({kMargin, caption}, title, 13, kText, Align::left, true);
    const double behind = kMargin + canvas.text_width(title, 13, true) + 14;
    canvas.text({behind, caption}, canvas.fitting(describe(row.source->clip), 13, plan.options.width - kMargin - behind), 13, kQuiet);
    draw_ground(canvas, plan, row, right);
    for (const StripFigure& f : row.figures) draw_contacts(canvas, plan, row, f);
    for (const StripFigure& f : row.figures) draw_figure(canvas, plan, row, f);
    draw_times(canvas, row, row.times + kTimes - 5);
    if (plan.options.contacts) draw_chart(canvas, plan, row, row.times + kTimes, right);
    if (plan.options.trajectory) draw_track(canvas, row, {right + kGap, row.top + kCaption});
  }
}

std::string film_strip(const std::vector<StripRow>& rows, const StripOptions& options, ImageFormat format, const std::string& description) {
  const StripPlan plan = plan_strip(rows, options);
  Canvas canvas(format, options.width, plan.height);
  draw_strip(canvas, plan);
  return canvas.finish(description);
}

}  // namespace mocap::draw
