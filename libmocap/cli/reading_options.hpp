// The options of every tool that reads mocap files: --unit, --up, --first-frame, --lenient, --asf.
#pragma once
#include <string>

#include "libmocap/cli/tool.hpp"
#include "libmocap/formats/motion_input.hpp"

namespace mocap::cli {

// A member of the tool; add() declares the options, options() is what open_motion takes.
class ReadingOptions {
 public:
  void add(CLI::App& app);
  formats::ReadOptions options() const;

 private:
  std::string unit_ = "auto", up_ = "auto", first_frame_ = "auto", asf_;
  bool lenient_ = false;
};

}  // namespace mocap::cli
