// The options of every tool that reads mocap files: --unit, --up, --first-frame, --lenient, --asf, --fps-override.
#pragma once
#include <string>
#include <vector>

#include "libmocap/cli/tool.hpp"
#include "libmocap/formats/motion_input.hpp"

namespace mocap::cli {

// A member of the tool; add() declares the options, options() is what open_motion takes. It reads the files that options
// name, so it is called once a run, before the batch; Error(data) where one cannot be read.
class ReadingOptions {
 public:
  void add(CLI::App& app);
  formats::ReadOptions options() const;

  // What was found (debug) and doubted (warning) in one input.
  static void report(const formats::MotionInput& input, const std::string& label);
  // Those files as history records them, by base name.
  static std::vector<HistoryInput> files(const formats::ReadOptions& options);
  // After the batch: a warning for each rule of --fps-override that set no rate (a typo must not pass silently); with
  // --shard a debug line, as its file may be another task's.
  static void report_unused(const formats::ReadOptions& options, const Context& context);

 private:
  std::string unit_ = "auto", up_ = "auto", first_frame_ = "auto", asf_, rates_;
  bool lenient_ = false;
};

}  // namespace mocap::cli
