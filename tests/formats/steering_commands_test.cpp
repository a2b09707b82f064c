#include "libmocap/formats/steering_commands.hpp"

#include <gtest/gtest.h>

#include <numbers>
#include <sstream>

#include "libmocap/base/error.hpp"
#include "libmocap/base/log.hpp"

namespace mocap::formats {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

TEST(SteeringCommands, AreThreeNumbers) {
  const auto c = parse_steering_command(" 1.5\t+2 , -450\r", std::nullopt);
  ASSERT_TRUE(c);
  EXPECT_EQ(c->time, 1.5);
  EXPECT_EQ(c->speed, 2);
  EXPECT_NEAR(c->heading, -450 * kDegree, 1e-15);
  for (const char* empty : {"", "  \t", "# 1 2 3", "\r"}) EXPECT_FALSE(parse_steering_command(empty, std::nullopt)) << empty;
}

TEST(SteeringCommands, SayWhatIsWrong) {
  const auto said = [](const char* line, std::optional<SteeringCommand> last = std::nullopt) {
    try {
      (void)parse_steering_command(line, last);
    } catch (const Error& e) {
      EXPECT_EQ(e.status(), Exit::data);
      return std::string(e.message());
    }
    return std::string("nothing");
  };
  const std::string expected = "expected time, speed and heading: seconds, m/s, degrees";
  EXPECT_EQ(said("1 2"), "2 values, " + expected);
  EXPECT_EQ(said("1 2 3 4"), "4 values, " + expected);
  EXPECT_EQ(said("1 fast 3"), "'fast', " + expected);
  EXPECT_EQ(said("1 2 3x"), "'3x', " + expected);
  EXPECT_EQ(said("nan 2 3"), "'nan', " + expected);
  EXPECT_EQ(said("1 inf 3"), "'inf', " + expected);
  EXPECT_EQ(said("1 ++2 3"), "'++2', " + expected);
  EXPECT_EQ(said("-1 2 3"), "time -1, expected at least 0");
  EXPECT_EQ(said("1 -2 3"), "speed -2, expected at least 0");
  EXPECT_EQ(said("1 2 2e6"), "heading 2e6, expected at most 1e6 degrees either way");
  EXPECT_EQ(said("1 2 3", SteeringCommand{2.5, 0, 0}), "time 1, expected at least that of the command before, 2.5");
  EXPECT_EQ(said("2.5 2 3", SteeringCommand{2.5, 0, 0}), "nothing");
}

TEST(SteeringCommands, AreReadLineByLine) {
  std::istringstream in("# seconds, m/s, degrees\n0 1 0\n\n2 1.5 90\n1 1 0\n3 1 x\n4 0 180");
  SteeringCommandReader reader(in, "in.txt", true);
  log::start("test", log::Level::error);
  EXPECT_EQ(reader.next()->time, 0);
  EXPECT_NEAR(reader.next()->heading, 90 * kDegree, 1e-12);
  EXPECT_EQ(reader.next()->time, 4);
  EXPECT_FALSE(reader.next());
  EXPECT_EQ(reader.skipped(), 2u);
  Sha256 hash;
  hash.update(in.str());
  EXPECT_EQ(reader.sha256(), to_hex(hash.finish()));
  const auto refused = [](const std::string& text) {
    std::istringstream lines(text);
    SteeringCommandReader strict(lines, "in.txt", false);
    try {
      while (strict.next()) {
      }
    } catch (const Error& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  EXPECT_NE(refused("0 1 0\n1 -1 0\n").find("in.txt:2: speed -1"), std::string::npos);
  EXPECT_NE(refused("0 1 0\n" + std::string(5000, '1')).find("in.txt:2: a line of more than 4096 bytes"), std::string::npos);
  EXPECT_THROW(SteeringCommandReader("absent.txt", false), Error);
}

}  // namespace
}  // namespace mocap::formats
