// Reading position in the text of a mocap file: blanks, words, numbers, and the line for error messages.
// Internal to libmocap/io.
#pragma once
#include <fast_float/fast_float.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <system_error>

namespace mocap::io {

inline bool is_blank(char c) { return c == ' ' || c == '\t'; }
inline bool is_line_end(char c) { return c == '\n' || c == '\r'; }
inline bool is_separator(char c) { return is_blank(c) || is_line_end(c); }

// One number starting at p: correctly rounded, the same in every locale. Returns its end, or nullptr where there is no
// finite number or it is not followed by a separator or `end` ("1,5", "0x10", "nan", "1e400").
inline const char* read_number(const char* p, const char* end, double& out) {
  // Plain decimals of at most 15 digits are whole numbers below 2^53 over a power of ten that a double holds exactly,
  // so one division rounds correctly (Clinger 1990). Nearly all of mocap text is that, and it takes two thirds of the
  // time of the general conversion.
  static constexpr double kPowers[] = {1,   1e1, 1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                       1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15};
  const char* q = p;
  const bool negative = q != end && *q == '-';
  q += negative;
  std::uint64_t whole = 0;
  const char* const first = q;
  unsigned digit = 0;
  while (q != end && (digit = static_cast<unsigned char>(*q) - unsigned{'0'}) < 10) whole = whole * 10 + digit, ++q;
  auto digits = q - first;
  std::ptrdiff_t decimals = 0;
  if (q != end && *q == '.') {
    const char* const point = q++;
    while (q != end && (digit = static_cast<unsigned char>(*q) - unsigned{'0'}) < 10) whole = whole * 10 + digit, ++q;
    decimals = q - point - 1;
    digits += decimals;
  }
  if (digits > 0 && digits <= 15 && (q == end || is_separator(*q))) {
    const double v = static_cast<double>(static_cast<std::int64_t>(whole)) / kPowers[decimals];
    out = negative ? -v : v;
    return q;
  }
  if (p != end && *p == '+' && p + 1 != end && (p[1] == '.' || (p[1] >= '0' && p[1] <= '9'))) ++p;
  const auto r = fast_float::from_chars(p, end, out);
  if (r.ec == std::errc::invalid_argument || !std::isfinite(out) || (r.ptr != end && !is_separator(*r.ptr)))
    return nullptr;
  return r.ptr;
}

struct TextCursor {
  const char* p;
  const char* end;
  long line = 1;

  explicit TextCursor(std::string_view text) : p(text.data()), end(text.data() + text.size()) {
    if (text.starts_with("\xef\xbb\xbf")) p += 3;
  }

  bool done() const { return p == end; }
  bool at_line_end() const { return p == end || is_line_end(*p); }

  void skip_blanks() {
    while (p != end && is_blank(*p)) ++p;
  }
  // Over one line end: LF, CRLF or a lone CR.
  void next_line() {
    if (p == end) return;
    if (*p++ == '\r' && p != end && *p == '\n') ++p;
    ++line;
  }
  void skip_space() {
    for (skip_blanks(); p != end && is_line_end(*p); skip_blanks()) next_line();
  }
  void skip_to_line_end() {
    while (!at_line_end()) ++p;
  }

  // Up to a separator, a brace or the end.
  std::string_view word() {
    const char* const first = p;
    while (p != end && !is_separator(*p) && *p != '{' && *p != '}') ++p;
    return {first, static_cast<std::size_t>(p - first)};
  }
  // Up to the end of the line or an opening brace, without surrounding blanks.
  std::string_view rest() {
    skip_blanks();
    const char* const first = p;
    while (!at_line_end() && *p != '{') ++p;
    const char* last = p;
    while (last != first && is_blank(last[-1])) --last;
    return {first, static_cast<std::size_t>(last - first)};
  }
  // The word ahead as it may stand in a message: printable, quoted, at most 40 characters.
  std::string shown() const {
    if (at_line_end()) return p == end ? "the end of the file" : "the end of the line";
    std::string s = "'";
    for (const char* q = p; q != end && !is_separator(*q); ++q) {
      if (q - p == 40) return s + "...'";
      s += static_cast<unsigned char>(*q) < 0x20 || *q == 0x7f ? '?' : *q;
    }
    return s + "'";
  }
};

// ASCII, whatever the locale.
inline bool same_ignoring_case(std::string_view a, std::string_view b) {
  const auto lower = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; };
  if (a.size() != b.size()) return false;
  for (std::size_t i = 0; i < a.size(); ++i)
    if (lower(a[i]) != lower(b[i])) return false;
  return true;
}

}  // namespace mocap::io
