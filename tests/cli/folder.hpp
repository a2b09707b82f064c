// A temporary folder for one test, current while the test runs.
#pragma once
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

namespace mocap::cli {

class Folder {
 public:
  Folder() : before_(std::filesystem::current_path()) {
    std::string path = (std::filesystem::temp_directory_path() / "mocapkit-test-XXXXXX").string();
    if (!::mkdtemp(path.data())) std::abort();
    here_ = path;
    std::filesystem::current_path(here_);
  }
  ~Folder() {
    std::filesystem::current_path(before_);
    std::filesystem::remove_all(here_);
  }
  void file(const std::string& path, const std::string& text) const {
    const std::filesystem::path full = here_ / path;
    std::filesystem::create_directories(full.parent_path());
    std::ofstream(full) << text;
  }

 private:
  std::filesystem::path before_, here_;
};

}  // namespace mocap::cli
