// One line on standard error: done of total, rate, time left.
#pragma once
#include <chrono>
#include <cstddef>
#include <string>

namespace mocap::cli {

// "123/2500 files, 45.3 files/s, 0:52 left" ("-:--" until a rate is known).
std::string progress_text(std::size_t done, std::size_t total, const std::string& unit, double rate_hz);

// On a terminal one line is redrawn at most ten times a second and removed at the end. With "always" and no terminal (a
// log file) a whole line is written at most once a second, and the last one.
class Progress {
 public:
  enum class Mode { off, redraw, lines };
  static Mode mode(const std::string& option, bool quiet);  // "auto", "always", "never"

  explicit Progress(Mode mode) : mode_(mode) {}
  void update(std::size_t done, std::size_t total, const std::string& unit);
  void clear();  // before a message: takes the line off the terminal

 private:
  using Clock = std::chrono::steady_clock;
  Mode mode_;
  bool started_ = false, drawn_ = false;
  std::size_t first_done_ = 0;
  Clock::time_point start_, last_;
};

}  // namespace mocap::cli
