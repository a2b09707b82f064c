// Looks at the pixels of a PNG in memory.
#pragma once
#include <cairo.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>

#include "libmocap/draw/canvas.hpp"

namespace mocap::testing {

class Picture {
 public:
  explicit Picture(const std::string& png) : rest_(png) { surface_ = cairo_image_surface_create_from_png_stream(next, &rest_); }
  ~Picture() { cairo_surface_destroy(surface_); }
  Picture(const Picture&) = delete;
  Picture& operator=(const Picture&) = delete;

  bool valid() const { return cairo_surface_status(surface_) == CAIRO_STATUS_SUCCESS; }
  int width() const { return cairo_image_surface_get_width(surface_); }
  int height() const { return cairo_image_surface_get_height(surface_); }
  draw::Color at(double x, double y) const {
    std::uint32_t pixel = 0;
    std::memcpy(&pixel, cairo_image_surface_get_data(surface_) + static_cast<int>(y) * cairo_image_surface_get_stride(surface_) + 4 * static_cast<int>(x), 4);
    return {(pixel >> 16 & 255) / 255.0, (pixel >> 8 & 255) / 255.0, (pixel & 255) / 255.0};
  }
  bool is(const Vector2& p, const draw::Color& c) const {
    const draw::Color found = at(p.x(), p.y());
    return std::max({std::abs(found.red - c.red), std::abs(found.green - c.green), std::abs(found.blue - c.blue)}) < 0.02;
  }
  int count(const draw::Color& c) const {
    int n = 0;
    for (int y = 0; y < height(); ++y)
      for (int x = 0; x < width(); ++x) n += is({x, y}, c);
    return n;
  }

 private:
  static cairo_status_t next(void* closure, unsigned char* data, unsigned int length) {
    auto& rest = *static_cast<std::string*>(closure);
    if (rest.size() < length) return CAIRO_STATUS_READ_ERROR;
    std::memcpy(data, rest.data(), length);
    rest.erase(0, length);
    return CAIRO_STATUS_SUCCESS;
  }
  std::string rest_;
  cairo_surface_t* surface_;
};

}  // namespace mocap::testing
