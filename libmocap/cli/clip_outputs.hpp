// Where a tool that writes one file per clip puts them: a folder, one file, or standard output.
#pragma once
#include <set>
#include <string>
#include <vector>

#include "libmocap/cli/tool.hpp"

namespace mocap::cli {

// A clip's name as one file name: '/', '\', ':', '*', '?', '"', '<', '>', '|' and control characters become '_', a leading
// '.' or '-' gets one in front, longer than 200 bytes is cut (never inside a UTF-8 character), empty becomes "clip".
std::string safe_file_name(const std::string& clip_name);

// -o decides: "-" is standard output; a name that ends in `extension` and is no folder is one file; anything else is a
// folder, made when the first file is written. In a folder a file of one clip gives STEM.ext (InputFile::stem: subfolders
// are kept), and an archive gives CLIP.ext for each clip, inside STEM/ unless it is the lone input.
class ClipOutputs {
 public:
  // Refuses before any work: several inputs for one file (Error(usage)), outputs that exist without -f (Error(io)).
  ClipOutputs(const Context& context, const std::string& extension);

  bool one_file() const { return one_file_; }
  std::string path_for(const InputFile& input) const;
  // Of a clip of an archive; names that meet get "-2", "-3", ... in the order of the calls.
  std::string path_for(const InputFile& input, const std::string& clip_name);
  // The whole file, or nothing; makes the folders it lies in. `text` may go to a terminal.
  void write(Context& context, const std::string& path, const std::string& bytes, bool text = false) const;

 private:
  std::string output_, extension_;
  bool one_file_ = false, lone_ = false;
  std::set<std::string> taken_;
};

}  // namespace mocap::cli
