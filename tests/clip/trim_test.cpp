#include "libmocap/clip/trim.hpp"

#include <gtest/gtest.h>

#include "libmocap/base/error.hpp"
#include "libmocap/skeleton/canonical_body.hpp"

namespace mocap {
namespace {

Clip clip_of(std::size_t frames) {
  Clip c;
  c.name = "walk";
  c.skeleton = canonical_body();
  c.frame_rate_hz = 10;
  for (std::size_t t = 0; t < frames; ++t) c.root_position.emplace_back(static_cast<double>(t), 0, 0);
  c.rotations.resize(frames * 22, Quaternion::Identity());
  c.source.start_s = 1;
  c.source.end_s = 1 + c.seconds();
  return c;
}

TEST(Trim, SecondsAndPercentFromEitherEnd) {
  const auto ends = [](const char* text) {
    const Clip out = trim(clip_of(41), Trim::parse(text));
    return std::pair(out.root_position.front().x(), out.root_position.back().x());
  };
  EXPECT_EQ(ends("0.5"), std::pair(5.0, 35.0));
  EXPECT_EQ(ends("0.5,1"), std::pair(5.0, 30.0));
  EXPECT_EQ(ends("10%"), std::pair(4.0, 36.0));
  EXPECT_EQ(ends("10%,0.26"), std::pair(4.0, 37.0));
  EXPECT_EQ(ends("0,50%"), std::pair(0.0, 19.0));  // 20.5 frames are 21
  EXPECT_EQ(ends("0"), std::pair(0.0, 40.0));
  EXPECT_EQ(ends("2,2"), std::pair(20.0, 20.0));
  EXPECT_FALSE(Trim::parse("0,0%").any());
  EXPECT_TRUE(Trim::parse("0,1").any());
}

TEST(Trim, SourceTimesAndSegmentsMoveAlong) {
  Clip clip = clip_of(41);
  clip.segments = {{0, 10, {{"action", "standing"}}}, {10, 31, {{"action", "walking"}}}};
  const Clip out = trim(clip, Trim::parse("1.5,0.5"));
  EXPECT_DOUBLE_EQ(out.source.start_s, 2.5);
  EXPECT_DOUBLE_EQ(out.source.end_s, 4.5);
  ASSERT_EQ(out.segments.size(), 1u);
  EXPECT_EQ(out.segments[0].start, 0);
  EXPECT_EQ(out.segments[0].length, 21);
}

TEST(Trim, Refusals) {
  for (const char* bad : {"", ",", "1,", ",1", "-1", "-0", "1;2", "1,2,3", "a", "1s", "%", "10%%", "nan", "inf", "100%", "50%", "60%,40%", "1e999"}) {
    try {
      Trim::parse(bad);
      ADD_FAILURE() << bad;
    } catch (const Error& e) {
      EXPECT_EQ(e.status(), Exit::usage);
      EXPECT_EQ(e.message(), "--trim: '" + std::string(bad) + "', expected A or A,B: seconds (0.5) or percent (10%) from the start and the end, leaving something");
    }
  }
  try {
    trim(clip_of(41), Trim::parse("2,2.1"));
    ADD_FAILURE() << "no error";
  } catch (const Error& e) {
    EXPECT_EQ(e.status(), Exit::data);
    EXPECT_EQ(std::string(e.what()), "clip walk: 4 s of motion, expected more than the 4.1 s to be trimmed");
  }
}

}  // namespace
}  // namespace mocap
