#include "libmocap/formats/path_attributes.hpp"

#include <gtest/gtest.h>

#include "libmocap/base/error.hpp"

namespace mocap::formats {
namespace {

std::string refusal(const std::string& regex) {
  try {
    PathAttributes{regex};
  } catch (const Error& e) {
    EXPECT_EQ(e.status(), Exit::usage);
    return e.what();
  }
  return "accepted";
}

TEST(PathAttributes, NamedGroupsBecomeAttributes) {
  const PathAttributes named("(?<subject>[^/]+)/(?:\\d+_)?(?<action>[a-z]+)(?<take>_\\d*)?");
  Attributes a{{"gender", "female"}, {"action", "from the file"}};
  EXPECT_TRUE(named.apply(a, "/data/cmu/s07/2_walk.bvh", "s07/2_walk.bvh"));
  EXPECT_EQ(a, (Attributes{{"gender", "female"}, {"subject", "s07"}, {"action", "walk"}}));  // a group that took no part sets nothing
  EXPECT_TRUE(named.apply(a, "", "s07/run_3"));
  EXPECT_EQ(a.at("take"), "_3");
}

TEST(PathAttributes, TheLabelFirstThenThePathAsTyped) {
  const PathAttributes named("(?P<subject>[^/]+)/[^/]+$");
  Attributes a;
  EXPECT_TRUE(named.apply(a, "cmu/s07/w.bvh", "w.bvh"));
  EXPECT_EQ(a.at("subject"), "s07");
  EXPECT_TRUE(named.apply(a, "other/w.bvh", "s08/w.bvh"));
  EXPECT_EQ(a.at("subject"), "s08");
  EXPECT_FALSE(named.apply(a, "w.bvh", "w.bvh"));
  EXPECT_FALSE(named.apply(a, "-", "-"));
  EXPECT_EQ(a.at("subject"), "s08");
}

TEST(PathAttributes, BytesThatAreNoUtf8AreMatchedAround) {
  const PathAttributes named("(?<action>[a-z]+)_");
  Attributes a;
  EXPECT_TRUE(named.apply(a, "", "\xff/walk_1"));
  EXPECT_EQ(a.at("action"), "walk");
  EXPECT_TRUE(PathAttributes("(?<action>ge.en)").apply(a, "", "gehen"));
  EXPECT_TRUE(PathAttributes("(?<action>m.de)").apply(a, "", "m\xc3\xbc" "de"));
}

TEST(PathAttributes, Refusals) {
  EXPECT_NE(refusal("(?<subject>[^/]+").find("--attr-from-path: '(?<subject>[^/]+': missing closing parenthesis at character 17"), std::string::npos);
  EXPECT_NE(refusal("([a-z]+)/(\\d+)").find("has no named group, expected (?<name>...)"), std::string::npos);
  EXPECT_NE(refusal("").find("has no named group"), std::string::npos);
  const PathAttributes endless("^(?<a>(x+x+)+)y$");
  Attributes a;
  try {
    endless.apply(a, "", std::string(60, 'x') + "y!");
    ADD_FAILURE() << "no error";
  } catch (const Error& e) {
    EXPECT_EQ(e.status(), Exit::usage);
    EXPECT_NE(std::string(e.what()).find("match limit exceeded, expected a simpler expression"), std::string::npos) << e.what();
  }
}

TEST(AmassAttributes, TheLastTwoFolders) {
  const auto of = [](const char* path, const char* label) {
    Attributes a;
    amass_attributes(a, path, label);
    return a;
  };
  const Attributes accad{{"dataset", "ACCAD"}, {"subject", "Female1_c3d"}};
  EXPECT_EQ(of("amass/ACCAD/Female1_c3d/A1_poses.npz", "ACCAD/Female1_c3d/A1_poses.npz"), accad);
  EXPECT_EQ(of("amass/ACCAD/Female1_c3d/A1_poses.npz", "Female1_c3d/A1_poses.npz"), accad);
  EXPECT_EQ(of("./ACCAD/Female1_c3d//A1_stageii.npz", "A1_stageii.npz"), accad);
  EXPECT_EQ(of("a/b/smplx/ACCAD/Female1_c3d/A1_stageii.npz.gz", "smplx/ACCAD/Female1_c3d/A1_stageii.npz.gz"), accad);
  EXPECT_EQ(of("Female1_c3d/A1_poses.npz", "A1_poses.npz"), (Attributes{{"subject", "Female1_c3d"}}));
  EXPECT_EQ(of("../A1_poses.npz", "A1_poses.npz"), Attributes{});
  EXPECT_EQ(of("-", "-"), Attributes{});
  EXPECT_EQ(of("export/mine/walk.npz", "export/mine/walk.npz"), Attributes{});  // no AMASS name
  Attributes set{{"subject", "given"}};
  amass_attributes(set, "D/S/a_poses.npz", "D/S/a_poses.npz");
  EXPECT_EQ(set, (Attributes{{"subject", "given"}, {"dataset", "D"}}));
}

}  // namespace
}  // namespace mocap::formats
