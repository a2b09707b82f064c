// Options from a TOML or INI file, and back.
#pragma once
#include <CLI/CLI.hpp>
#include <string>

namespace mocap::cli {

struct Common;

// `name = value` lines: bare words, numbers, true/false, "strings" with \" \\ \n \t, 'literal strings', [lists] over one or
// more lines; `#` starts a comment, `;` one at the start of a line. A section [tool] holds the options of that tool and
// [default], or no section, those of every tool that reads the file; other sections belong to other tools.
// Errors are Error(usage) with the line. (CLI11's own reader splits quoted strings at blanks, commas and '#'.)
class ConfigFile final : public CLI::Config {
 public:
  explicit ConfigFile(std::string tool) : tool_(std::move(tool)) {}
  std::string to_config(const CLI::App*, bool, bool, std::string) const override { return {}; }  // see effective_config
  std::vector<CLI::ConfigItem> from_config(std::istream& input) const override;

 private:
  std::string tool_;
};

// Every option with its effective value in the form from_config reads; unset options without a default are left out, and
// so is --threads unless given, which depends on the machine.
std::string effective_config(const CLI::App& app, const std::string& tool);

}  // namespace mocap::cli
