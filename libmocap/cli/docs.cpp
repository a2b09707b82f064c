#include "libmocap/cli/docs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <sstream>

#include "libmocap/base/version.hpp"
#include "libmocap/cli/option_values.hpp"

namespace mocap::cli {
namespace {

constexpr std::size_t kWidth = 96;

constexpr std::pair<const char*, const char*> kStatuses[] = {
    {"0", "done"},
    {"1", "a batch finished but some inputs failed, or a check found a broken invariant"},
    {"2", "usage: command line or configuration"},
    {"3", "a lone input missing, malformed, truncated or refused"},
    {"4", "output could not be written (exists without -f, disk full, closed)"},
    {"5", "internal error: a bug"},
    {"75", "stopped early on a signal with a checkpoint: run the same line again to continue"},
    {"128+n", "ended by signal n"},
};

struct Row {
  std::string names;  // "-o, --output FILE"
  std::string text;   // description, expectation, default
};
struct Group {
  std::string title;
  std::vector<Row> rows;
};

Row row_of(const CLI::Option& option) {
  Row row;
  for (const auto& s : option.get_snames()) row.names += (row.names.empty() ? "-" : ", -") + s;
  for (const auto& l : option.get_lnames()) row.names += (row.names.empty() ? "--" : ", --") + l;
  const std::string value = placeholder(option);
  if (!value.empty()) row.names += " " + value;
  row.text = option.get_description();
  const std::string expected = constraint(option);
  if (!expected.empty()) row.text += "; a number " + expected;
  const int most = option.get_items_expected_max();
  if (most > 1 && row.text.find("repeatable") == std::string::npos)
    row.text += most >= CLI::detail::expected_max_vector_size ? "; repeatable" : "; " + std::to_string(most) + " values";
  if (option.get_required()) row.text += "; required";
  std::string standard = option.get_default_str();
  if (!is_flag(option) && !standard.empty() && standard != "[]" && standard != "\"\"") row.text += " [default: " + standard + "]";
  return row;
}

// The tool's own groups in the order in which they were declared, then what other tools have too.
std::vector<Group> groups_of(const CLI::App& app) {
  std::vector<Group> groups;
  for (const CLI::Option* option : app.get_options()) {
    if (option->get_group().empty() || option->get_positional()) continue;
    Group* group = nullptr;
    for (auto& g : groups)
      if (g.title == option->get_group()) group = &g;
    if (!group) group = &groups.emplace_back(Group{option->get_group(), {}});
    group->rows.push_back(row_of(*option));
  }
  const auto rank = [](const Group& g) { return g.title == "Batch options" ? 1 : g.title == "Common options" ? 2 : 0; };
  std::stable_sort(groups.begin(), groups.end(), [&](const Group& a, const Group& b) { return rank(a) < rank(b); });
  return groups;
}

std::string usage_line(const Tool& tool, const CLI::App& app) {
  const Traits t = tool.traits();
  std::string line = tool.name() + " [OPTIONS]";
  if (t.inputs != Inputs::none) line += t.inputs == Inputs::many ? " INPUT..." : " INPUT";
  if (t.output != Output::none) {
    const std::string o = "-o " + placeholder(*app.get_option("--output"));
    line += t.output_required ? " " + o : " [" + o + "]";
  }
  return line;
}

// Words of `text` in lines of at most `width` columns, each line after `indent` blanks. Line breaks in `text` are kept.
std::string wrapped(const std::string& text, std::size_t indent, std::size_t width = kWidth) {
  std::string out;
  std::istringstream paragraphs(text);
  for (std::string paragraph; std::getline(paragraphs, paragraph);) {
    std::istringstream words(paragraph);
    std::string line;
    for (std::string word; words >> word;) {
      if (!line.empty() && indent + line.size() + 1 + word.size() > width) {
        out += std::string(indent, ' ') + line + "\n";
        line.clear();
      }
      line += (line.empty() ? "" : " ") + word;
    }
    out += line.empty() ? "\n" : std::string(indent, ' ') + line + "\n";
  }
  return out;
}

std::string escaped_cell(std::string s) {
  for (std::size_t i = 0; (i = s.find('|', i)) != std::string::npos; i += 2) s.insert(i, "\\");
  return s;
}

std::string roff(const std::string& text) {
  std::string s;
  bool start = true;
  for (const char c : text) {
    if (start && (c == '.' || c == '\'')) s += "\\&";
    s += c == '\\' ? "\\e" : c == '-' ? "\\-" : std::string(1, c);
    start = c == '\n';
  }
  return s;
}

}  // namespace

std::string help_text(const Tool& tool, const CLI::App& app) {
  constexpr std::size_t kColumn = 28;
  std::string text = fmt::format("{} - {}\n\nUsage: {}\n", tool.name(), tool.synopsis(), usage_line(tool, app));
  if (!tool.description().empty()) text += "\n" + wrapped(tool.description(), 0);
  if (tool.traits().inputs != Inputs::none) text += "\n" + wrapped("INPUT: " + app.get_option("INPUT")->get_description(), 0);
  for (const auto& group : groups_of(app)) {
    text += "\n" + group.title + ":\n";
    for (const auto& row : group.rows) {
      const std::string body = wrapped(row.text, kColumn);
      const std::string names = "  " + row.names;
      text += names.size() + 2 <= kColumn ? names + body.substr(names.size()) : names + "\n" + body;
    }
  }
  text += "\nExamples:\n";
  for (const auto& e : tool.examples()) text += "  " + e.command + "\n" + wrapped(e.text, 6);
  if (!tool.references().empty()) text += "\nReferences:\n";
  for (const auto& r : tool.references()) text += wrapped(r, 2);
  return text;
}

std::string markdown_page(const Tool& tool, const CLI::App& app) {
  std::string text = fmt::format("# {}\n\n{}.\n\n    {}\n", tool.name(), tool.synopsis(), usage_line(tool, app));
  if (!tool.description().empty()) text += "\n" + tool.description() + "\n";
  if (tool.traits().inputs != Inputs::none) text += "\n`INPUT`: " + app.get_option("INPUT")->get_description() + ".\n";
  for (const auto& group : groups_of(app)) {
    text += fmt::format("\n## {}\n\n| option | meaning |\n|---|---|\n", group.title);
    for (const auto& row : group.rows) text += fmt::format("| `{}` | {} |\n", escaped_cell(row.names), escaped_cell(row.text));
  }
  text += "\n## Examples\n";
  for (const auto& e : tool.examples()) text += fmt::format("\n{}:\n\n    {}\n", e.text, e.command);
  if (!tool.references().empty()) text += "\n## References\n\n";
  for (const auto& r : tool.references()) text += "- " + r + "\n";
  return text;
}

std::string man_page(const Tool& tool, const CLI::App& app) {
  std::string upper = tool.name();
  for (char& c : upper) c = c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
  std::string text = fmt::format(".TH {} 1 \"\" \"mocapkit {}\" \"mocapkit\"\n.SH NAME\n{} \\- {}\n.SH SYNOPSIS\n{}\n", roff(upper), version(),
                                 roff(tool.name()), roff(tool.synopsis()), roff(usage_line(tool, app)));
  std::string description = tool.description();
  if (tool.traits().inputs != Inputs::none)
    description += (description.empty() ? "" : "\n") + fmt::format("INPUT: {}.", app.get_option("INPUT")->get_description());
  text += ".SH DESCRIPTION\n" + roff(description.empty() ? tool.synopsis() + "." : description) + "\n";
  for (const auto& group : groups_of(app)) {
    text += fmt::format(".SH \"{}\"\n", roff(group.title));
    for (const auto& row : group.rows) text += fmt::format(".TP\n\\fB{}\\fR\n{}\n", roff(row.names), roff(row.text));
  }
  text += ".SH EXAMPLES\n";
  for (const auto& e : tool.examples()) text += fmt::format(".TP\n{}\n{}\n", roff(e.command), roff(e.text));
  text += ".SH \"EXIT STATUS\"\n";
  for (const auto& [status, meaning] : kStatuses) text += fmt::format(".TP\n{}\n{}\n", status, roff(meaning));
  if (!tool.references().empty()) text += ".SH REFERENCES\n";
  for (const auto& r : tool.references()) text += roff(r) + "\n.br\n";
  return text;
}

}  // namespace mocap::cli
