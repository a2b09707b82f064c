#include "libmocap/base/error.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "libmocap/base/checked.hpp"
#include "libmocap/base/version.hpp"

namespace mocap {
namespace {

TEST(Error, NamesPlaceAndMatter) {
  EXPECT_STREQ(Error(Exit::data, {"walk.bvh", 57, "joint LeftFoot"}, "3 channels").what(), "walk.bvh:57:joint LeftFoot: 3 channels");
  EXPECT_STREQ(Error(Exit::data, {"walk.bvh", 57, {}}, "x").what(), "walk.bvh:57: x");
  EXPECT_STREQ(Error(Exit::data, {"walk.bvh", 0, "clip a"}, "x").what(), "walk.bvh:clip a: x");
  EXPECT_STREQ(Error(Exit::data, {{}, 0, "clip a"}, "x").what(), "clip a: x");
  EXPECT_STREQ(Error(Exit::usage, {}, "x").what(), "x");
}

TEST(Error, InFileKeepsTheRest) {
  const Error e = Error(Exit::data, {{}, 3, "frame 1"}, "found", "try this").in_file("a.bvh");
  EXPECT_STREQ(e.what(), "a.bvh:3:frame 1: found");
  EXPECT_EQ(e.status(), Exit::data);
  EXPECT_EQ(e.message(), "found");
  EXPECT_EQ(e.hint(), "try this");
}

TEST(Error, StaysOnOneLine) {
  const Error e(Exit::data, {"two\nlines", 0, {}}, "a\r\nb");
  EXPECT_EQ(std::string(e.what()).find_first_of("\r\n"), std::string::npos);
  EXPECT_EQ(e.message().find_first_of("\r\n"), std::string::npos);
}

TEST(Error, ShorthandsCarryTheirStatus) {
  try {
    refuse({"f", 1, {}}, "x", "h");
  } catch (const Error& e) {
    EXPECT_EQ(e.status(), Exit::data);
    EXPECT_EQ(e.hint(), "h");
  }
  try {
    refuse_usage("x");
  } catch (const Error& e) {
    EXPECT_EQ(e.status(), Exit::usage);
  }
}

TEST(Error, ExitStatusesAreThoseOfTheContract) {
  EXPECT_EQ(static_cast<int>(Exit::ok), 0);
  EXPECT_EQ(static_cast<int>(Exit::some_failed), 1);
  EXPECT_EQ(static_cast<int>(Exit::usage), 2);
  EXPECT_EQ(static_cast<int>(Exit::data), 3);
  EXPECT_EQ(static_cast<int>(Exit::io), 4);
  EXPECT_EQ(static_cast<int>(Exit::internal), 5);
  EXPECT_EQ(static_cast<int>(Exit::interrupted), 75);
}

TEST(Checked, RefusesWhatWouldWrap) {
  const std::size_t most = ~std::size_t{0};
  EXPECT_EQ(checked_product(3, 5), 15u);
  EXPECT_EQ(checked_product(most, 1), most);
  EXPECT_EQ(checked_sum(most - 1, 1), most);
  EXPECT_THROW(checked_product(std::size_t{1} << 32, std::size_t{1} << 32), Error);
  EXPECT_THROW(checked_product(most, 2), Error);
  EXPECT_THROW(checked_sum(most, 1), Error);
}

TEST(Version, HasThreePartsAndACommit) {
  const std::string v = version();
  EXPECT_EQ(std::count(v.begin(), v.end(), '.'), 2);
  EXPECT_FALSE(commit().empty());
}

}  // namespace
}  // namespace mocap
