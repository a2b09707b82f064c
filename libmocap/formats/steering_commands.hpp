// Commands for motion that is steered as it is made (steer): lines of `time speed heading`.
#pragma once
#include <fstream>
#include <istream>
#include <optional>
#include <string>
#include <string_view>

#include "libmocap/base/sha256.hpp"

namespace mocap::formats {

struct SteeringCommand {
  double time = 0, speed = 0, heading = 0;  // s; m/s; rad counter-clockwise from +X
};

// "time speed heading", in seconds, m/s and degrees, by blanks, tabs or commas. Nothing for a blank line or a comment (#). Error(data) without a place: three finite numbers are expected, a speed of at least 0,
// and no time before that of the command before, `last`.
std::optional<SteeringCommand> parse_steering_command(std::string_view line, const std::optional<SteeringCommand>& last);

// Commands in the order of their times, read no further than they are needed: a pipe may be alive.
class SteeringCommandReader {
 public:
  // "-": standard input. Error(data) where the file cannot be opened. `lenient`: malformed lines are warned about and skipped.
  SteeringCommandReader(const std::string& path, bool lenient);
  SteeringCommandReader(std::istream& in, std::string label, bool lenient);  // which must outlive it
  // The next command, or nothing at the end of the input. Error(data) with the line's number for a malformed one, and for one of more than 4,096 bytes.
  std::optional<SteeringCommand> next();
  std::size_t skipped() const { return skipped_; }
  std::string sha256() { return to_hex(hash_.finish()); }  // of what was read

 private:
  bool read(std::string& line);

  std::string label_;
  bool lenient_;
  std::ifstream file_;
  std::istream* in_;
  int number_ = 0;
  std::size_t skipped_ = 0;
  Sha256 hash_;
  std::optional<SteeringCommand> last_;
};

}  // namespace mocap::formats
