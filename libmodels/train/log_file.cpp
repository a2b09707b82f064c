#include "libmodels/train/log_file.hpp"

#include <fcntl.h>
#include <fmt/core.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstring>
#include <utility>

#include "libmocap/base/error.hpp"
#include "libmocap/base/output_file.hpp"

namespace mocap::train {

LogFile::LogFile(const std::string& path, std::int64_t keep_steps) : path_(path) {
  std::string kept;
  if (keep_steps > 0 && ::access(path.c_str(), R_OK) == 0) {
    const std::string old = read_file(path);
    for (std::size_t at = 0; at < old.size();) {
      const std::size_t end = old.find('\n', at);
      if (end == std::string::npos) break;  // a row cut off by a kill
      std::int64_t step = 0;
      const bool header = old.compare(at, 4, "step") == 0;
      if (!header && (std::from_chars(old.data() + at, old.data() + end, step).ec != std::errc{} || step > keep_steps)) break;
      kept.append(old, at, end + 1 - at);
      header_ = header_ || header;
      at = end + 1;
    }
  }
  write_file(path, kept, Overwrite::allow);
  fd_ = ::open(path.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC);
  if (fd_ < 0) throw Error(Exit::io, {path, 0, {}}, std::string("open failed: ") + std::strerror(errno));
}

LogFile::~LogFile() {
  try {
    flush();
  } catch (const Error&) {  // reported by the flush before; a destructor has no one to tell
  }
  if (fd_ >= 0) ::close(fd_);
}

void LogFile::write(const Row& row) {
  if (!header_) {
    pending_ += "step\tepoch\tlearning_rate\tgradient_norm\tloss";
    for (const auto& [name, value] : row.terms) pending_ += "\t" + name;
    pending_ += "\tvalidation_loss\n";
    header_ = true;
  }
  pending_ += fmt::format("{}\t{}\t{:.6g}\t{:.6g}\t{:.6g}", row.step, row.epoch, row.learning_rate, row.gradient_norm, row.loss);
  for (const auto& [name, value] : row.terms) pending_ += fmt::format("\t{:.6g}", value);
  pending_ += row.validation ? fmt::format("\t{:.6g}\n", *row.validation) : std::string("\t\n");
  if (pending_.size() > 4096) flush();
}

void LogFile::flush() {
  std::string_view left = pending_;
  while (!left.empty()) {
    const ssize_t n = ::write(fd_, left.data(), left.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) {
      pending_.clear();
      throw Error(Exit::io, {path_, 0, {}}, std::string("write failed: ") + std::strerror(errno));
    }
    left.remove_prefix(static_cast<std::size_t>(n));
  }
  pending_.clear();
}

void LogFile::close() {
  flush();
  if (::close(std::exchange(fd_, -1)) != 0) throw Error(Exit::io, {path_, 0, {}}, std::string("close failed: ") + std::strerror(errno));
}

}  // namespace mocap::train
