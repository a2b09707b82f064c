// UTF-8 and its neighbours: joint names in text files, unicode arrays in npz files, strings in HDF5.
#pragma once
#include <optional>
#include <string>
#include <string_view>

namespace mocap {

// Code points of a UTF-8 text; nullopt where it is not UTF-8 (overlong forms and surrogates included).
std::optional<std::u32string> from_utf8(std::string_view text);
// Code points above 0x10ffff and surrogates become U+FFFD.
std::string to_utf8(std::u32string_view text);

inline bool is_utf8(std::string_view text) { return from_utf8(text).has_value(); }
inline std::string latin1_to_utf8(std::string_view text) {
  std::u32string points;
  for (const char c : text) points += static_cast<unsigned char>(c);
  return to_utf8(points);
}

}  // namespace mocap
