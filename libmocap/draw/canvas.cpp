#include "libmocap/draw/canvas.hpp"

#include <cairo-svg.h>
#include <cairo.h>
#include <zlib.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <utility>

#include "libmocap/base/error.hpp"

namespace mocap::draw {
namespace {

cairo_status_t append(void* closure, const unsigned char* data, unsigned int length) {
  static_cast<std::string*>(closure)->append(reinterpret_cast<const char*>(data), length);
  return CAIRO_STATUS_SUCCESS;
}

// Length of the UTF-8 character that starts `s`, 0 where there is none.
std::size_t utf8_length(std::string_view s) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(s[i]); };
  const unsigned char c = byte(0);
  const std::size_t n = c < 0x80 ? 1 : c >= 0xc2 && c < 0xe0 ? 2 : c >= 0xe0 && c < 0xf0 ? 3 : c >= 0xf0 && c < 0xf5 ? 4 : 0;
  if (n == 0 || n > s.size()) return 0;
  for (std::size_t i = 1; i < n; ++i)
    if ((byte(i) & 0xc0) != 0x80) return 0;
  // Overlong forms, surrogates, beyond U+10FFFF.
  if ((c == 0xe0 && byte(1) < 0xa0) || (c == 0xed && byte(1) >= 0xa0) || (c == 0xf0 && byte(1) < 0x90) || (c == 0xf4 && byte(1) >= 0x90)) return 0;
  return n;
}

// cairo stops drawing for good at the first byte that is no UTF-8.
std::string printable(std::string_view s) {
  std::string out;
  while (!s.empty()) {
    const std::size_t n = utf8_length(s);
    const bool control = n == 1 && (static_cast<unsigned char>(s[0]) < 0x20 || s[0] == 0x7f);
    if (n == 0 || control) {
      out += '?';
      s.remove_prefix(1);
    } else {
      out += s.substr(0, n);
      s.remove_prefix(n);
    }
  }
  return out;
}

std::string big_endian(std::uint32_t n) {
  return {static_cast<char>(n >> 24), static_cast<char>(n >> 16), static_cast<char>(n >> 8), static_cast<char>(n)};
}

// An iTXt chunk before IEND, which is the last 12 bytes (PNG specification, 11.3.4.5).
std::string with_png_text(std::string png, const std::string& text) {
  if (text.empty()) return png;
  const std::string body = std::string("iTXtDescription\0\0\0\0\0", 20) + text;
  const auto crc = crc32(0, reinterpret_cast<const Bytef*>(body.data()), static_cast<uInt>(body.size()));
  png.insert(png.size() - 12, big_endian(static_cast<std::uint32_t>(body.size() - 4)) + body + big_endian(static_cast<std::uint32_t>(crc)));
  return png;
}

std::string with_svg_metadata(std::string svg, const std::string& text) {
  if (text.empty()) return svg;
  std::string escaped;
  for (const char c : text) escaped += c == '<' ? "&lt;" : c == '&' ? "&amp;" : c == '>' ? "&gt;" : std::string(1, c);
  svg.insert(svg.find('>', svg.find("<svg")) + 1, "\n<metadata>" + escaped + "</metadata>");
  return svg;
}

// cairo numbers the surfaces of a process: id="surface7". One picture must not depend on how many came before.
std::string without_surface_number(std::string svg) {
  const std::string mark = "id=\"surface";
  for (std::size_t at = svg.find(mark); at != std::string::npos; at = svg.find(mark, at + 1)) {
    const std::size_t first = at + mark.size(), last = svg.find('"', first);
    svg.erase(first, last - first);
  }
  return svg;
}

}  // namespace

ImageFormat image_format_of(const std::string& path) {
  std::string ending = path.size() >= 4 ? path.substr(path.size() - 4) : "";
  for (char& c : ending) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (path == "-" || ending == ".png") return ImageFormat::png;
  if (ending == ".svg") return ImageFormat::svg;
  refuse_usage(path + ": a picture's name, expected it to end in .png or .svg", "--format says what to write whatever the name");
}

struct Canvas::State {
  ImageFormat format;
  double width, height;
  std::string bytes;  // an SVG surface writes here until it is finished
  cairo_surface_t* surface = nullptr;
  cairo_t* cairo = nullptr;

  ~State() {
    if (cairo) cairo_destroy(cairo);
    if (surface) cairo_surface_destroy(surface);
  }
  void color(const Color& c) { cairo_set_source_rgb(cairo, c.red, c.green, c.blue); }
  void font(double size, bool bold) {
    cairo_select_font_face(cairo, "sans-serif", CAIRO_FONT_SLANT_NORMAL, bold ? CAIRO_FONT_WEIGHT_BOLD : CAIRO_FONT_WEIGHT_NORMAL);
    cairo_set_font_size(cairo, size);
  }
  void check() {
    const cairo_status_t status = cairo ? cairo_status(cairo) : cairo_surface_status(surface);
    if (status != CAIRO_STATUS_SUCCESS) throw Error(Exit::internal, {}, std::string("cairo: ") + cairo_status_to_string(status));
  }
};

Canvas::Canvas(ImageFormat format, double width, double height) : state_(std::make_unique<State>()) {
  if (!(width >= 1 && width <= kMaximumSide && height >= 1 && height <= kMaximumSide))
    refuse_usage("a picture of " + std::to_string(std::lround(std::clamp(width, 0.0, 1e9))) + " x " + std::to_string(std::lround(std::clamp(height, 0.0, 1e9))) +
                 " pixels, expected sides of 1 to " + std::to_string(std::lround(kMaximumSide)));
  state_->format = format;
  state_->width = std::ceil(width);
  state_->height = std::ceil(height);
  state_->surface = format == ImageFormat::png
                        ? cairo_image_surface_create(CAIRO_FORMAT_RGB24, static_cast<int>(state_->width), static_cast<int>(state_->height))
                        : cairo_svg_surface_create_for_stream(append, &state_->bytes, state_->width, state_->height);
  state_->check();
  state_->cairo = cairo_create(state_->surface);
  cairo_set_line_cap(state_->cairo, CAIRO_LINE_CAP_ROUND);
  cairo_set_line_join(state_->cairo, CAIRO_LINE_JOIN_ROUND);
  rectangle({0, 0}, {state_->width, state_->height}, {1, 1, 1});
}

Canvas::~Canvas() = default;
Canvas::Canvas(Canvas&&) noexcept = default;
Canvas& Canvas::operator=(Canvas&&) noexcept = default;

double Canvas::width() const { return state_->width; }
double Canvas::height() const { return state_->height; }

void Canvas::polyline(const std::vector<Vector2>& points, const Color& color, double line_width, double dash) {
  if (points.size() < 2) return;
  cairo_t* c = state_->cairo;
  state_->color(color);
  cairo_set_line_width(c, line_width);
  cairo_set_dash(c, &dash, dash > 0 ? 1 : 0, 0);
  cairo_move_to(c, points[0].x(), points[0].y());
  for (std::size_t i = 1; i < points.size(); ++i) cairo_line_to(c, points[i].x(), points[i].y());
  cairo_stroke(c);
}

void Canvas::line(const Vector2& a, const Vector2& b, const Color& color, double line_width) { polyline({a, b}, color, line_width); }

void Canvas::disc(const Vector2& centre, double radius, const Color& color) {
  state_->color(color);
  cairo_new_path(state_->cairo);
  cairo_arc(state_->cairo, centre.x(), centre.y(), radius, 0, 2 * std::numbers::pi);
  cairo_fill(state_->cairo);
}

void Canvas::ring(const Vector2& centre, double radius, const Color& color, double line_width) {
  state_->color(color);
  cairo_set_line_width(state_->cairo, line_width);
  cairo_set_dash(state_->cairo, nullptr, 0, 0);
  cairo_new_path(state_->cairo);
  cairo_arc(state_->cairo, centre.x(), centre.y(), radius, 0, 2 * std::numbers::pi);
  cairo_close_path(state_->cairo);
  cairo_stroke(state_->cairo);
}

void Canvas::rectangle(const Vector2& corner, const Vector2& size, const Color& color) {
  state_->color(color);
  cairo_rectangle(state_->cairo, corner.x(), corner.y(), size.x(), size.y());
  cairo_fill(state_->cairo);
}

void Canvas::text(const Vector2& at, std::string_view text, double size, const Color& color, Align align, bool bold) {
  const std::string shown = printable(text);
  const double shift = align == Align::left ? 0 : text_width(shown, size, bold) * (align == Align::centre ? 0.5 : 1);
  state_->font(size, bold);
  state_->color(color);
  cairo_move_to(state_->cairo, at.x() - shift, at.y());
  cairo_show_text(state_->cairo, shown.c_str());
}

double Canvas::text_width(std::string_view text, double size, bool bold) const {
  state_->font(size, bold);
  cairo_text_extents_t extents;
  cairo_text_extents(state_->cairo, printable(text).c_str(), &extents);
  return extents.x_advance;
}

std::string Canvas::fitting(std::string_view text, double size, double width, bool bold) const {
  std::string shown = printable(text.substr(0, 1000));
  if (text.size() <= 1000 && text_width(shown, size, bold) <= width) return shown;
  const std::string ellipsis = "\xe2\x80\xa6";
  while (!shown.empty()) {
    while ((static_cast<unsigned char>(shown.back()) & 0xc0) == 0x80) shown.pop_back();
    shown.pop_back();
    if (text_width(shown + ellipsis, size, bold) <= width) return shown.empty() ? shown : shown + ellipsis;
  }
  return shown;
}

std::string Canvas::finish(const std::string& description) {
  state_->check();
  cairo_destroy(std::exchange(state_->cairo, nullptr));
  if (state_->format == ImageFormat::png) {
    cairo_surface_flush(state_->surface);
    if (cairo_surface_write_to_png_stream(state_->surface, append, &state_->bytes) != CAIRO_STATUS_SUCCESS)
      throw Error(Exit::internal, {}, "cairo: the picture cannot be encoded");
    return with_png_text(std::move(state_->bytes), description);
  }
  cairo_surface_finish(state_->surface);
  state_->check();
  return with_svg_metadata(without_surface_number(std::move(state_->bytes)), description);
}

}  // namespace mocap::draw
