// --help, docs/tools/<tool>.md and docs/man/<tool>.1 from one table: the tool's declarations and its CLI11 options.
// Nothing here depends on the machine.
#pragma once
#include <string>

#include "libmocap/cli/tool.hpp"

namespace mocap::cli {

std::string help_text(const Tool& tool, const CLI::App& app);
std::string markdown_page(const Tool& tool, const CLI::App& app);
std::string man_page(const Tool& tool, const CLI::App& app);

}  // namespace mocap::cli
