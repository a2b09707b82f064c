#include "libmocap/formats/joint_map_file.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

#include "libmocap/base/error.hpp"
#include "libmocap/base/output_file.hpp"

namespace mocap::formats {
namespace {

class JointMapFileTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = (std::filesystem::temp_directory_path() / "joint-map-XXXXXX").string();
    ASSERT_NE(::mkdtemp(folder_.data()), nullptr);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  JointMapFile read(const std::string& text) const {
    write_file(folder_ + "/map.toml", text, Overwrite::allow);
    return read_joint_map(folder_ + "/map.toml");
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

TEST_F(JointMapFileTest, ReadsTheTable) {
  const JointMapFile map = read("# a rig\n[joints]\nleft_hip = \"Bone.012\"\nleft_foot = \"\"   # no toes\nright_foot = ''\n\"head\" = 'Kopf \\u00df'\n");
  EXPECT_EQ(map.joints, (std::map<std::string, std::string>{{"left_hip", "Bone.012"}, {"left_foot", ""}, {"right_foot", ""}, {"head", "Kopf \\u00df"}}));
  EXPECT_EQ(map.sha256.size(), 64u);
  EXPECT_EQ(read("joints = { pelvis = \"Hüfte\" }").joints.at("pelvis"), "Hüfte");
  EXPECT_TRUE(read("[joints]\r\n").joints.empty());
  EXPECT_NE(read("[joints]\n").sha256, map.sha256);
}

TEST_F(JointMapFileTest, LettersBeyondAsciiStandInQuotesAndComments) {
  const JointMapFile map = read("\xef\xbb\xbf# H\xc3\xbc" "fte\n[joints]\nleft_hip = \"H\xc3\xbc" "fte \\\"links\\\"\" # \xc3\xa4\nright_hip = '''H\xc3\xbc" "fte\nrechts'''\nhead = \"\"\"\xc3\xa4\"\"\"\n");
  EXPECT_EQ(map.joints.at("left_hip"), "H\xc3\xbc" "fte \"links\"");
  EXPECT_EQ(map.joints.at("head"), "\xc3\xa4");
  EXPECT_NE(refusal("[joints]\na\xc3\xa4" "b = \"x\"\n").find("map.toml:2: a letter beyond ASCII outside of quotes"), std::string::npos);
  EXPECT_NE(refusal("[joints]\nhead = \"\"\"a\\\n\xc3\xa4\"\"\"\"\" \xc3\xa4\n").find("map.toml:3: a letter beyond ASCII outside of quotes"), std::string::npos);
  EXPECT_NE(refusal("[joints]\nhead = \"x\" \xc3\xa4\n").find("map.toml:2: a letter beyond"), std::string::npos);
  EXPECT_NE(refusal("[joints]\nhead = '''\n\n'''\n\xc3\xa4").find("map.toml:5: a letter beyond"), std::string::npos);
  EXPECT_NE(refusal("[joints]\nhead = '''\n\n'''\n# \xe4").find("map.toml:5: bytes that are no UTF-8"), std::string::npos);
  EXPECT_EQ(read("[joints]\nhead = \"~c3~a4~\"\nneck = '~7e'\n").joints, (std::map<std::string, std::string>{{"head", "~c3~a4~"}, {"neck", "~7e"}}));
}

TEST_F(JointMapFileTest, EachErrorHasItsLine) {
  const std::pair<const char*, const char*> cases[] = {
      {"[joints]\nleft_hip = Bone\n", "map.toml:2: "},
      {"[joints]\n\nleft_hip = \"Bone\n", "map.toml:3: "},
      {"[joints]\nleft_hip \"Bone\"\n", "map.toml:2: "},
      {"[joints]\nleft_hip = \"A\"\nleft_hip = \"B\"\n", "map.toml:3: "},
      {"left_hip = \"Bone\"\n", "map.toml:1: 'left_hip', expected one table [joints]"},
      {"[joints]\n[bones]\n", "map.toml:2: 'bones', expected one table [joints]"},
      {"joints = 3\n", "map.toml:1: 'joints', expected one table [joints]"},
      {"[[joints]]\n", "'joints', expected one table [joints]"},
      {"", "map.toml: no table [joints], expected lines like left_hip = \"Bone.012\""},
      {"[joints]\nleft_hip = \"A\"\nleft_thigh = \"B\"\n", "map.toml:3: 'left_thigh', expected a joint of the canonical body: pelvis, left_hip"},
      {"[joints]\nleft_hip = 3\n", "map.toml:2:left_hip: a value that is no text"},
      {"[joints]\nleft_hip = [\"A\"]\n", "map.toml:2:left_hip: a value that is no text"},
      {"[joints]\nhead = \"A\"\n\nneck = \"A\"\n", "joint 'A' stands for "},
      {"\xff\xfe[joints]\n", "map.toml:1: "},
  };
  for (const auto& [text, expected] : cases) EXPECT_NE(refusal(text).find(expected), std::string::npos) << text << "\n" << refusal(text);
  EXPECT_NE(refusal("[joints]\nleft_hip = Bone\n").find("expected TOML"), std::string::npos);
  EXPECT_THROW(read_joint_map(folder_ + "/absent.toml"), Error);
}

}  // namespace
}  // namespace mocap::formats
