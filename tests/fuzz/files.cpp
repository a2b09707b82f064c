#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "tests/fuzz/target.hpp"

namespace mocap::fuzz {
namespace {

// In memory where there is such a place: 20,000 files need no disk.
struct Folder {
  std::filesystem::path path;
  Folder() {
    const std::filesystem::path base = std::filesystem::is_directory("/dev/shm") ? "/dev/shm" : std::filesystem::temp_directory_path();
    std::string name = (base / "mocapkit-fuzz-XXXXXX").string();
    if (!::mkdtemp(name.data())) std::abort();
    path = name;
  }
  ~Folder() {
    std::error_code ignored;
    std::filesystem::remove_all(path, ignored);
  }
};
const std::filesystem::path& folder() {
  static const Folder f;
  return f.path;
}

}  // namespace

const std::string& as_file(std::string_view bytes) {
  static const std::string path = (folder() / "input").string();
  std::ofstream out(path, std::ios::binary | std::ios::trunc);
  out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  return path;
}

std::string scratch(const std::string& name) { return (folder() / name).string(); }

}  // namespace mocap::fuzz
