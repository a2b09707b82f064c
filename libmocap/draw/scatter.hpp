// Scatter plots: points in the plane, coloured by group, circles for one kind of thing and crosses for another.
//
// Both axes have one scale and no ticks: the maps drawn here have none that mean anything. Points drawn later lie on top.
#pragma once
#include <string>
#include <vector>

#include "libmocap/draw/canvas.hpp"

namespace mocap::draw {

enum class Mark { circle, cross };

struct ScatterPoint {
  double x = 0, y = 0;  // y up
  int group = -1;       // index into Scatter::groups, -1: none of them
  Mark mark = Mark::circle;
};

struct Scatter {
  std::string title;                     // bold, above; cut to the width of the page
  std::string x_label, y_label;          // below the frame, and above its left corner
  std::string legend;                    // heading of the groups
  std::string circles = "", crosses = "";  // what the marks mean; the legend has those that occur, with how many there are
  std::vector<std::string> groups;
  std::string no_group = "(none)";       // what points of group -1 are called
  std::vector<ScatterPoint> points;
};

struct ScatterOptions {
  double width = 900, height = 640;  // pixels
  double mark = 4;                   // radius, pixels
};

// The colour of a group: ten that are told apart by most who are colour-blind (seven of Okabe and Ito's, three of Tol's muted ones), then
// darker, then lighter shades of them, then again from the first. -1: grey.
Color group_color(int group);

// The bytes of a PNG or SVG file, with `description` inside (Canvas::finish). A legend that does not fit ends with "and N more". Error(usage)
// for a page narrower than 300 or lower than 200 pixels, or beyond kMaximumSide; Error(data) without points, and for one that is not
// finite or of a group that is not there.
std::string scatter(const Scatter& plot, const ScatterOptions& options, ImageFormat format, const std::string& description = {});

// Where a point lies on the page: the centre of its mark, pixels. [N] In the order of the points.
std::vector<Vector2> scatter_places(const Scatter& plot, const ScatterOptions& options);

}  // namespace mocap::draw
