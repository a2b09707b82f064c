#pragma once
#include <string>

#include "libmocap/base/history.hpp"

namespace mocap::tools {

// A file as history names it: its base name, "<stdin>" for "-".
HistoryInput history_input(const std::string& path, const std::string& sha256);

}  // namespace mocap::tools
