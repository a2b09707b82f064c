#include "libmocap/formats/rate_rules.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

#include "libmocap/base/error.hpp"
#include "libmocap/base/output_file.hpp"
#include "libmocap/formats/motion_input.hpp"

namespace mocap::formats {
namespace {

class RateRulesTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = (std::filesystem::temp_directory_path() / "rates-XXXXXX").string();
    ASSERT_NE(::mkdtemp(folder_.data()), nullptr);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::shared_ptr<const RateRules> read(const std::string& text) const {
    write_file(folder_ + "/rates.tsv", text, Overwrite::allow);
    return RateRules::read(folder_ + "/rates.tsv");
  }
  std::string refusal(const std::string& text) const {
    try {
      read(text);
    } catch (const Error& e) {
      EXPECT_EQ(e.status(), Exit::data);
      return e.what();
    }
    return "accepted";
  }
  std::string folder_;
};

TEST_F(RateRulesTest, TheFirstPatternThatFitsLabelOrPathDecides) {
  const auto rules = read("\xef\xbb\xbf# by hand\r\n\npattern\trate\r\n60_*\t60\n# more\n*/slow/*\t1e1\ncmu/6?_01.bvh\t50\n\n*.bvh\t120\n");
  EXPECT_EQ(rules->rate_for("x/60_02.bvh", "60_02.bvh"), 60);
  EXPECT_EQ(rules->rate_for("data/slow/a/b.bvh", "a/b.bvh"), 10);  // * crosses folders; only the path as typed has them
  EXPECT_EQ(rules->rate_for("cmu/61_01.bvh", "61_01.bvh"), 50);
  EXPECT_EQ(rules->rate_for("other.bvh", "other.bvh"), 120);
  EXPECT_EQ(rules->rate_for("a.npz", "a.npz"), std::nullopt);
  EXPECT_TRUE(rules->unused().empty());
  EXPECT_EQ(rules->sha256().size(), 64u);
}

TEST_F(RateRulesTest, WhatWasNotUsedIsKnown) {
  const auto rules = read("pattern\trate\n*\t30\na*\t60\nb*\t60\n");
  EXPECT_EQ(rules->unused().size(), 3u);
  EXPECT_EQ(rules->rate_for("a", "a"), 30);
  ASSERT_EQ(rules->unused().size(), 2u);
  EXPECT_EQ(rules->unused()[0].pattern, "a*");
  EXPECT_EQ(rules->unused()[1].line, 4);
}

TEST_F(RateRulesTest, FractionsEitherWayUp) {
  EXPECT_EQ(read("pattern\trate\n*\t30000/1001\n")->rate_for("a", "a"), 30000.0 / 1001);
  EXPECT_EQ(read("pattern\trate\n*\t1001/30000\n")->rate_for("a", "a"), 30000.0 / 1001);
  EXPECT_EQ(read("pattern\trate\n*\t29.97\n")->rate_for("a", "a"), 29.97);
  EXPECT_EQ(read("pattern\trate\n*\t0.5\n")->rate_for("a", "a"), 0.5);
}

TEST_F(RateRulesTest, RefusalsNameTheLine) {
  EXPECT_NE(refusal("").find("rates.tsv: an empty table"), std::string::npos);
  EXPECT_NE(refusal("# nothing\n").find("an empty table"), std::string::npos);
  EXPECT_NE(refusal("pattern\trate\n").find("rates.tsv: a header and no rule"), std::string::npos);
  EXPECT_NE(refusal("\n*\t30\n").find("rates.tsv:2: a header '*\t30', expected"), std::string::npos);
  EXPECT_NE(refusal("pattern\trate\na\n").find("rates.tsv:2: 1 columns, expected 2"), std::string::npos);
  EXPECT_NE(refusal("pattern\trate\na\t1\t2\n").find("rates.tsv:2: 3 columns, expected 2"), std::string::npos);
  EXPECT_NE(refusal("pattern\trate\n\t30\n").find("rates.tsv:2: an empty pattern"), std::string::npos);
  for (const char* bad : {"", "0", "-30", "nan", "inf", "1e999", "30 ", "30Hz", "0x10", "1,5", "1/0", "0/1", "/", "1/", "a/b", "1/2/3", "1e300/1e-300"})
    EXPECT_NE(refusal("pattern\trate\na\t1\nb\t" + std::string(bad) + "\n").find("rates.tsv:3:rate: '" + std::string(bad) + "', expected a number above 0"), std::string::npos) << bad;
  EXPECT_THROW(RateRules::read(folder_ + "/absent.tsv"), Error);
}

TEST_F(RateRulesTest, AnOpenedFileTakesTheRate) {
  const std::string file = std::string(TEST_DATA) + "/bvh/tiny_human.bvh";
  const auto plain = open_motion(file, "tiny_human.bvh");
  ReadOptions options;
  options.first_frame = FirstFrame::drop;
  options.rates = read("pattern\trate\ntiny*\t60\n");
  const auto input = open_motion(file, "tiny_human.bvh", options);
  const Clip clip = input->read(0), before = plain->read(0);
  EXPECT_EQ(clip.frame_rate_hz, 60);
  EXPECT_EQ(clip.source.frame_rate_hz, 60);
  EXPECT_EQ(clip.frames(), before.frames() - 1);
  EXPECT_NEAR(clip.source.start_s, 1 / 60.0, 1e-12);
  EXPECT_NEAR(clip.source.end_s, 29 / 60.0, 1e-12);
  EXPECT_EQ(input->notes().back(), "60 Hz by --fps-override, the file says 30 Hz");
  EXPECT_EQ(input->sha256(), plain->sha256());
  options.rates = read("pattern\trate\nother*\t60\n");
  EXPECT_EQ(open_motion(file, "tiny_human.bvh", options)->read(0).frame_rate_hz, 30);
  EXPECT_EQ(options.rates->unused().size(), 1u);
}

}  // namespace
}  // namespace mocap::formats
