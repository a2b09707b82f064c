// Shared by the tests of libmocap/io.
#pragma once
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdlib>
#include <filesystem>
#include <functional>
#include <string>

#include "libmocap/base/error.hpp"
#include "libmocap/base/output_file.hpp"

namespace mocap::test {

inline std::string data(const std::string& name) { return read_file(std::string(TEST_DATA) + "/" + name); }

// The error a call ends with; fails the test where it ends without one.
inline Error error_of(const std::function<void()>& call) {
  try {
    call();
  } catch (const Error& e) {
    return e;
  }
  ADD_FAILURE() << "no error";
  return Error(Exit::ok, {}, "no error");
}

struct TemporaryFolder {
  std::filesystem::path path;
  TemporaryFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "mocapkit-test-XXXXXX").string();
    if (!::mkdtemp(name.data())) ADD_FAILURE() << "mkdtemp";
    path = name;
  }
  ~TemporaryFolder() { std::filesystem::remove_all(path); }
};

// Runs a script with the system's Python; -1 where NumPy and SciPy are not installed for it.
inline int python(const std::string& arguments) {
  if (std::system("/usr/bin/python3 -c 'import numpy, scipy' 2>/dev/null") != 0) return -1;
  return WEXITSTATUS(std::system(("/usr/bin/python3 " + arguments).c_str()));
}

}  // namespace mocap::test
