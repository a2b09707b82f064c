// How errors reach standard error.
#pragma once
#include <string>

#include "libmocap/base/error.hpp"

namespace mocap::cli {

// "tool: FILE:LINE:OBJECT: found, expected", then "  hint: ..." where there is one. A bug is announced as "internal
// error". With -v -v (`verbose` >= 2) the exit status follows on a line of its own.
void report(const std::string& tool, const Error& error, int verbose);

}  // namespace mocap::cli
