// A page to draw on that becomes a PNG or SVG file in memory (cairo).
//
// Units are pixels (SVG: user units), origin top left, y down. Equal calls give equal bytes on one machine; text is drawn
// in the machine's "sans-serif".
#pragma once
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "libmocap/math/rotation.hpp"

namespace mocap::draw {

enum class ImageFormat { png, svg };

// From the ending of a file name; PNG for "-". Error(usage) for any other ending.
ImageFormat image_format_of(const std::string& path);

struct Color {
  double red = 0, green = 0, blue = 0;
};

enum class Align { left, centre, right };

inline constexpr double kMaximumSide = 32000;  // pixels; cairo's surfaces end at 32767

class Canvas {
 public:
  // Error(usage) unless both sides are 1 .. kMaximumSide. The page is white.
  Canvas(ImageFormat format, double width, double height);
  ~Canvas();
  Canvas(Canvas&&) noexcept;
  Canvas& operator=(Canvas&&) noexcept;

  double width() const;
  double height() const;

  // Round caps and joins; fewer than two points draw nothing. `dash`: on and off length, 0 is solid.
  void polyline(const std::vector<Vector2>& points, const Color& color, double line_width, double dash = 0);
  void line(const Vector2& a, const Vector2& b, const Color& color, double line_width);
  void disc(const Vector2& centre, double radius, const Color& color);
  void ring(const Vector2& centre, double radius, const Color& color, double line_width);
  void rectangle(const Vector2& corner, const Vector2& size, const Color& color);

  // Baseline at `at`. Bytes that are no UTF-8 and control characters appear as '?'.
  void text(const Vector2& at, std::string_view text, double size, const Color& color, Align align = Align::left, bool bold = false);
  double text_width(std::string_view text, double size, bool bold = false) const;
  // The longest beginning of `text` that fits into `width`, with an ellipsis where something was left out.
  std::string fitting(std::string_view text, double size, double width, bool bold = false) const;

  // Ends the page; nothing may be drawn afterwards. The bytes of the file. `description`, where not empty, travels inside:
  // PNG as an iTXt chunk "Description", SVG as <metadata>.
  std::string finish(const std::string& description = {});

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace mocap::draw
