#pragma once
#include <string>

namespace mocap {

std::string version();  // "0.1.0"
std::string commit();   // abbreviated git commit the build came from, or "unknown"

}  // namespace mocap
