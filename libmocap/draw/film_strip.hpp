// Film strips: each row one clip, its figures evenly spaced in time over a ground line.
//
// Left limbs are blue, right limbs orange (Okabe & Ito's colour-blind safe palette), the trunk is dark grey; feet on the
// ground are marked below the line. All rows share one scale, which the bar at the top shows. Orthographic.
#pragma once
#include <string>
#include <vector>

#include "libmocap/clip/clip.hpp"
#include "libmocap/draw/camera.hpp"
#include "libmocap/draw/canvas.hpp"
#include "libmocap/draw/sides.hpp"

namespace mocap::draw {

inline constexpr Color kLeftColor{0.0, 0.447, 0.698};
inline constexpr Color kRightColor{0.835, 0.369, 0.0};
inline constexpr Color kTrunkColor{0.25, 0.25, 0.25};

// path: figures at their true horizontal place. time: at even distances. automatic: path where all rows travel far
// enough, forwards all the time, that figures stand clear of each other.
enum class Spread { automatic, time, path };
Spread parse_spread(const std::string& text);  // "auto", "time", "path"; Error(usage)

struct StripOptions {
  View view = View::side;
  Spread spread = Spread::automatic;
  int figures = 12;         // a row, at most; fewer where the clip has fewer frames
  double width = 1600;      // of the page, pixels
  double row_height = 240;  // most that the figures of a row may take, pixels
  bool trajectory = false;  // the root's way over the ground, from above, at the end of each row; with the path asked for
  bool contacts = false;    // a foot-fall chart over the whole clip below each row
};

struct StripRow {
  std::string title;  // bold, first in the caption
  Clip clip;
};
// "action walking · gender female · 4.2 s": what stands behind the title.
std::string describe(const Clip& clip);

// One figure on the page: poses projected, nothing drawn yet.
struct StripFigure {
  std::size_t frame = 0;
  double time_s = 0;
  double anchor = 0;                // pixels, x of the root
  std::vector<Vector2> joints;      // [J] pixels
  std::vector<Vector2> end_sites;   // [E] pixels
  std::vector<Vector2> shadow;      // [J] joints moved down to the ground, pixels
  std::vector<double> nearness;     // [J] metres towards the viewer
  std::array<bool, 2> down{};       // left, right foot on the ground
  std::array<double, 2> slot{};     // pixels, x from and to which the figure has to itself
};

struct StripPlan {
  struct Row {
    const StripRow* source = nullptr;
    Anatomy anatomy;
    double top = 0, ground = 0, bottom = 0;  // pixels; ground: y of z = 0 (side and front view)
    double times = 0;                        // pixels, y below figures and contact marks, where the times begin
    bool has_contacts = false;
    Vector3 forward = Vector3::UnitX();
    std::vector<StripFigure> figures;
  };
  StripOptions options;
  double height = 0;            // of the page, pixels
  double pixels_per_metre = 1;
  bool along_path = false;
  std::vector<Row> rows;
};

// Lays out a page `options.width` wide. `rows` must outlive the plan. Throws Error(data) where a clip breaks an invariant
// (no frames, NaN, ...) or its figure is wider than 1 km; Error(usage) without rows or with options out of range.
StripPlan plan_strip(const std::vector<StripRow>& rows, const StripOptions& options);

// Draws the plan; the canvas should have its size.
void draw_strip(Canvas& canvas, const StripPlan& plan);

// Both at once: the bytes of a PNG or SVG file, with `description` inside (Canvas::finish).
std::string film_strip(const std::vector<StripRow>& rows, const StripOptions& options, ImageFormat format, const std::string& description = {});

}  // namespace mocap::draw
