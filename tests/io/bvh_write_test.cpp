#include <cmath>
#include <numbers>
#include <sstream>

#include "libmocap/base/random.hpp"
#include "libmocap/io/bvh.hpp"
#include "libmocap/skeleton/canonical_body.hpp"
#include "tests/io/io_test_support.hpp"

namespace mocap::io {
namespace {

using test::data;
using test::error_of;

constexpr double kRadians = std::numbers::pi / 180;

// Smooth motion of the canonical body, many turns of the root included.
Clip moving_body(std::size_t frames, std::uint64_t seed) {
  Clip clip;
  clip.skeleton = canonical_body();
  clip.frame_rate_hz = 120;
  Random random(seed, 0);
  const auto joints = static_cast<std::size_t>(clip.joints());
  std::vector<Vector3> speed(joints), phase(joints);
  for (std::size_t j = 0; j < joints; ++j)
    for (int k = 0; k < 3; ++k) {
      speed[j][k] = random.uniform(0.01, 0.1);
      phase[j][k] = random.uniform(0, 6);
    }
  for (std::size_t t = 0; t < frames; ++t) {
    const auto time = static_cast<double>(t);
    clip.root_position.emplace_back(0.01 * time, std::sin(time / 9), 0.9);
    for (std::size_t j = 0; j < joints; ++j) {
      Vector3 v;
      for (int k = 0; k < 3; ++k) v[k] = 2 * std::sin(speed[j][k] * time + phase[j][k]);
      clip.rotations.push_back((j == 0 ? yaw_rotation(0.2 * time) : Quaternion::Identity()) * exp_map(v));
    }
  }
  make_sign_continuous(clip);
  return clip;
}

void expect_same_motion(const Clip& a, const Clip& b, double radians, double metres) {
  ASSERT_EQ(a.frames(), b.frames());
  ASSERT_EQ(a.joints(), b.joints());
  EXPECT_EQ(a.frame_rate_hz, b.frame_rate_hz);
  for (int j = 0; j < a.joints(); ++j) {
    const int k = b.skeleton->find(a.skeleton->joint_names[static_cast<std::size_t>(j)]);
    ASSERT_GE(k, 0);
    for (std::size_t t = 0; t < a.frames(); ++t)
      ASSERT_LT(geodesic_distance(a.frame(t)[static_cast<std::size_t>(j)], b.frame(t)[static_cast<std::size_t>(k)]),
                radians)
          << "frame " << t << " joint " << j;
  }
  for (std::size_t t = 0; t < a.frames(); ++t) ASSERT_LT((a.root_position[t] - b.root_position[t]).norm(), metres);
}

class Orders : public testing::TestWithParam<const char*> {};
TEST_P(Orders, RoundTripWithinPrintPrecisionAndSecondWriteEqual) {
  const Clip clip = moving_body(200, 5);
  const std::string first = format_bvh(clip, {GetParam(), 6});
  const BvhFile back = parse_bvh(first);
  EXPECT_TRUE(back.notes.empty());
  for (const std::string& order : back.orders) EXPECT_EQ(order, GetParam());
  // Three angles, each off by half a unit of the 6th decimal of a degree.
  expect_same_motion(clip, back.clip, 3 * 0.5e-6 * kRadians, 1e-6);
  EXPECT_EQ(back.clip.skeleton->end_sites.size(), clip.skeleton->end_sites.size());
  EXPECT_EQ(format_bvh(back.clip, {GetParam(), 6}), first);
}
INSTANTIATE_TEST_SUITE_P(Bvh, Orders, testing::Values("ZYX", "XYZ", "ZXY", "YXZ", "YZX", "XZY"),
                         [](const auto& info) { return std::string(info.param); });

TEST(BvhWrite, Text) {
  Clip clip;
  auto skeleton = std::make_shared<Skeleton>();
  skeleton->joint_names = {"Hips", "Left Leg", "Spine", "Toe"};
  skeleton->parents = {-1, 0, 0, 1};
  skeleton->rest_offsets = {{0, 0, 0}, {1, -0.25, 0}, {0, 1, 0}, {0, -4, 0}};
  skeleton->end_sites = {{2, {0, 0.5, 0}}};
  clip.skeleton = skeleton;
  clip.frame_rate_hz = 120;
  clip.root_position = {{1, 2, -1e-9}, {1, 2, 3}};
  clip.rotations.assign(8, Quaternion::Identity());
  clip.rotations[1] = from_euler(Vector3(10, 20, 30) * kRadians, EulerOrder::parse("ZYX"));
  clip.rotations[7] = yaw_rotation(170 * kRadians);
  EXPECT_EQ(format_bvh(clip, {"ZYX", 2}),
            "HIERARCHY\nROOT Hips\n{\n\tOFFSET 0.00 0.00 0.00\n\tCHANNELS 6 Xposition Yposition Zposition Zrotation "
            "Yrotation Xrotation\n"
            "\tJOINT Left Leg\n\t{\n\t\tOFFSET 1.00 -0.25 0.00\n\t\tCHANNELS 3 Zrotation Yrotation Xrotation\n"
            "\t\tJOINT Toe\n\t\t{\n\t\t\tOFFSET 0.00 -4.00 0.00\n\t\t\tCHANNELS 3 Zrotation Yrotation Xrotation\n"
            "\t\t\tEnd Site\n\t\t\t{\n\t\t\t\tOFFSET 0.00 0.00 0.00\n\t\t\t}\n\t\t}\n\t}\n"
            "\tJOINT Spine\n\t{\n\t\tOFFSET 0.00 1.00 0.00\n\t\tCHANNELS 3 Zrotation Yrotation Xrotation\n"
            "\t\tEnd Site\n\t\t{\n\t\t\tOFFSET 0.00 0.50 0.00\n\t\t}\n\t}\n}\n"
            "MOTION\nFrames: 2\nFrame Time: 0.008333333333\n"
            "1.00 2.00 0.00 0.00 0.00 0.00 10.00 20.00 30.00 0.00 0.00 0.00 0.00 0.00 0.00\n"
            "1.00 2.00 3.00 0.00 0.00 0.00 0.00 0.00 0.00 170.00 0.00 0.00 0.00 0.00 0.00\n");
}

std::vector<std::vector<double>> rows_of(const std::string& text) {
  std::istringstream lines(text.substr(text.find("Frame Time")));
  std::string line;
  std::getline(lines, line);
  std::vector<std::vector<double>> rows;
  while (std::getline(lines, line)) {
    std::istringstream numbers(line);
    rows.emplace_back(std::istream_iterator<double>(numbers), std::istream_iterator<double>());
  }
  return rows;
}

Clip one_joint(const std::vector<Quaternion>& rotations) {
  Clip clip;
  auto skeleton = std::make_shared<Skeleton>();
  skeleton->joint_names = {"A"};
  skeleton->parents = {-1};
  skeleton->rest_offsets = {Vector3::Zero()};
  clip.skeleton = skeleton;
  clip.rotations = rotations;
  clip.root_position.assign(rotations.size(), Vector3::Zero());
  return clip;
}

TEST(BvhWrite, AnglesAreUnwrappedOverTime) {
  std::vector<Quaternion> spin;
  for (int t = 0; t < 200; ++t)
    spin.push_back(yaw_rotation(7 * kRadians * t) *
                   from_euler(Vector3(0, 20, -10) * kRadians, EulerOrder::parse("ZYX")));
  const auto rows = rows_of(format_bvh(one_joint(spin)));
  for (std::size_t t = 0; t < rows.size(); ++t) {
    EXPECT_NEAR(rows[t][3], 7.0 * static_cast<double>(t), 1e-5);
    EXPECT_NEAR(rows[t][4], 20, 1e-5);
  }
}

TEST(BvhWrite, PassesThroughGimbalLock) {
  // The middle angle runs over 90 degrees: without unwrapping over both branches the outer ones jump by half a turn.
  std::vector<Quaternion> pitch;
  for (int t = 0; t <= 180; ++t) pitch.push_back(from_euler(Vector3(30, t, 12) * kRadians, EulerOrder::parse("ZYX")));
  for (const double step : {1e-6, 1e-8, 1e-10, 0.0})
    pitch.push_back(from_euler(Vector3(30, 90 + step, 12) * kRadians, EulerOrder::parse("ZYX")));
  for (const Clip& clip : {one_joint(pitch), one_joint({pitch.begin() + 90, pitch.end()})}) {
    const std::string text = format_bvh(clip);
    const auto rows = rows_of(text);
    // The second clip starts in lock, where nothing tells how the two outer angles share 18 degrees; both then go back
    // to 90.
    for (std::size_t t = clip.frames() < 100 ? 2 : 1; t < rows.size() - 4; ++t)
      for (std::size_t k = 3; k < 6; ++k) EXPECT_LT(std::abs(rows[t][k] - rows[t - 1][k]), 1.001) << "frame " << t;
    for (std::size_t t = rows.size() - 4; t < rows.size(); ++t) EXPECT_NEAR(rows[t][3] - rows[t][5], 18, 3e-6);
    const Clip back = parse_bvh(text).clip;
    expect_same_motion(clip, back, 3 * 0.5e-6 * kRadians, 1e-12);
    EXPECT_EQ(format_bvh(back), text);
  }
}

TEST(BvhWrite, JointsThatMove) {
  const BvhFile first = parse_bvh(data("bvh/six_channels_everywhere.bvh"));
  const std::string text = format_bvh(first.clip, {"ZXY", 6});
  EXPECT_NE(text.find("JOINT Hips\n\t{\n\t\tOFFSET 9.000000 9.000000 9.000000\n\t\tCHANNELS 6 Xposition"),
            std::string::npos);
  EXPECT_NE(text.find("JOINT Spine\n\t\t{\n\t\t\tOFFSET 15.735710 0.000000 0.000000\n\t\t\tCHANNELS 3 Z"),
            std::string::npos);
  const BvhFile back = parse_bvh(text);
  ASSERT_EQ(back.clip.translations.size(), first.clip.translations.size());
  for (std::size_t i = 0; i < back.clip.translations.size(); ++i)
    EXPECT_LT((back.clip.translations[i] - first.clip.translations[i]).norm(), 1e-6);
  EXPECT_EQ(format_bvh(back.clip, {"ZXY", 6}), text);
}

// write -> read -> write gives the same bytes for everything the reader accepts.
TEST(BvhWrite, SecondWriteEqualsTheFirstForEveryDialect) {
  for (const auto& entry : std::filesystem::directory_iterator(std::string(TEST_DATA) + "/bvh")) {
    const std::string name = entry.path().filename().string();
    if (!name.ends_with(".bvh") || name.starts_with("bad_")) continue;
    for (const char* order : {"ZYX", "XZY"}) {
      const std::string first = format_bvh(parse_bvh(read_file(entry.path().string())).clip, {order, 6});
      EXPECT_EQ(format_bvh(parse_bvh(first).clip, {order, 6}), first) << name;
    }
  }
}

TEST(BvhWrite, Refusals) {
  const Clip clip = moving_body(2, 1);
  for (const char* order : {"ZYZ", "ZY", "ABC", ""})
    EXPECT_EQ(error_of([&] { format_bvh(clip, {order, 6}); }).status(), Exit::usage) << order;
  EXPECT_EQ(error_of([&] { format_bvh(clip, {"ZYX", 16}); }).status(), Exit::usage);
  Clip broken = one_joint({Quaternion::Identity()});
  auto skeleton = std::make_shared<Skeleton>(*broken.skeleton);
  skeleton->joint_names[0] = "two\nlines";
  broken.skeleton = skeleton;
  EXPECT_EQ(error_of([&] { format_bvh(broken); }).message(),
            "a name with a line break or brace, which BVH cannot hold");
  broken = one_joint({Quaternion::Identity()});
  broken.root_position[0].x() = std::nan("");
  EXPECT_EQ(error_of([&] { format_bvh(broken); }).status(), Exit::data);
}

// 20,000 damaged files: each is refused with Error or is a valid clip that survives write -> read -> write.
TEST(BvhFuzz, MutationsAreRefusedOrRoundTrip) {
  std::vector<std::string> seeds;
  for (const char* name : {"plain", "mixed_orders", "six_channels_everywhere", "names", "number_forms",
                           "duplicate_names", "all_on_one_line", "no_end_site"})
    seeds.push_back(data("bvh/" + std::string(name) + ".bvh"));
  const std::string pieces[] = {"\n",         " ",      "}",   "{",      "0",         "9",        "-",
                                ".",          "e",      "1e9", "ROOT A", "JOINT B {", "End Site", "OFFSET 1 2 3",
                                "CHANNELS 0", "MOTION", "\r",  "\xff",   "90",        "180",      "-90"};
  Random random(20260101, 0);
  int read = 0;
  for (int n = 0; n < 20000; ++n) {
    std::string text = seeds[random.below(seeds.size())];
    for (std::uint64_t k = random.below(4) + 1; k > 0; --k) {
      const std::size_t at = random.below(text.size());
      switch (random.below(8)) {
        case 0:
          text[at] = static_cast<char>(random.below(256));
          break;
        case 1:
          text.insert(at, pieces[random.below(std::size(pieces))]);
          break;
        case 2:
          text.erase(at, random.below(20));
          break;
        case 3:
        case 4:
        case 5:
        case 6:
          if (const auto digit = text.find_first_of("0123456789", at); digit != std::string::npos)
            text[digit] = static_cast<char>('0' + random.below(10));
          break;
        default:
          text.insert(at, text.substr(random.below(text.size()), random.below(40)));
          break;
      }
      if (text.empty()) text = " ";
    }
    BvhFile file;
    try {
      file = parse_bvh(text, {random.below(2) == 0});
    } catch (const Error& e) {
      ASSERT_EQ(e.status(), Exit::data) << text;
      continue;
    }
    ++read;
    file.clip.validate();
    const std::string first = format_bvh(file.clip);
    ASSERT_EQ(format_bvh(parse_bvh(first).clip), first) << text;
  }
  EXPECT_GT(read, 2000);
}

}  // namespace
}  // namespace mocap::io
