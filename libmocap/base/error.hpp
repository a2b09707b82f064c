// One exception type for everything the libraries refuse, and the exit statuses shared by every tool.
#pragma once
#include <stdexcept>
#include <string>
#include <utility>

namespace mocap {

// Exit statuses of every tool (docs/conventions.md). Scripts rely on the numbers.
enum class Exit : int {
  ok = 0,
  some_failed = 1,   // a batch finished but some inputs failed, or a check found a broken invariant
  usage = 2,         // command line or configuration
  data = 3,          // an input missing, malformed, truncated or refused
  io = 4,            // an output could not be written
  internal = 5,      // a bug
  interrupted = 75,  // stopped early on a signal with a checkpoint
};

// Where a problem was found. `object` is a node inside the file: "joint LeftFoot", "/clips/name".
struct Where {
  std::string file;
  long line = 0;
  std::string object;
};

// The only exception type thrown on purpose. what() is one line, lower case, no final stop:
//   FILE[:LINE][:OBJECT]: what was found, expected what
class Error : public std::runtime_error {
 public:
  Error(Exit status, Where where, const std::string& what, std::string hint = {});

  Exit status() const noexcept { return status_; }
  const Where& where() const noexcept { return where_; }
  const std::string& message() const noexcept { return message_; }  // what() without the place
  const std::string& hint() const noexcept { return hint_; }

  // The same error with its file named; parsers that see only bytes throw without one.
  Error in_file(const std::string& file) const;

 private:
  Exit status_;
  Where where_;
  std::string message_, hint_;
};

// Shorthands for the two commonest refusals.
[[noreturn]] void refuse(Where where, const std::string& what, std::string hint = {});         // Exit::data
[[noreturn]] void refuse_usage(const std::string& what, std::string hint = {});                // Exit::usage

}  // namespace mocap
