#include "libmocap/cli/usage_error.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "libmocap/cli/option_values.hpp"

namespace mocap::cli {
namespace {

// Levenshtein distance, a swap of neighbours counting as one edit.
std::size_t edits(const std::string& a, const std::string& b) {
  std::vector<std::vector<std::size_t>> d(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i) d[i][0] = i;
  for (std::size_t j = 0; j <= b.size(); ++j) d[0][j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i)
    for (std::size_t j = 1; j <= b.size(); ++j) {
      d[i][j] = std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, d[i - 1][j - 1] + (a[i - 1] != b[j - 1])});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
    }
  return d[a.size()][b.size()];
}

std::string in_one_lower_case_line(std::string s) {
  std::replace(s.begin(), s.end(), '\n', ' ');
  // "The following ..." becomes lower case; "INPUT: ..." is a name.
  if (s.size() > 1 && s[0] >= 'A' && s[0] <= 'Z' && !(s[1] >= 'A' && s[1] <= 'Z')) s[0] = static_cast<char>(s[0] - 'A' + 'a');
  return s;
}

}  // namespace

std::string nearest_option(const CLI::App& app, const std::string& word) {
  std::string best;
  std::size_t distance = 3;
  if (word.size() < 4 || !word.starts_with("--")) return best;
  const std::string name = word.substr(2, word.find('=') == std::string::npos ? std::string::npos : word.find('=') - 2);
  for (const CLI::Option* option : app.get_options()) {
    if (option->get_group().empty()) continue;
    for (const auto& l : option->get_lnames()) {
      const std::size_t d = edits(name, l);
      if (d < distance && d < l.size()) {
        distance = d;
        best = "--" + l;
      }
    }
  }
  return best;
}

Error usage_error(const CLI::ParseError& error, const CLI::App& app, const std::string& tool) {
  std::string what = in_one_lower_case_line(error.what());
  std::string hint = fmt::format("try '{} --help'", tool);
  if (dynamic_cast<const CLI::ExtrasError*>(&error)) {
    const auto left = app.remaining();
    const std::string word = left.empty() ? "?" : left.front();
    what = word.size() > 1 && word.front() == '-' ? fmt::format("unknown option {}", word) : fmt::format("unexpected argument '{}'", word);
    const std::string near = nearest_option(app, word);
    if (!near.empty()) hint = fmt::format("did you mean {}?", near);
  } else if (dynamic_cast<const CLI::ArgumentMismatch*>(&error)) {
    const std::string name = what.substr(0, what.find(':'));
    const CLI::Option* option = app.get_option_no_throw(name);
    if (option && option->count() > 1) what = fmt::format("{}: given {} times, expected once", name, option->count());
    else if (option) what = fmt::format("{}: no value given, expected {}", name, placeholder(*option));
  } else if (dynamic_cast<const CLI::FileError*>(&error)) {
    what = fmt::format("--config: {}: cannot be read, expected a TOML or INI file", app.get_config_ptr()->as<std::string>());
  } else if (dynamic_cast<const CLI::ConfigError*>(&error)) {
    const std::string item = what.substr(what.rfind(' ') + 1);
    if (error.what() == "INI was not able to parse " + item) {
      what = fmt::format("{}: unknown option '{}'", app.get_config_ptr()->as<std::string>(), item);
      const std::string near = nearest_option(app, "--" + item);
      if (!near.empty()) hint = fmt::format("did you mean {}?", near.substr(2));
    } else {
      what = app.get_config_ptr()->as<std::string>() + ": " + what;
    }
  }
  return Error(Exit::usage, {}, what, hint);
}

}  // namespace mocap::cli
