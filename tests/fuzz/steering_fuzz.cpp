#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <sstream>

#include "libmocap/formats/steering_commands.hpp"
#include "tests/fuzz/target.hpp"

namespace mocap::fuzz {

std::vector<std::string> seeds() { return {"0 1.2 0\n4 1.2 90\n8 2.8 -90\n", "# time, speed, heading\r\n0,1,0\r\n\r\n1.5\t0\t720\r\n", "0 0 0"}; }

std::vector<std::string> words() { return {"#", ",", "\t", "\r\n", "1e6", "-0"}; }

void one(std::string_view bytes) {
  for (const bool lenient : {true, false}) {
    std::istringstream in{std::string(bytes)};
    formats::SteeringCommandReader reader(in, "input", lenient);
    std::optional<formats::SteeringCommand> last;
    while (const auto command = reader.next()) {
      require(std::isfinite(command->time) && command->speed >= 0 && std::isfinite(command->heading) && (!last || command->time >= last->time), "commands are finite and in order");
      const auto again = formats::parse_steering_command(fmt::format("{} {} {}", command->time, command->speed, command->heading * 180 / std::numbers::pi), last);
      require(again && again->time == command->time && again->speed == command->speed && std::abs(again->heading - command->heading) <= 1e-9 * (1 + std::abs(command->heading)), "a command read, written and read is the same");
      last = command;
    }
  }
}

}  // namespace mocap::fuzz
