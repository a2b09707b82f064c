#include <fmt/core.h>
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

std::string escaped(const std::string& word) {
  std::string out;
  for (const char c : word) out += c >= ' ' && c < 127 && c != '"' && c != '\\' ? std::string(1, c) : fmt::format("\\x{:02x}", static_cast<unsigned char>(c));
  return out;
}

}  // namespace

void write_seeds(const std::string& folder) {
  std::filesystem::create_directories(folder);
  int k = 0;
  for (const auto& s : seeds()) std::ofstream(std::filesystem::path(folder) / fmt::format("seed-{}", k++), std::ios::binary) << s;
  std::ofstream dictionary(folder + ".dict");
  for (const auto& word : words()) dictionary << '"' << escaped(word) << "\"\n";
}

const std::string& as_file(std::string_view bytes) {
  static const std::string path = (folder() / "input").string();
  std::ofstream out(path, std::ios::binary | std::ios::trunc);
  out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  return path;
}

std::string scratch(const std::string& name) { return (folder() / name).string(); }

}  // namespace mocap::fuzz
