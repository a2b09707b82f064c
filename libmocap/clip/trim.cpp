#include "libmocap/clip/trim.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "libmocap/base/error.hpp"

namespace mocap {

Trim Trim::parse(const std::string& text) {
  const auto wrong = [&] { refuse_usage(fmt::format("--trim: '{}', expected A or A,B: seconds (0.5) or percent (10%) from the start and the end, leaving something", text)); };
  const auto amount = [&](std::string_view part) {
    Amount a;
    a.percent = part.ends_with('%');
    if (a.percent) part.remove_suffix(1);
    const auto [end, error] = std::from_chars(part.data(), part.data() + part.size(), a.value);
    if (error != std::errc{} || end != part.data() + part.size() || !std::isfinite(a.value) || std::signbit(a.value)) wrong();
    return a;
  };
  const auto comma = text.find(',');
  Trim t;
  t.start = amount(std::string_view(text).substr(0, comma));
  t.end = comma == std::string::npos ? t.start : amount(std::string_view(text).substr(comma + 1));
  if ((t.start.percent ? t.start.value : 0) + (t.end.percent ? t.end.value : 0) >= 100) wrong();
  return t;
}

Clip trim(const Clip& clip, const Trim& amounts) {
  const auto all = static_cast<double>(clip.frames());
  const auto frames = [&](const Trim::Amount& a) { return std::round(a.percent ? a.value / 100 * all : a.value * clip.frame_rate_hz); };
  const double first = frames(amounts.start), last = frames(amounts.end);
  if (first + last >= all)
    refuse({{}, 0, "clip " + clip.name}, fmt::format("{:.3g} s of motion, expected more than the {:.3g} s to be trimmed", clip.seconds(), (first + last) / clip.frame_rate_hz));
  return cut(clip, static_cast<std::size_t>(first), clip.frames() - static_cast<std::size_t>(first) - static_cast<std::size_t>(last));
}

}  // namespace mocap
