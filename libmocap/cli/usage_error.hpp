#pragma once
#include <CLI/CLI.hpp>
#include <string>

#include "libmocap/base/error.hpp"

namespace mocap::cli {

// A parse error of CLI11 in this project's words: one lower-case line, Error(usage) whatever CLI11's own code is, with the
// nearest option where one was misspelt.
Error usage_error(const CLI::ParseError& error, const CLI::App& app, const std::string& tool);

// The option nearest to `word` ("--fsp" -> "--fps"), or "" where none is within two edits.
std::string nearest_option(const CLI::App& app, const std::string& word);

}  // namespace mocap::cli
