#include "libmocap/formats/motion_input.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>

#include "libmocap/base/error.hpp"
#include "libmocap/base/output_file.hpp"

namespace mocap::formats {
namespace {

class MotionInputTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = (std::filesystem::temp_directory_path() / "input-XXXXXX").string();
    ASSERT_NE(::mkdtemp(folder_.data()), nullptr);
    asf_ = read_file(std::string(TEST_DATA) + "/asf/plain.asf");
    amc_ = read_file(std::string(TEST_DATA) + "/asf/plain.amc");
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::string put(const std::string& name, const std::string& bytes) const {
    write_file(folder_ + "/" + name, bytes, Overwrite::allow);
    return folder_ + "/" + name;
  }
  std::unique_ptr<MotionInput> open(const std::string& name, const ReadOptions& options = {}) const {
    return open_motion(folder_ + "/" + name, "in/" + name, options);
  }
  // Label of the ASF that `name` was read with.
  std::string asf_of(const std::string& name, const ReadOptions& options = {}) const {
    const auto input = open(name, options);
    EXPECT_EQ(input->format(), "amc");
    const auto companions = input->companions();
    EXPECT_EQ(companions.size(), 1u);
    const auto before = companions_of(folder_ + "/" + name, "in/" + name, options);
    EXPECT_EQ(before.size(), 1u);
    EXPECT_EQ(before[0].path, companions[0].path);
    EXPECT_EQ(before[0].sha256, companions[0].sha256);
    return companions[0].path;
  }
  Error refusal(const std::string& name, const ReadOptions& options = {}) const {
    try {
      open(name, options);
    } catch (const Error& e) {
      EXPECT_EQ(e.status(), Exit::data);
      return e;
    }
    ADD_FAILURE() << "no error";
    return Error(Exit::ok, {}, "no error");
  }
  std::string folder_, asf_, amc_;
};

TEST_F(MotionInputTest, KeywordsInLowerCaseAreBvh) {
  std::string text = read_file(std::string(TEST_DATA) + "/bvh/plain.bvh");
  text.replace(text.find("HIERARCHY"), 9, "hierarchy");
  put("lower.bvh", text);
  EXPECT_TRUE(probe_motion(folder_ + "/lower.bvh").motion);
  EXPECT_EQ(open("lower.bvh")->format(), "bvh");
}

TEST_F(MotionInputTest, TheAsfOfTheSameNameThenOfItsBeginningThenTheOnlyOne) {
  put("07_05.amc", amc_);
  put("other.asf", asf_);
  EXPECT_EQ(asf_of("07_05.amc"), "in/other.asf");  // the only one
  put("0.asf", asf_);                              // no '_' behind it
  EXPECT_NE(refusal("07_05.amc").message().find("found 0.asf, other.asf"), std::string::npos);
  put("07.ASF", asf_);
  EXPECT_EQ(asf_of("07_05.amc"), "in/07.ASF");
  put("07_05_a_b.amc", amc_);
  put("07_05_a.asf", asf_);
  EXPECT_EQ(asf_of("07_05_a_b.amc"), "in/07_05_a.asf");
  EXPECT_EQ(asf_of("07_05.amc"), "in/07.ASF");
  put("07_05.asf", asf_);
  EXPECT_EQ(asf_of("07_05.amc"), "in/07_05.asf");
  put("07_05.asf.gz", asf_);  // what a file is its content decides
  EXPECT_NE(refusal("07_05.amc").message().find("found 07_05.asf, 07_05.asf.gz"), std::string::npos);
  ReadOptions named;
  named.asf = put("elsewhere.txt", asf_);
  EXPECT_EQ(asf_of("07_05.amc", named), "elsewhere.txt");
}

TEST_F(MotionInputTest, WithoutAnAsf) {
  put("a.amc", amc_);
  put(".hidden.asf", asf_);
  const Error e = refusal("a.amc");
  EXPECT_EQ(e.message(), "motion (AMC) without its skeleton: looked in its folder for a.asf, for an .asf that its name begins with and for the only .asf, found none");
  EXPECT_EQ(e.hint(), "--asf FILE names the skeleton");
  EXPECT_EQ(e.where().file, folder_ + "/a.amc");
  EXPECT_TRUE(companions_of(folder_ + "/a.amc", "a.amc", {}).empty());
  ReadOptions named;
  named.asf = folder_ + "/absent.asf";
  EXPECT_EQ(refusal("a.amc", named).where().file, named.asf);
  named.asf = put("wrong.asf", amc_);
  EXPECT_EQ(refusal("a.amc", named).message(), "no skeleton, expected an ASF");
  EXPECT_EQ(refusal("a.amc", named).where().file, named.asf);
  // A defect is reported where it is: in the skeleton or in the motion.
  named.asf = put("bad.asf", read_file(std::string(TEST_DATA) + "/asf/bad_loop.asf"));
  EXPECT_EQ(refusal("a.amc", named).where().file, named.asf);
  EXPECT_EQ(refusal("a.amc", named).where().line, 19);
  named.asf = put("good.asf", asf_);
  put("b.amc", read_file(std::string(TEST_DATA) + "/asf/bad_nan.amc"));
  EXPECT_EQ(refusal("b.amc", named).where().file, folder_ + "/b.amc");
  EXPECT_EQ(refusal("b.amc", named).where().line, 11);
}

TEST_F(MotionInputTest, AnAsfIsNoMotion) {
  put("a.asf", asf_);
  EXPECT_EQ(refusal("a.asf").message(), "a skeleton (ASF) without motion, expected an AMC");
  EXPECT_FALSE(probe_motion(folder_ + "/a.asf").motion);
  EXPECT_TRUE(probe_motion(put("x", amc_)).motion);
  EXPECT_TRUE(probe_motion(put("y", "# a comment\n\n 1 \n\troot 0 0 0\n")).motion);
  EXPECT_TRUE(probe_motion(put("z", ":degrees\r\n1\r\n")).motion);
  EXPECT_FALSE(probe_motion(put("w", "1\n2\n")).motion);
  EXPECT_FALSE(probe_motion(put("v", "#!/bin/sh\necho\n")).motion);
}

TEST_F(MotionInputTest, UnitAndAxisAreThoseOfTheFile) {
  put("a.asf", asf_);
  put("a.amc", amc_);
  const Clip clip = open("a.amc", {.up = UpAxis::y})->read(0);
  EXPECT_EQ(clip.name, "in/a");
  EXPECT_EQ(clip.source.unit, "asf");
  EXPECT_EQ(clip.source.up_axis, "y");
  EXPECT_EQ(clip.source.frame_rate_hz, 120);
  const double m = 0.0254 / 0.45;
  EXPECT_LT((clip.root_position[1] - m * Vector3(3.5, 1.5, 2.5)).norm(), 1e-15);
  EXPECT_LT((clip.skeleton->rest_offsets[2] - m * Vector3(0, 0, 2)).norm(), 1e-15);
  EXPECT_LT((clip.skeleton->end_sites[0].offset - m * Vector3(4, 0, 0)).norm(), 1e-15);
  const Clip forced = open("a.amc", {.unit = Unit::centimetre, .up = UpAxis::z})->read(0);
  EXPECT_EQ(forced.source.unit, "cm");
  EXPECT_EQ(forced.source.up_axis, "z");
  EXPECT_LT((forced.root_position[1] - Vector3(0.015, 0.025, 0.035)).norm(), 1e-15);
  std::string text = asf_;
  text.erase(text.find("  length 0.45\n"), 14);
  put("a.asf", text);
  EXPECT_NE(open("a.amc")->read(0).source.unit, "asf");

  const Clip bvh = open_motion(std::string(TEST_DATA) + "/bvh/tiny_human.bvh", "tiny_human.bvh")->read(0);
  EXPECT_EQ(bvh.source.unit, "cm");
  EXPECT_EQ(bvh.source.up_axis, "y");
}

TEST_F(MotionInputTest, LegsThatContradictTheUnit) {
  std::string text = asf_;
  for (const auto& [from, to] : {std::pair{"name hip", "name lhip"}, {"name thigh", "name lthigh"}, {"name shin", "name lshin"}})
    text.replace(text.find(from), std::string(from).size(), to);
  text.replace(text.find(":hierarchy"), std::string::npos, ":hierarchy\nroot lhip\nlhip lthigh\nlthigh lshin\nlshin lfoot\n");
  text.replace(text.find(":hierarchy"), 0, "begin\nname lfoot\ndirection 0 0 1\nlength 1\nend\n");
  std::string motion = amc_;
  for (std::size_t at = 0; (at = motion.find("thigh", at)) != std::string::npos; at += 6) motion.insert(at, "l");
  for (std::size_t at = 0; (at = motion.find("shin", at)) != std::string::npos; at += 5) motion.insert(at, "l");
  put("a.asf", text);
  put("a.amc", motion);
  const auto notes = open("a.amc")->doubts();  // 7 units of 0.056 m from hip to ankle
  const std::string doubt = "legs of 0.395 m by the skeleton's own unit; force another with --unit";
  EXPECT_NE(std::find(notes.begin(), notes.end(), doubt), notes.end()) << testing::PrintToString(notes);
}

}  // namespace
}  // namespace mocap::formats
