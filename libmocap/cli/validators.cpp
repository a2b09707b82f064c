#include "libmocap/cli/validators.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>

namespace mocap::cli {
namespace {

template <class T>
std::optional<T> parse_all(std::string_view text) {
  if (text.size() > 1 && text.front() == '+' && text[1] != '-') text.remove_prefix(1);
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

// The description "UNIT: what is expected" is taken apart again by docs.cpp.
template <class F>
CLI::Validator numeric(const std::string& unit, const std::string& expected, F accept) {
  return CLI::Validator(
      [expected, accept](std::string& text) -> std::string {
        const auto value = parse_number(text);
        return value && accept(*value) ? "" : fmt::format("'{}', expected a number{}{}", text, expected.empty() ? "" : " ", expected);
      },
      unit + ": " + expected);
}

}  // namespace

std::optional<double> parse_number(std::string_view text) {
  const auto value = parse_all<double>(text);
  return value && std::isfinite(*value) ? value : std::nullopt;
}

std::optional<std::int64_t> parse_whole(std::string_view text) {
  const std::string_view digits = !text.empty() && (text.front() == '-' || text.front() == '+') ? text.substr(1) : text;
  if (digits.size() > 1 && digits.front() == '0') return std::nullopt;
  return parse_all<std::int64_t>(text);
}

CLI::Validator number(const std::string& unit) {
  return numeric(unit, "", [](double) { return true; });
}

CLI::Validator positive(const std::string& unit) {
  return numeric(unit, "above 0", [](double v) { return v > 0; });
}

CLI::Validator non_negative(const std::string& unit) {
  return numeric(unit, "of at least 0", [](double v) { return v >= 0; });
}

CLI::Validator between(double low, double high, const std::string& unit) {
  return numeric(unit, fmt::format("from {} to {}", low, high), [low, high](double v) { return v >= low && v <= high; });
}

CLI::Validator whole(std::int64_t low, std::int64_t high, const std::string& unit) {
  const bool below = low > std::numeric_limits<std::int64_t>::min(), above = high < std::numeric_limits<std::int64_t>::max();
  const std::string expected = below && above ? fmt::format("from {} to {}", low, high)
                               : below        ? fmt::format("of at least {}", low)
                               : above        ? fmt::format("of at most {}", high)
                                              : "";
  return CLI::Validator(
      [low, high, expected](std::string& text) -> std::string {
        const auto value = parse_whole(text);
        return value && *value >= low && *value <= high
                   ? ""
                   : fmt::format("'{}', expected a whole number{}{}", text, expected.empty() ? "" : " ", expected);
      },
      unit + ": " + expected);
}

CLI::Validator one_of(const std::vector<std::string>& words) {
  return CLI::Validator(
      [words](std::string& text) -> std::string {
        for (const auto& w : words)
          if (w == text) return "";
        return fmt::format("'{}', expected {}{}", text, words.size() > 1 ? "one of " : "", fmt::join(words, ", "));
      },
      fmt::format("{}: ", fmt::join(words, "|")));
}

CLI::Validator path(const std::string& unit) {
  return CLI::Validator([](std::string& text) -> std::string { return text.empty() ? "an empty path" : ""; }, unit + ": ");
}

}  // namespace mocap::cli
