#include "libmocap/cli/progress.hpp"

#include <fmt/core.h>
#include <unistd.h>

#include <cstdio>

namespace mocap::cli {

std::string progress_text(std::size_t done, std::size_t total, const std::string& unit, double rate) {
  std::string left = "-:--";
  if (rate > 0) {
    const auto s = static_cast<long>(static_cast<double>(total > done ? total - done : 0) / rate + 0.5);
    left = s >= 3600 ? fmt::format("{}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60) : fmt::format("{}:{:02}", s / 60, s % 60);
  }
  return fmt::format("{}/{} {}, {:.{}f} {}/s, {} left", done, total, unit, rate, rate < 100 ? 1 : 0, unit, left);
}

Progress::Mode Progress::mode(const std::string& option, bool quiet) {
  const bool terminal = ::isatty(STDERR_FILENO) != 0;
  if (option == "always") return terminal ? Mode::redraw : Mode::lines;
  return option == "auto" && terminal && !quiet ? Mode::redraw : Mode::off;
}

void Progress::update(std::size_t done, std::size_t total, const std::string& unit) {
  if (mode_ == Mode::off) return;
  const auto now = Clock::now();
  if (!started_) {
    // The rate counts from the first report: a resumed training starts at step 5000.
    started_ = true;
    first_done_ = done;
    start_ = last_ = now;
    if (done < total) return;
  }
  const std::chrono::duration<double> since = now - last_;
  if (done < total && since.count() < (mode_ == Mode::redraw ? 0.1 : 1.0)) return;
  last_ = now;
  const double seconds = std::chrono::duration<double>(now - start_).count();
  const std::string text = progress_text(done, total, unit, seconds > 0 ? static_cast<double>(done - first_done_) / seconds : 0);
  // The cursor is left at the start of the line: a log line of another thread overwrites it.
  fmt::print(stderr, "{}{}{}", mode_ == Mode::redraw ? "\033[K" : "", text, mode_ == Mode::redraw ? '\r' : '\n');
  std::fflush(stderr);
  drawn_ = mode_ == Mode::redraw;
}

void Progress::clear() {
  if (!drawn_) return;
  fmt::print(stderr, "\033[K");
  std::fflush(stderr);
  drawn_ = false;
}

}  // namespace mocap::cli
