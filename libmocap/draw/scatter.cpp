#include "libmocap/draw/scatter.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "libmocap/base/error.hpp"

namespace mocap::draw {
namespace {

constexpr Color kWhite{1, 1, 1}, kFrame{0.72, 0.72, 0.72}, kText{0.15, 0.15, 0.15}, kQuiet{0.4, 0.4, 0.4}, kNone{0.62, 0.62, 0.62};
constexpr double kMargin = 16, kTop = 54, kBottom = 32, kGap = 18, kTextSize = 13, kLine = 19, kSwatch = 18;

// The frame that points lie in, and what is left of it at its right for the legend.
struct Layout {
  Vector2 corner, size;
  double legend = 0;  // x
};

Layout layout_of(const ScatterOptions& o) {
  if (!(o.width >= 300 && o.height >= 200))
    refuse_usage(fmt::format("a plot of {:.0f} x {:.0f} pixels, expected at least 300 x 200", std::clamp(o.width, 0.0, 1e9), std::clamp(o.height, 0.0, 1e9)));
  if (!(o.mark > 0 && o.mark <= 100)) refuse_usage(fmt::format("marks of {} pixels, expected more than 0 and at most 100", o.mark));
  const double legend = std::min(0.3 * o.width, 240.0);
  Layout l;
  l.corner = {kMargin, kTop};
  l.size = {o.width - 2 * kMargin - legend - kGap, o.height - kTop - kBottom};
  l.legend = l.corner.x() + l.size.x() + kGap;
  return l;
}

// Crosses stand out from what lies under them, and rings stay seen under crosses.
void draw_mark(Canvas& canvas, const Vector2& at, Mark mark, double radius, const Color& color) {
  const double width = std::max(1.0, 0.4 * radius);
  if (mark == Mark::circle) return canvas.ring(at, radius, color, width);
  const double arm = 0.85 * radius;
  canvas.line(at - Vector2(arm, arm), at + Vector2(arm, arm), color, width);
  canvas.line(at - Vector2(arm, -arm), at + Vector2(arm, -arm), color, width);
}

std::string counted(const std::string& what, std::size_t n) { return fmt::format("{}{}({})", what, what.empty() ? "" : " ", n); }

}  // namespace

Color group_color(int group) {
  static constexpr std::array<Color, 10> kPalette = {{{0.000, 0.447, 0.698},    // blue
                                                      {0.835, 0.369, 0.000},    // vermilion
                                                      {0.000, 0.620, 0.451},    // bluish green
                                                      {0.800, 0.475, 0.655},    // reddish purple
                                                      {0.902, 0.624, 0.000},    // orange
                                                      {0.337, 0.706, 0.914},    // sky blue
                                                      {0.100, 0.100, 0.100},    // black
                                                      {0.533, 0.133, 0.333},    // wine
                                                      {0.200, 0.133, 0.533},    // indigo
                                                      {0.600, 0.600, 0.200}}};  // olive
  if (group < 0) return kNone;
  const auto n = static_cast<int>(kPalette.size());
  const Color c = kPalette[static_cast<std::size_t>(group % n)];
  const int shade = group / n % 3;
  if (shade == 1) return {0.6 * c.red, 0.6 * c.green, 0.6 * c.blue};
  if (shade == 2) return {0.5 + 0.5 * c.red, 0.5 + 0.5 * c.green, 0.5 + 0.5 * c.blue};
  return c;
}

std::vector<Vector2> scatter_places(const Scatter& plot, const ScatterOptions& options) {
  const Layout l = layout_of(options);
  if (plot.points.empty()) refuse({}, "a plot of 0 points, expected at least one");
  Vector2 low(plot.points[0].x, plot.points[0].y), high = low;
  for (std::size_t i = 0; i < plot.points.size(); ++i) {
    const ScatterPoint& p = plot.points[i];
    // Differences are taken, which stay finite up to here.
    if (!(std::abs(p.x) <= 1e300 && std::abs(p.y) <= 1e300)) refuse({}, fmt::format("point {} lies at {}, {}, expected finite numbers", i + 1, p.x, p.y));
    if (p.group < -1 || p.group >= static_cast<int>(plot.groups.size())) refuse({}, fmt::format("point {} is of group {}, expected one of {}", i + 1, p.group, plot.groups.size()));
    low = low.cwiseMin(Vector2(p.x, p.y));
    high = high.cwiseMax(Vector2(p.x, p.y));
  }
  const Vector2 extent = high - low, room = l.size.array() - 2 * (2 * options.mark + 4);
  const double scale = std::min(extent.x() > 0 ? room.x() / extent.x() : INFINITY, extent.y() > 0 ? room.y() / extent.y() : INFINITY);
  const Vector2 centre = l.corner + l.size / 2, middle = low + extent / 2;
  std::vector<Vector2> out;
  for (const ScatterPoint& p : plot.points) {
    const Vector2 from = Vector2(p.x, p.y) - middle;
    out.push_back(std::isfinite(scale) ? Vector2(centre.x() + from.x() * scale, centre.y() - from.y() * scale) : centre);
  }
  return out;
}

std::string scatter(const Scatter& plot, const ScatterOptions& options, ImageFormat format, const std::string& description) {
  const Layout l = layout_of(options);
  const auto places = scatter_places(plot, options);
  Canvas canvas(format, options.width, options.height);
  canvas.text({kMargin, 24}, canvas.fitting(plot.title, 15, options.width - 2 * kMargin, true), 15, kText, Align::left, true);
  canvas.text({kMargin, kTop - 8}, canvas.fitting(plot.y_label, kTextSize, l.size.x()), kTextSize, kQuiet);
  const std::string x_label = canvas.fitting(plot.x_label, kTextSize, l.size.x());
  canvas.text({l.corner.x() + l.size.x(), l.corner.y() + l.size.y() + 20}, x_label, kTextSize, kQuiet, Align::right);
  canvas.rectangle(l.corner - Vector2(1, 1), l.size + Vector2(2, 2), kFrame);
  canvas.rectangle(l.corner, l.size, kWhite);
  for (std::size_t i = 0; i < places.size(); ++i) draw_mark(canvas, places[i], plot.points[i].mark, options.mark, group_color(plot.points[i].group));

  const double room = options.width - kMargin - l.legend - kSwatch;
  double y = l.corner.y() + 12;
  const auto entry = [&](const std::string& text) {
    canvas.text({l.legend + kSwatch, y}, canvas.fitting(text, kTextSize, room), kTextSize, kText);
    y += kLine;
  };
  const double legend_mark = std::min(options.mark, 6.0);
  for (const auto& [mark, text] : {std::pair{Mark::circle, &plot.circles}, {Mark::cross, &plot.crosses}}) {
    const auto n = static_cast<std::size_t>(std::count_if(plot.points.begin(), plot.points.end(), [m = mark](const ScatterPoint& p) { return p.mark == m; }));
    if (n == 0) continue;
    draw_mark(canvas, {l.legend + 6, y - 4}, mark, legend_mark, kText);
    entry(counted(*text, n));
  }
  std::vector<std::size_t> count(plot.groups.size() + 1, 0);  // the last: none
  for (const ScatterPoint& p : plot.points) ++count[p.group < 0 ? plot.groups.size() : static_cast<std::size_t>(p.group)];
  std::vector<int> shown;
  for (std::size_t g = 0; g < plot.groups.size(); ++g)
    if (count[g] > 0) shown.push_back(static_cast<int>(g));
  if (count.back() > 0 && !plot.groups.empty()) shown.push_back(-1);
  if (shown.empty()) return canvas.finish(description);
  y += 8;
  if (!plot.legend.empty()) {
    canvas.text({l.legend, y}, canvas.fitting(plot.legend, kTextSize, room + kSwatch, true), kTextSize, kText, Align::left, true);
    y += kLine;
  }
  for (std::size_t k = 0; k < shown.size(); ++k) {
    if (y + kLine > l.corner.y() + l.size.y() && k + 1 < shown.size()) {
      entry(fmt::format("and {} more", shown.size() - k));
      break;
    }
    canvas.disc({l.legend + 6, y - 4}, 5, group_color(shown[k]));
    entry(shown[k] < 0 ? counted(plot.no_group, count.back()) : counted(plot.groups[static_cast<std::size_t>(shown[k])], count[static_cast<std::size_t>(shown[k])]));
  }
  return canvas.finish(description);
}

}  // namespace mocap::draw
