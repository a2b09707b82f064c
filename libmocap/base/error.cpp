#include "libmocap/base/error.hpp"

namespace mocap {
namespace {

// A file name may hold a newline: the message stays one line.
std::string one_line(std::string s) {
  for (char& c : s)
    if (c == '\n' || c == '\r') c = ' ';
  return s;
}

std::string prefix(const Where& w) {
  std::string s = w.file;
  if (w.line > 0) s += ":" + std::to_string(w.line);
  if (!w.object.empty()) s += (s.empty() ? "" : ":") + w.object;
  return s.empty() ? s : s + ": ";
}

}  // namespace

Error::Error(Exit status, Where where, const std::string& what, std::string hint)
    : std::runtime_error(one_line(prefix(where) + what)),
      status_(status),
      where_(std::move(where)),
      message_(one_line(what)),
      hint_(std::move(hint)) {}

Error Error::in_file(const std::string& file) const {
  Where w = where_;
  w.file = file;
  return Error(status_, w, message_, hint_);
}

void refuse(Where where, const std::string& what, std::string hint) {
  throw Error(Exit::data, std::move(where), what, std::move(hint));
}

void refuse_usage(const std::string& what, std::string hint) { throw Error(Exit::usage, {}, what, std::move(hint)); }

}  // namespace mocap
