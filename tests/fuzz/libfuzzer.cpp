// Entry of libFuzzer (preset `fuzz`); fuzz_NAME --write-seeds FOLDER as in driver.cpp.
#include <cstdint>
#include <cstdlib>
#include <cstring>

#include "libmocap/base/error.hpp"
#include "libmocap/base/log.hpp"
#include "tests/fuzz/target.hpp"

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  mocap::log::start("fuzz", mocap::log::Level::error);
  if (*argc == 3 && std::strcmp((*argv)[1], "--write-seeds") == 0) {
    mocap::fuzz::write_seeds((*argv)[2]);
    std::exit(0);
  }
  return 0;
}

// HDF5 1.10.8 itself loses what it read of an object whose checksum does not fit.
extern "C" const char* __lsan_default_suppressions() { return "leak:libhdf5\n"; }

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    mocap::fuzz::one({reinterpret_cast<const char*>(data), size});
  } catch (const mocap::Error& e) {
    mocap::fuzz::require(e.status() == mocap::Exit::data, "input is refused with Error(data)");
  }
  return 0;
}
