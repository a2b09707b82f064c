#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "libmocap/base/error.hpp"
#include "libmocap/draw/film_strip.hpp"
#include "libmocap/draw/strip_metrics.hpp"

namespace mocap::draw {
namespace {

// One figure before the scale is known: metres in the picture plane, y up.
struct Projected {
  std::size_t frame;
  double root_x, ground_y;  // of the root, and of the ground below it
  std::vector<Vector2> joints, end_sites, shadow;
  std::vector<double> nearness;
  double left, right, low, high;  // extent relative to root_x and ground_y
};

struct Draft {
  std::vector<Projected> figures;
  double low = 0, high = 0, left = 0, right = 0;  // left and right: most that any figure reaches out from its root
  double path_left = 0, path_right = 0;           // extent of all figures at their true place
  bool clear_path = false;
};

constexpr double kMostMetres = 1000;

Projected project(const Clip& clip, std::size_t frame, const Camera& camera, const Anatomy& anatomy, bool level_view) {
  Pose pose;
  world_pose(clip, frame, pose);
  const auto tips = end_site_positions(*clip.skeleton, pose);
  Projected f;
  f.frame = frame;
  f.root_x = camera.project(pose.positions[0]).x();
  f.ground_y = camera.project({pose.positions[0].x(), pose.positions[0].y(), 0}).y();
  f.left = f.right = 0;
  f.low = std::numeric_limits<double>::infinity();
  f.high = -f.low;
  const auto reach = [&](const Vector2& p) {
    f.left = std::min(f.left, p.x() - f.root_x);
    f.right = std::max(f.right, p.x() - f.root_x);
    f.low = std::min(f.low, p.y() - f.ground_y);
    f.high = std::max(f.high, p.y() - f.ground_y);
  };
  for (std::size_t j = 0; j < pose.positions.size(); ++j) {
    const Vector3& p = pose.positions[j];
    f.joints.push_back(camera.project(p));
    f.shadow.push_back(camera.project({p.x(), p.y(), 0}));
    f.nearness.push_back(camera.nearness(p));
    reach(f.joints.back());
    if (!level_view) reach(f.shadow.back());
  }
  for (const Vector3& p : tips) {
    f.end_sites.push_back(camera.project(p));
    reach(f.end_sites.back());
  }
  if (anatomy.head >= 0) reach(f.joints[static_cast<std::size_t>(anatomy.head)] + Vector2(0, 0.2));
  if (!(f.right - f.left < kMostMetres && f.high - f.low < kMostMetres && std::abs(f.root_x) < 1e6 && std::abs(f.ground_y) < 1e6 && std::abs(f.high) < kMostMetres && std::abs(f.low) < kMostMetres))
    refuse({{}, 0, "clip " + clip.name + " frame " + std::to_string(frame)}, fmt::format("a figure that reaches {:.3g} m across, expected at most {} m", f.right - f.left, kMostMetres));
  return f;
}

std::vector<std::size_t> chosen_frames(std::size_t frames, int figures) {
  const auto n = std::min(frames, static_cast<std::size_t>(figures));
  std::vector<std::size_t> out;
  for (std::size_t k = 0; k < n; ++k)
    out.push_back(n == 1 ? 0 : static_cast<std::size_t>(std::llround(static_cast<double>(k) * static_cast<double>(frames - 1) / static_cast<double>(n - 1))));
  return out;
}

Draft draft_row(const Clip& clip, const StripOptions& options, const Camera& camera, const Anatomy& anatomy) {
  const bool level_view = options.view == View::side || options.view == View::front;
  Draft d;
  for (const std::size_t t : chosen_frames(clip.frames(), options.figures)) d.figures.push_back(project(clip, t, camera, anatomy, level_view));
  d.path_left = d.path_right = d.figures.front().root_x;
  double widths = 0;
  for (const auto& f : d.figures) {
    d.left = std::min(d.left, f.left);
    d.right = std::max(d.right, f.right);
    d.path_left = std::min(d.path_left, f.root_x + f.left);
    d.path_right = std::max(d.path_right, f.root_x + f.right);
    widths += (f.right - f.left) / static_cast<double>(d.figures.size());
  }
  double shortest = std::numeric_limits<double>::infinity();
  for (std::size_t k = 1; k < d.figures.size(); ++k) shortest = std::min(shortest, d.figures[k].root_x - d.figures[k - 1].root_x);
  d.clear_path = d.figures.size() > 1 && shortest > 0.6 * widths;
  return d;
}

bool any_contact(const Clip& clip) {
  return std::any_of(clip.contacts.begin(), clip.contacts.end(), [](const auto& c) { return c[0] || c[1]; });
}

void check_options(const std::vector<StripRow>& rows, const StripOptions& o) {
  if (rows.empty()) refuse_usage("a film strip of no clips, expected at least one");
  if (o.figures < 1 || o.figures > 1000) refuse_usage(fmt::format("{} figures a row, expected 1 to 1000", o.figures));
  if (!(o.width >= 200 && o.width <= kMaximumSide)) refuse_usage(fmt::format("a width of {:g} pixels, expected 200 to {:g}", o.width, kMaximumSide));
  if (!(o.row_height >= 40 && o.row_height <= 4000)) refuse_usage(fmt::format("a row height of {:g} pixels, expected 40 to 4000", o.row_height));
}

}  // namespace

Spread parse_spread(const std::string& text) {
  if (text == "auto") return Spread::automatic;
  if (text == "time") return Spread::time;
  if (text == "path") return Spread::path;
  refuse_usage("spread '" + text + "', expected auto, time or path");
}

StripPlan plan_strip(const std::vector<StripRow>& rows, const StripOptions& options) {
  check_options(rows, options);
  StripPlan plan;
  plan.options = options;
  std::vector<Draft> drafts;
  bool clear = true;
  for (const StripRow& r : rows) {
    r.clip.validate();
    StripPlan::Row row;
    row.source = &r;
    row.anatomy = anatomy_of(*r.clip.skeleton);
    row.has_contacts = any_contact(r.clip);
    row.forward = mean_facing(r.clip);
    drafts.push_back(draft_row(r.clip, options, camera_for(options.view, row.forward), row.anatomy));
    clear = clear && drafts.back().clear_path;
    plan.rows.push_back(std::move(row));
  }
  plan.along_path = options.spread == Spread::path || (options.spread == Spread::automatic && clear && options.view != View::front);

  // Away from the path every figure stands on the same line, however it moved towards the viewer.
  for (Draft& d : drafts)
    for (Projected& f : d.figures) {
      if (!plan.along_path) {
        for (auto* list : {&f.joints, &f.end_sites, &f.shadow})
          for (Vector2& p : *list) p.y() -= f.ground_y;
        f.ground_y = 0;
      }
      d.low = std::min(d.low, f.ground_y + f.low);
      d.high = std::max(d.high, f.ground_y + f.high);
    }

  // The largest scale at which every row fits its height and its width.
  const double inset = options.trajectory ? kInset + kGap : 0;
  const double available = options.width - 2 * kMargin - inset;
  double scale = 1e4;
  for (const Draft& d : drafts) {
    const double figure = d.right - d.left + kFigureGap, height = d.high - d.low;
    const double count = static_cast<double>(d.figures.size());
    scale = std::min(scale, available / (plan.along_path ? d.path_right - d.path_left + kFigureGap : figure * count));
    scale = std::min(scale, options.row_height / std::max(height, 0.5));
  }
  plan.pixels_per_metre = scale;

  double y = kHeader;
  for (std::size_t i = 0; i < drafts.size(); ++i) {
    const Draft& d = drafts[i];
    StripPlan::Row& row = plan.rows[i];
    const Clip& clip = rows[i].clip;
    const double count = static_cast<double>(d.figures.size()), slot = available / count;
    row.top = y;
    row.ground = y + kCaption + d.high * scale;
    for (const Projected& p : d.figures) {
      const double k = static_cast<double>(row.figures.size());
      StripFigure f;
      f.frame = p.frame;
      f.time_s = static_cast<double>(p.frame) / clip.frame_rate_hz;
      // Even slots; the figures' reach need not be symmetric about their root.
      const double in_slot = kMargin + k * slot + slot / 2 - (d.left + d.right) / 2 * scale;
      f.anchor = plan.along_path ? kMargin + (p.root_x - d.path_left + kFigureGap / 2) * scale : in_slot;
      f.slot = {kMargin + k * slot, kMargin + (k + 1) * slot};
      const auto place = [&](const Vector2& q) { return Vector2(f.anchor + (q.x() - p.root_x) * scale, row.ground - q.y() * scale); };
      for (const auto& q : p.joints) f.joints.push_back(place(q));
      for (const auto& q : p.end_sites) f.end_sites.push_back(place(q));
      for (const auto& q : p.shadow) f.shadow.push_back(place(q));
      f.nearness = p.nearness;
      if (!clip.contacts.empty()) f.down = {clip.contacts[p.frame][0] != 0, clip.contacts[p.frame][1] != 0};
      row.figures.push_back(std::move(f));
    }
    row.times = row.ground - d.low * scale + (row.has_contacts ? kContactMarks : 0);
    double bottom = row.times + kTimes + (options.contacts ? kChart : 0);
    if (options.trajectory) bottom = std::max(bottom, y + kCaption + kInset);
    row.bottom = bottom;
    y = bottom + kRowGap;
  }
  plan.height = y;
  return plan;
}

}  // namespace mocap::draw
