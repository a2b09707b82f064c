// Entry of libFuzzer (preset `fuzz`).
#include <cstdint>

#include "libmocap/base/error.hpp"
#include "libmocap/base/log.hpp"
#include "tests/fuzz/target.hpp"

extern "C" int LLVMFuzzerInitialize(int*, char***) {
  mocap::log::start("fuzz", mocap::log::Level::error);
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    mocap::fuzz::one({reinterpret_cast<const char*>(data), size});
  } catch (const mocap::Error& e) {
    mocap::fuzz::require(e.status() == mocap::Exit::data, "input is refused with Error(data)");
  }
  return 0;
}
