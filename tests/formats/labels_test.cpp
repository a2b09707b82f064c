#include "libmocap/formats/labels.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

#include "libmocap/base/error.hpp"
#include "libmocap/base/output_file.hpp"
#include "libmocap/skeleton/canonical_body.hpp"

namespace mocap::formats {
namespace {

class LabelsTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = (std::filesystem::temp_directory_path() / "labels-XXXXXX").string();
    ASSERT_NE(::mkdtemp(folder_.data()), nullptr);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  Labels read(const std::string& text) const {
    write_file(folder_ + "/labels.tsv", text, Overwrite::allow);
    return Labels::read(folder_ + "/labels.tsv");
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

Clip clip_of(std::size_t frames) {
  Clip c;
  c.skeleton = canonical_body();
  c.frame_rate_hz = 10;
  c.root_position.resize(frames, Vector3::Zero());
  c.rotations.resize(frames * 22, Quaternion::Identity());
  return c;
}

TEST_F(LabelsTest, FindsByPathLabelAndStem) {
  const Labels labels = read("\xef\xbb\xbf" "action\tfile\tgender\r\nwalking\tsub/a.bvh\tfemale\r\n\njumping\tb\t\n");
  EXPECT_EQ(labels.attributes(), (std::vector<std::string>{"action", "gender"}));
  EXPECT_EQ(labels.of(folder_ + "/sub/a.bvh", "a.bvh").at(0).attributes.at("gender"), "female");
  EXPECT_EQ(labels.of("/elsewhere/a.bvh.gz", "a.bvh.gz").at(0).attributes.at("action"), "walking");
  EXPECT_EQ(labels.of("/elsewhere/b.npz", "b.npz").at(0).attributes.count("gender"), 0u);
  EXPECT_TRUE(labels.of("/elsewhere/c.bvh", "c.bvh").empty());
}

TEST_F(LabelsTest, AStemOfTwoFilesDecidesNothing) {
  const Labels labels = read("file\taction\nx/a.bvh\twalking\ny/a.bvh\trunning\n");
  EXPECT_TRUE(labels.of("/elsewhere/a.bvh", "a.bvh").empty());
  EXPECT_EQ(labels.of(folder_ + "/y/a.bvh", "a.bvh").at(0).attributes.at("action"), "running");
}

TEST_F(LabelsTest, TimedRowsBecomeSegments) {
  const Labels labels = read("file\taction\tgender\tstart\tend\na\twalking\tmale\t0\t1.5\na\tjogging\tmale\t1.5\t\n");
  Clip clip = clip_of(31);
  labels.apply(clip, "a.bvh", "a.bvh");
  ASSERT_EQ(clip.segments.size(), 2u);
  EXPECT_EQ(clip.segments[0].length, 15);
  EXPECT_EQ(clip.segments[1].start, 15);
  EXPECT_EQ(clip.segments[1].length, 16);
  EXPECT_EQ(clip.attributes.count("action"), 0u);
  EXPECT_EQ(clip.attributes.at("gender"), "male");
  // A clip that begins a second into its file.
  Clip later = clip_of(21);
  later.source.start_s = 1;
  labels.apply(later, "a.bvh", "a.bvh");
  EXPECT_EQ(later.segments[0].length, 5);
  EXPECT_NO_THROW(later.validate());
}

TEST_F(LabelsTest, RefusalsNameTheLine) {
  EXPECT_NE(refusal("").find("empty table"), std::string::npos);
  EXPECT_NE(refusal("name\taction\n").find("labels.tsv:1: a header without a column 'file'"), std::string::npos);
  EXPECT_NE(refusal("file\taction\na\tb\tc\n").find("labels.tsv:2: 3 columns, expected 2"), std::string::npos);
  EXPECT_NE(refusal("file\tstart\tend\na\t0\t1\na\tnan\t2\n").find("labels.tsv:3:start: 'nan'"), std::string::npos);
  EXPECT_NE(refusal("file\tstart\tend\na\t1,5\t2\n").find("'1,5'"), std::string::npos);
  EXPECT_NE(refusal("file\tstart\tend\na\t2\t1\n").find("labels.tsv:2: an end that is not after the start"), std::string::npos);
  EXPECT_NE(refusal("file\taction\na\tx\na\ty\n").find("labels.tsv:3: a is labelled twice"), std::string::npos);
  EXPECT_THROW(Labels::read(folder_ + "/absent.tsv"), Error);
}

}  // namespace
}  // namespace mocap::formats
