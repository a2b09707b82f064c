#include "libmocap/cli/config_file.hpp"

#include <fmt/format.h>

#include <istream>
#include <set>

#include "libmocap/base/error.hpp"
#include "libmocap/base/version.hpp"
#include "libmocap/cli/option_values.hpp"

namespace mocap::cli {
namespace {

// A cursor over the text of a file that knows its line.
class Reader {
 public:
  explicit Reader(std::string text) : text_(std::move(text)) {}

  bool done() const { return at_ >= text_.size(); }
  char peek() const { return done() ? '\0' : text_[at_]; }
  char take() {
    if (peek() == '\n') ++line_;
    return done() ? '\0' : text_[at_++];
  }
  long line() const { return line_; }
  [[noreturn]] void fail(const std::string& what) const { throw Error(Exit::usage, {{}, line_, {}}, what); }

  void skip_blanks() {
    while (peek() == ' ' || peek() == '\t' || peek() == '\r') take();
  }
  void skip_comment() {
    while (!done() && peek() != '\n') take();
  }
  // To the next thing that is no blank, line end or comment.
  void skip_space() {
    while (!done()) {
      skip_blanks();
      if (peek() == '#') skip_comment();
      if (peek() != '\n') return;
      take();
    }
  }
  // Up to one of `stops`, without blanks at the end.
  std::string word(const std::string& stops) {
    std::string s;
    while (!done() && stops.find(peek()) == std::string::npos) s += take();
    while (!s.empty() && (s.back() == ' ' || s.back() == '\t' || s.back() == '\r')) s.pop_back();
    return s;
  }
  std::string value(const std::string& stops) {
    const char quote = peek();
    if (quote != '"' && quote != '\'') {
      const std::string s = word(stops + "#\n");
      if (s.empty()) fail("no value, expected one after '='");
      return s;
    }
    take();
    std::string s;
    while (peek() != quote) {
      if (done() || peek() == '\n') fail(fmt::format("a string without its closing {}", quote));
      char c = take();
      if (c == '\\' && quote == '"') {
        const char escape = take();
        const std::string from = "\"\\nt", to = "\"\\\n\t";
        const auto i = from.find(escape);
        if (i == std::string::npos) fail(fmt::format("unknown escape \\{}, expected \\\" \\\\ \\n or \\t", escape));
        c = to[i];
      }
      s += c;
    }
    take();
    return s;
  }

 private:
  std::string text_;
  std::size_t at_ = 0;
  long line_ = 1;
};

void end_of_line(Reader& in) {
  in.skip_blanks();
  if (in.peek() == '#') in.skip_comment();
  if (!in.done() && in.peek() != '\n') in.fail(fmt::format("'{}' after the value, expected the end of the line", in.word("\n")));
}

std::string quoted(const std::string& text) {
  std::string s = "\"";
  for (const char c : text) s += c == '"' ? "\\\"" : c == '\\' ? "\\\\" : c == '\n' ? "\\n" : c == '\t' ? "\\t" : std::string(1, c);
  return s + "\"";
}

}  // namespace

std::vector<CLI::ConfigItem> ConfigFile::from_config(std::istream& input) const {
  Reader in(std::string(std::istreambuf_iterator<char>(input), {}));
  std::vector<CLI::ConfigItem> items;
  std::set<std::string> seen;
  std::string section = "default";
  for (in.skip_space(); !in.done(); in.skip_space()) {
    if (in.peek() == ';') {
      in.skip_comment();
      continue;
    }
    if (in.peek() == '[') {
      in.take();
      section = in.word("]\n");
      if (in.take() != ']') in.fail("a section without its closing ]");
      end_of_line(in);
      continue;
    }
    CLI::ConfigItem item;
    item.name = in.word("=#\n");
    if (in.peek() == '=') {
      in.take();
      in.skip_blanks();
      if (in.peek() == '[') {
        in.take();
        for (in.skip_space(); in.peek() != ']'; in.skip_space()) {
          if (in.done()) in.fail("a list without its closing ]");
          item.inputs.push_back(in.value(",]"));
          in.skip_space();
          if (in.peek() == ',') in.take();
          else if (in.peek() != ']') in.fail("expected ',' or ']' in a list");
        }
        in.take();
      } else {
        item.inputs.push_back(in.value(""));
      }
      end_of_line(in);
    } else {
      item.inputs.emplace_back("true");  // a flag on its own
    }
    if (section != "default" && section != tool_) continue;
    if (!seen.insert(item.name).second) in.fail(fmt::format("'{}' given twice", item.name));
    if (!item.inputs.empty()) items.push_back(std::move(item));
  }
  return items;
}

std::string effective_config(const CLI::App& app, const std::string& tool) {
  std::string text = fmt::format("# {} {}: the effective options\n", tool, version());
  for (const CLI::Option* option : app.get_options()) {
    if (!option->get_configurable() || option->get_lnames().empty()) continue;
    const std::string name = option->get_lnames().front();
    if (name == "threads" && option->count() == 0) continue;
    if (is_flag(*option)) {
      text += fmt::format("{} = {}\n", name, flag_value(*option));
      continue;
    }
    const auto values = effective_values(*option);
    if (values.empty()) continue;
    const bool bare = is_numeric(*option);
    std::vector<std::string> words;
    for (const auto& v : values) words.push_back(bare ? v : quoted(v));
    const bool list = option->get_items_expected_max() > 1;
    text += fmt::format("{} = {}{}{}\n", name, list ? "[" : "", fmt::join(words, ", "), list ? "]" : "");
  }
  return text;
}

}  // namespace mocap::cli
