#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>

#include "libmocap/io/bvh.hpp"
#include "tests/io/io_test_support.hpp"

namespace mocap::io {
namespace {

using test::data;
using test::error_of;

BvhFile read(const std::string& name, bool lenient = false) {
  return parse_bvh(data("bvh/" + name + ".bvh"), {lenient});
}

double largest_difference(const Clip& a, const Clip& b) {
  double worst = 0;
  for (std::size_t i = 0; i < a.rotations.size(); ++i)
    worst = std::max(worst, (a.rotations[i].coeffs() - b.rotations[i].coeffs()).norm());
  for (std::size_t t = 0; t < a.frames(); ++t)
    worst = std::max(worst, (a.root_position[t] - b.root_position[t]).norm());
  return worst;
}

TEST(BvhRead, PlainFile) {
  const BvhFile f = read("plain");
  const Skeleton& s = *f.clip.skeleton;
  EXPECT_EQ(s.joint_names, (std::vector<std::string>{"Hips", "Spine"}));
  EXPECT_EQ(s.parents, (std::vector<int>{-1, 0}));
  EXPECT_EQ(s.rest_offsets[0], Vector3(0.5, 1.25, -2));  // kept although the position channels replace it
  EXPECT_EQ(s.rest_offsets[1], Vector3(0, 10, 0.125));
  ASSERT_EQ(s.end_sites.size(), 1u);
  EXPECT_EQ(s.end_sites[0].parent, 1);
  EXPECT_EQ(s.end_sites[0].offset, Vector3(0, 5, 0));
  EXPECT_EQ(f.orders, (std::vector<std::string>{"ZXY", "ZXY"}));
  EXPECT_TRUE(f.notes.empty());
  ASSERT_EQ(f.clip.frames(), 3u);
  EXPECT_EQ(f.clip.frame_rate_hz, 30);
  EXPECT_EQ(f.clip.root_position[1], Vector3(1.5, 2, -3.125));
  EXPECT_TRUE(f.clip.translations.empty());
  EXPECT_TRUE(f.clip.name.empty() && f.clip.source.path.empty());
  const Vector3 angles = Vector3(10, -20.25, 30) * std::numbers::pi / 180;
  EXPECT_LT(geodesic_distance(f.clip.rotations[0], from_euler(angles, EulerOrder::parse("ZXY"))), 1e-15);
}

// Each says what plain.bvh says.
class SameAsPlain : public testing::TestWithParam<const char*> {};
TEST_P(SameAsPlain, ReadsTheSame) {
  const BvhFile plain = read("plain"), other = read(GetParam());
  EXPECT_TRUE(other.clip.skeleton->same_as(*plain.clip.skeleton, 0));
  EXPECT_EQ(other.clip.frame_rate_hz, plain.clip.frame_rate_hz);
  EXPECT_EQ(other.orders, plain.orders);
  ASSERT_EQ(other.clip.frames(), plain.clip.frames());
  EXPECT_EQ(largest_difference(other.clip, plain.clip), 0);
  EXPECT_TRUE(other.notes.empty());
}
INSTANTIATE_TEST_SUITE_P(Dialects, SameAsPlain,
                         testing::Values("tabs", "mixed_line_ends", "lone_cr", "blank_lines", "bom",
                                         "end_site_spelling", "keyword_case", "trailing_blanks", "no_final_newline",
                                         "all_on_one_line", "one_line_hierarchy", "brace_on_the_line", "no_colon_blank",
                                         "number_forms"),
                         [](const auto& info) { return std::string(info.param); });

TEST(BvhRead, AgreesWithSciPyOverMixedOrdersAndSubsets) {
  const BvhFile f = read("mixed_orders");
  EXPECT_EQ(f.orders, (std::vector<std::string>{"ZYX", "YXZ", "XZ", "XZY", "YZX", "ZXY"}));
  EXPECT_EQ(f.clip.frame_rate_hz, 120);
  std::istringstream rows(data("bvh/mixed_orders.tsv"));
  Pose pose;
  for (std::size_t t = 0; t < f.clip.frames(); ++t) {
    world_pose(f.clip, t, pose);
    for (const Vector3& p : pose.positions)
      for (int k = 0; k < 3; ++k) {
        double expected = 0;
        ASSERT_TRUE(rows >> expected);
        EXPECT_NEAR(p[k], expected, 1e-12) << "frame " << t;
      }
  }
}

TEST(BvhRead, RotationsAreUnitExactAndContinuous) {
  // Angles over many turns and at the nasty places, against the long way round.
  const std::string head =
      "HIERARCHY ROOT A { OFFSET 0 0 0 CHANNELS 3 Xrotation Yrotation Zrotation }\nMOTION\nFrames: ";
  std::string rows;
  std::vector<Vector3> angles;
  for (const double v :
       {0.0,   1e-12, 1e-5,  45.0,  89.9999, 90.0,  179.999999, 180.0,   181.0,       269.0, 270.0, 359.9,
        360.0, 361.0, 539.0, 540.0, 719.0,   720.0, 721.0,      1e6 + 1, 123456789.0, 1e15,  1e18})
    for (const double sign : {1.0, -1.0}) angles.emplace_back(sign * v, 10 - v, sign * v / 3);
  for (const Vector3& a : angles) {
    std::ostringstream row;
    row.precision(17);
    row << a[0] << ' ' << a[1] << ' ' << a[2] << '\n';
    rows += row.str();
  }
  const Clip clip = parse_bvh(head + std::to_string(angles.size()) + "\nFrame Time: 0.01\n" + rows).clip;
  for (std::size_t t = 0; t < angles.size(); ++t) {
    Vector3 reduced;
    for (int k = 0; k < 3; ++k) reduced[k] = std::remainder(angles[t][k], 360.0) * std::numbers::pi / 180;
    EXPECT_LT(geodesic_distance(clip.rotations[t], from_euler(reduced, EulerOrder::parse("XYZ"))), 4e-15)
        << angles[t].transpose();
    EXPECT_NEAR(clip.rotations[t].norm(), 1, 2e-15);
    EXPECT_GE(clip.rotations[t].dot(clip.rotations[t == 0 ? 0 : t - 1]), 0);
  }
}

TEST(BvhRead, NumbersAreCorrectlyRounded) {
  for (const char* text : {"0.1", "-0.3", "123456789012345", "1234567890.12345", "0.000000000000001",
                           "9007199254740993", "1.7976931348623157e308", "4.9e-324", "0.1234567890123456789",
                           "31.400000000000000000000000001", "5e-1", "2.5E+003"}) {
    const std::string file =
        "HIERARCHY\nROOT A\n{\nOFFSET 0 0 0\nCHANNELS 3 Xposition Yposition Zposition\n}\nMOTION\nFrames: 1\nFrame "
        "Time: 1\n" +
        std::string(text) + " 0 0\n";
    EXPECT_EQ(parse_bvh(file).clip.root_position[0].x(), std::strtod(text, nullptr)) << text;
  }
}

TEST(BvhRead, PositionsOfTheRoot) {
  EXPECT_EQ(read("root_without_positions").clip.root_position[1], Vector3(1, 2, 3));
  EXPECT_NEAR(read("root_without_positions").clip.frame_rate_hz, 30000.0 / 1001, 1e-12);
  EXPECT_EQ(read("root_one_position").clip.root_position[1], Vector3(1, 20, 3));
}

TEST(BvhRead, PositionsOfOtherJoints) {
  const BvhFile f = read("six_channels_everywhere");
  const Skeleton& s = *f.clip.skeleton;
  EXPECT_EQ(s.rest_offsets[1], Vector3(9, 9, 9));
  EXPECT_LT((s.rest_offsets[2] - Vector3(15.73571, 0, -5e-7)).norm(), 1e-9);  // middle of what hardly varies
  ASSERT_EQ(f.clip.translations.size(), 9u);
  for (std::size_t t = 0; t < 3; ++t) {
    EXPECT_EQ(f.clip.translations[3 * t + 1],
              Vector3(1.0 + static_cast<double>(t), 90.0 + static_cast<double>(t), -4.0 - static_cast<double>(t)));
    EXPECT_EQ(f.clip.translations[3 * t + 2], s.rest_offsets[2]);
  }
  ASSERT_EQ(f.notes.size(), 2u);
  EXPECT_EQ(f.notes[0], "positions that do not vary became offsets: Spine");
  EXPECT_EQ(f.notes[1], "positions that vary are kept as translations: Hips");

  const BvhFile near_zero = read("positions_near_zero");
  EXPECT_TRUE(near_zero.clip.translations.empty());
  EXPECT_EQ(near_zero.clip.skeleton->rest_offsets[2], Vector3(0, 0, 0));
  EXPECT_NE(near_zero.notes[0].find("joint Spine: positions near 0 replace an OFFSET"), std::string::npos);
}

TEST(BvhRead, JointsWithoutEndSiteOrChannels) {
  const BvhFile f = read("no_end_site");
  EXPECT_TRUE(f.clip.skeleton->end_sites.empty());
  EXPECT_EQ(f.orders, (std::vector<std::string>{"XYZ", "Y", ""}));
  EXPECT_LT(
      geodesic_distance(f.clip.rotations[1], from_euler(Vector3(std::numbers::pi / 4, 0, 0), EulerOrder::parse("Y"))),
      1e-15);
  EXPECT_EQ(f.clip.rotations[2].coeffs(), Quaternion::Identity().coeffs());
}

TEST(BvhRead, Names) {
  EXPECT_EQ(read("names").clip.skeleton->joint_names,
            (std::vector<std::string>{"mixamorig:Hips", "Left Up-Leg (L)", "RShould_End", "levator02.L",
                                      "Schlüsselbein 骨", "End"}));
  const BvhFile twice = read("duplicate_names");
  EXPECT_EQ(twice.clip.skeleton->joint_names, (std::vector<std::string>{"Hips", "Toe", "Toe#2", "Toe#2#2", "Toe#3"}));
  ASSERT_EQ(twice.notes.size(), 3u);
  EXPECT_EQ(twice.notes[0], "line 10: another joint 'Toe', renamed to 'Toe#2'");
  const BvhFile latin = read("latin1_name");
  EXPECT_EQ(latin.clip.skeleton->joint_names[1], "Rücken");
  EXPECT_EQ(latin.notes.size(), 1u);
}

struct Defect {
  const char* file;
  long line;
  const char* object;
  const char* message;
};
void PrintTo(const Defect& d, std::ostream* out) { *out << d.file; }

class Refused : public testing::TestWithParam<Defect> {};
TEST_P(Refused, WithLineObjectAndBothSides) {
  const Defect& d = GetParam();
  const Error e = error_of([&] { read(d.file); });
  EXPECT_EQ(e.status(), Exit::data);
  EXPECT_EQ(e.where().line, d.line);
  EXPECT_EQ(e.where().object, d.object);
  EXPECT_EQ(e.message(), d.message);
  EXPECT_TRUE(e.where().file.empty());
  const std::string message = d.message;  // the hint comes where lenient reading would help
  EXPECT_EQ(!e.hint().empty(), message.find(" declared, found ") != std::string::npos ||
                                   message.find(" numbers, expected 9") != std::string::npos);
}
constexpr const char* kChannelNames = "expected Xposition, Yposition, Zposition, Xrotation, Yrotation or Zrotation";
const std::string kChannelMessage = std::string("channel 'Yscale', ") + kChannelNames;
INSTANTIATE_TEST_SUITE_P(
    Defects, Refused,
    testing::Values(
        Defect{"bad_empty", 1, "", "an empty file, expected HIERARCHY"},
        Defect{"bad_not_bvh", 1, "", "starts with 'PK', expected HIERARCHY"},
        Defect{"bad_two_roots", 16, "", "a second ROOT 'Other', expected one skeleton in a file"},
        Defect{"bad_fewer_rows", 17, "", "Frames: 5 declared, found 3 rows"},
        Defect{"bad_more_rows", 17, "", "Frames: 2 declared, found 3 rows"},
        Defect{"bad_row_short", 20, "", "frame 1 has 8 numbers, expected 9 (6 + 1 x 3 channels)"},
        Defect{"bad_row_long", 20, "", "frame 1 has 10 numbers, expected 9 (6 + 1 x 3 channels)"},
        Defect{"bad_wrapped_rows", 19, "", "frame 0 has 5 numbers, expected 9 (6 + 1 x 3 channels)"},
        Defect{"bad_one_line_partial", 19, "", "frame 0 has 29 numbers, expected 9 (6 + 1 x 3 channels)"},
        Defect{"bad_truncated", 21, "", "frame 2 has '-' as number 3, expected a finite number"},
        Defect{"bad_decimal_comma", 20, "", "frame 1 has '1,5' as number 1, expected a finite number"},
        Defect{"bad_hexadecimal", 20, "", "frame 1 has '0x10' as number 4, expected a finite number"},
        Defect{"bad_nan", 20, "", "frame 1 has 'nan' as number 4, expected a finite number"},
        Defect{"bad_infinity", 20, "", "frame 1 has '-inf' as number 4, expected a finite number"},
        Defect{"bad_overflow", 20, "", "frame 1 has '1e400' as number 4, expected a finite number"},
        Defect{"bad_word_in_row", 20, "", "frame 1 has 'twelve' as number 4, expected a finite number"},
        Defect{"bad_nul_in_row", 20, "", "frame 1 has '1?2' as number 4, expected a finite number"},
        Defect{"bad_frame_time_zero", 18, "", "Frame Time: '0.000', expected a finite number of seconds above 0"},
        Defect{"bad_frame_time_negative", 18, "", "Frame Time: '-0.0333', expected a finite number of seconds above 0"},
        Defect{"bad_frame_time_text", 18, "", "Frame Time: 'fast', expected a finite number of seconds above 0"},
        Defect{"bad_frame_time_missing", 18, "", "'1' after MOTION, expected 'Frames:' and 'Frame Time:'"},
        Defect{"bad_frames_zero", 17, "", "Frames: '0', expected a whole number of at least 1"},
        Defect{"bad_frames_negative", 17, "", "Frames: '-1', expected a whole number of at least 1"},
        Defect{"bad_frames_fraction", 17, "", "Frames: '3.0', expected a whole number of at least 1"},
        Defect{"bad_frames_overflow", 17, "", "Frames: '36893488147419103232', expected a whole number of at least 1"},
        Defect{"bad_frames_huge", 17, "", "Frames: 1125899906842624 declared, found 3 rows"},
        Defect{"bad_channel_name", 5, "joint Hips", kChannelMessage.c_str()},
        Defect{"bad_channel_twice", 9, "joint Spine", "channel Zrotation twice, expected each at most once"},
        Defect{"bad_channels_fewer", 9, "joint Spine", "CHANNELS 3 followed by 2 names, expected 3"},
        Defect{"bad_channels_more", 9, "joint Spine", "CHANNELS 2 followed by 3 names, expected 2"},
        Defect{"bad_channels_count", 9, "joint Spine", "CHANNELS '1000000000', expected a whole number from 0 to 6"},
        Defect{"bad_channels_none", 6, "", "a skeleton without channels, expected at least one"},
        Defect{"bad_offset_short", 8, "joint Spine", "OFFSET followed by 2 numbers, expected 3"},
        Defect{"bad_offset_text", 8, "joint Spine", "OFFSET with 'ten', expected 3 finite numbers"},
        Defect{"bad_offset_missing", 13, "joint Spine", "'}' before an OFFSET, expected one"},
        Defect{"bad_offset_twice", 9, "joint Spine", "a second OFFSET, expected one"},
        Defect{"bad_not_closed", 15, "joint Hips", "MOTION before the joint is closed, expected '}'"},
        Defect{"bad_closed_twice", 16, "", "'}' that closes nothing"},
        Defect{"bad_no_motion", 16, "", "the file ends inside HIERARCHY, expected MOTION"},
        Defect{"bad_cut_in_hierarchy", 8, "joint Spine", "OFFSET followed by 2 numbers, expected 3"},
        Defect{"bad_no_name", 6, "joint Hips", "a joint without a name"},
        Defect{"bad_no_brace", 8, "joint Hips", "JOINT Spine followed by 'OFFSET', expected '{'"},
        Defect{"bad_keyword", 6, "joint Hips", "'BONE', expected OFFSET, CHANNELS, JOINT, End Site or '}'"},
        Defect{"bad_joint_in_end_site", 12, "End Site of Spine", "a JOINT inside an End Site, expected '}'"}),
    [](const auto& info) { return std::string(info.param.file); });

TEST(BvhRead, LenientKeepsWholeFrames) {
  const Clip plain = read("plain").clip;
  const auto check = [&](const char* name, std::size_t frames, const std::string& note) {
    const BvhFile f = read(name, true);
    EXPECT_EQ(f.clip.frames(), frames) << name;
    EXPECT_EQ(f.clip.rotations.size(), 2 * frames) << name;
    ASSERT_FALSE(f.repairs.empty()) << name;
    EXPECT_EQ(f.repairs.back(), note);
    EXPECT_EQ(f.clip.root_position.back(), plain.root_position.back()) << name;
  };
  check("bad_fewer_rows", 3, "Frames: 5 declared, kept 3 whole ones");
  check("bad_more_rows", 3, "Frames: 2 declared, kept 3 whole ones");
  check("bad_row_short", 2, "Frames: 3 declared, kept 2 whole ones");
  check("bad_row_long", 2, "Frames: 3 declared, kept 2 whole ones");
  EXPECT_EQ(read("bad_row_long", true).repairs[0],
            "line 20: frame 1 has 10 numbers, expected 9 (6 + 1 x 3 channels); rows like it left out: 1");
  const BvhFile line = read("bad_one_line_partial", true);
  EXPECT_EQ(line.clip.frames(), 3u);
  EXPECT_EQ(largest_difference(line.clip, plain), 0);
  // Damaged numbers stay refused, and so does a file without one whole frame.
  for (const char* name : {"bad_nan", "bad_decimal_comma", "bad_truncated", "bad_frames_zero"})
    EXPECT_EQ(error_of([&] { read(name, true); }).status(), Exit::data);
  std::string text = data("bvh/plain.bvh");
  text = text.substr(0, text.find("1 2.5")) + "1 2 3\n";
  EXPECT_EQ(error_of([&] { parse_bvh(text, {true}); }).message(),
            "no row of the right width: frame 0 has 3 numbers, expected 9 (6 + 1 x 3 channels)");
}

TEST(BvhRead, CutAnywhereIsRefused) {
  const std::string text = data("bvh/plain.bvh");
  // Losing digits of the very last number cannot be seen: every shorter piece is refused.
  const std::size_t last_number = text.find_last_of(' ') + 1;
  for (std::size_t n = 0; n <= last_number; ++n)
    EXPECT_EQ(error_of([&] { parse_bvh(text.substr(0, n)); }).status(), Exit::data) << n;
}

TEST(BvhRead, DepthIsNotLimitedByTheStack) {
  constexpr int kDepth = 100000;
  std::string text = "HIERARCHY\n";
  for (int i = 0; i < kDepth; ++i)
    text += (i == 0 ? "ROOT j" : "JOINT j") + std::to_string(i) + "\n{\nOFFSET 0 1 0\n" +
            (i % 16 == 0 ? "CHANNELS 1 Xrotation\n" : "");
  const std::string open = text;
  for (int i = 0; i < kDepth; ++i) text += "}\n";
  text += "MOTION\nFrames: 1\nFrame Time: 0.01\n";
  for (int i = 0; i < kDepth; i += 16) text += "1 ";
  const Clip clip = parse_bvh(text).clip;
  EXPECT_EQ(clip.joints(), kDepth);
  EXPECT_LT(format_bvh(clip).size(), 40u << 20);
  EXPECT_NE(error_of([&] { parse_bvh(open); }).message().find("the file ends inside HIERARCHY"), std::string::npos);
}

TEST(BvhRead, MemoryIsBoundedByTheText) {
  // 100,000 joints without channels and one channel: 100,000 rotations a frame for two bytes of text.
  std::string text = "HIERARCHY\nROOT A\n{\nOFFSET 0 0 0\nCHANNELS 1 Xrotation\n";
  for (int i = 0; i < 100000; ++i) text += "JOINT j" + std::to_string(i) + "{OFFSET 0 0 0\n}\n";
  text += "}\nMOTION\nFrames: 1000000\nFrame Time: 0.01\n";
  for (int i = 0; i < 1000000; ++i) text += "0\n";
  const Error e = error_of([&] { parse_bvh(text); });
  EXPECT_EQ(e.message(),
            "1000000 frames of 100001 joints with 1 channels between them, expected channels on most joints");
}

TEST(BvhRead, SnapsFrameRates) {
  EXPECT_EQ(snap_frame_rate(0.008333), 120);
  EXPECT_EQ(snap_frame_rate(0.0083333), 120);
  EXPECT_EQ(snap_frame_rate(1.0 / 120), 120);
  EXPECT_EQ(snap_frame_rate(0.04166667), 24);
  EXPECT_EQ(snap_frame_rate(0.016666666666666666), 60);
  EXPECT_EQ(snap_frame_rate(0.0333667), 30000.0 / 1001);
  EXPECT_EQ(snap_frame_rate(0.016683), 60000.0 / 1001);
  EXPECT_EQ(snap_frame_rate(0.0417083750417), 24000.0 / 1001);
  EXPECT_EQ(snap_frame_rate(0.005), 200);
  EXPECT_EQ(snap_frame_rate(2), 0.5);
  EXPECT_EQ(snap_frame_rate(0.02127226), 1 / 0.02127226);
  const auto rate_of = [](const std::string& time) {
    std::string text = data("bvh/plain.bvh");
    text.replace(text.find("0.033333"), 8, time);
    return parse_bvh(text).clip.frame_rate_hz;
  };
  EXPECT_EQ(rate_of("0.0333"), 30);
  EXPECT_EQ(rate_of("0.03333"), 30);
  EXPECT_EQ(rate_of(".0083"), 120);
  EXPECT_EQ(rate_of("0.033"), 30);
  EXPECT_EQ(rate_of("0.017"), 60);
  EXPECT_EQ(rate_of("0.042"), 24);
  EXPECT_EQ(rate_of("0.008"), 125);
  EXPECT_EQ(rate_of("0.009"), 1 / 0.009);
  EXPECT_EQ(rate_of("0.0042"), 240);
  EXPECT_EQ(rate_of("0.0056"), 180);
  EXPECT_EQ(rate_of("0.0069"), 144);
  EXPECT_EQ(rate_of("0.0334"), 30000.0 / 1001);
  EXPECT_EQ(rate_of("0.00420168"), 238);
  EXPECT_EQ(rate_of("0.0333000"), 1 / 0.0333);
  EXPECT_EQ(rate_of("3.33333333e-2"), 30);
}

}  // namespace
}  // namespace mocap::io
