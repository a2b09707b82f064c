#include "libmocap/base/version.hpp"

#include "mocapkit_version.hpp"

namespace mocap {

std::string version() { return MOCAPKIT_VERSION; }
std::string commit() { return MOCAPKIT_COMMIT; }

}  // namespace mocap
