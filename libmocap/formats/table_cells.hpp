// Lines of the tab-separated tables beside motion files.
#pragma once
#include <string>
#include <vector>

#include "libmocap/base/error.hpp"

namespace mocap::formats {

// The cells of a line, empty ones too; at least one.
std::vector<std::string> split_cells(const std::string& line);

// A moment or a length in seconds, finite and at least 0. Error(data) at `where`.
double parse_seconds(const std::string& cell, const Where& where);

}  // namespace mocap::formats
