#include "libmodels/tools/history_input.hpp"

namespace mocap::tools {

HistoryInput history_input(const std::string& path, const std::string& sha256) { return {path == "-" ? "<stdin>" : path.substr(path.rfind('/') + 1), sha256}; }

}  // namespace mocap::tools
