#include "libmocap/cli/clip_outputs.hpp"

#include <fmt/format.h>

#include <filesystem>

#include "libmocap/store/archive.hpp"

namespace mocap::cli {

namespace fs = std::filesystem;

std::string safe_file_name(const std::string& clip_name) {
  constexpr std::string_view kUnsafe = "/\\:*?\"<>|\x7f";
  std::string s;
  for (const char c : clip_name) s += static_cast<unsigned char>(c) < 0x20 || kUnsafe.find(c) != std::string_view::npos ? '_' : c;
  if (s.empty()) return "clip";
  if (s.front() == '.' || s.front() == '-') s.insert(0, "_");
  if (s.size() > 200) {
    std::size_t end = 200;
    while (end > 0 && (static_cast<unsigned char>(s[end]) & 0xC0) == 0x80) --end;
    s.resize(end);
  }
  return s;
}

ClipOutputs::ClipOutputs(const Context& context, const std::string& extension)
    : output_(context.common().output), extension_(extension), lone_(context.lone_input()) {
  std::error_code none;
  const bool is_folder = fs::is_directory(output_, none);
  one_file_ = output_ == "-" || (output_.ends_with(extension_) && !is_folder);
  const auto& inputs = context.inputs();
  if (one_file_) {
    if (inputs.size() != 1 || !context.common().shard.empty())
      refuse_usage(fmt::format("-o {}: {} inputs for one output, expected one input or a folder to write to", output_, inputs.size()));
    if (output_ != "-") check_output(output_, context.overwrite());
    return;
  }
  if (!is_folder && fs::exists(output_, none))
    throw Error(Exit::io, {output_, 0, {}}, "a file, expected a folder or a new name that ends in " + extension_);
  if (!is_folder || context.overwrite() == Overwrite::allow) return;
  for (const auto& input : inputs) {
    if (input.path == "-" || input.failure || store::probe(input.path) != "mocap-motion") {
      const std::string path = path_for(input);
      if (fs::exists(path, none)) check_output(path, Overwrite::refuse);
      continue;
    }
    try {
      const store::ArchiveReader archive(input.path);
      ClipOutputs names(*this);
      for (std::size_t i = 0; i < archive.size(); ++i) {
        const std::string path = names.path_for(input, archive.info(i).name);
        if (fs::exists(path, none)) check_output(path, Overwrite::refuse);
      }
    } catch (const Error& e) {
      if (e.status() != Exit::data) throw;  // an archive that cannot be read is rejected when its turn comes
    }
  }
}

std::string ClipOutputs::path_for(const InputFile& input) const {
  return one_file_ ? output_ : (fs::path(output_) / (input.stem + extension_)).string();
}

std::string ClipOutputs::path_for(const InputFile& input, const std::string& clip_name) {
  if (one_file_) return output_;
  const fs::path folder = lone_ ? fs::path(output_) : fs::path(output_) / input.stem;
  const std::string name = safe_file_name(clip_name);
  std::string path = (folder / (name + extension_)).string();
  for (int n = 2; !taken_.insert(path).second; ++n) path = (folder / fmt::format("{}-{}{}", name, n, extension_)).string();
  return path;
}

void ClipOutputs::write(Context& context, const std::string& path, const std::string& bytes, bool text) const {
  if (path == "-" && text) {
    context.print(bytes);
    return;
  }
  if (!one_file_) {
    const fs::path folder = fs::path(path).parent_path();
    std::error_code error;
    fs::create_directories(folder, error);
    if (error) throw Error(Exit::io, {folder.string(), 0, {}}, "the folder cannot be made: " + error.message());
  }
  write_file(path, bytes, context.overwrite());
}

}  // namespace mocap::cli
