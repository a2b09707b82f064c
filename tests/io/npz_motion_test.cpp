#include <cmath>
#include <numbers>

#include "libmocap/base/random.hpp"
#include "libmocap/io/npz.hpp"
#include "libmocap/skeleton/canonical_body.hpp"
#include "tests/io/io_test_support.hpp"

namespace mocap::io {
namespace {

using test::data;
using test::error_of;

constexpr double kPi = std::numbers::pi;

const History kHistory{{"bvh2npz", "0.1.0", "abc", {"bvh2npz", "--unit", "cm"}, std::nullopt, {{"walk.bvh", "00ff"}}}};

// Rotations over the whole group: tiny, near pi, about every axis.
Clip random_clip(std::shared_ptr<const Skeleton> skeleton, std::size_t frames) {
  Clip clip;
  clip.skeleton = std::move(skeleton);
  Random random(11, 0);
  const double angles[] = {0, 1e-12, 1e-7, 1e-4, 1, kPi - 1e-7, kPi, 2.5};
  for (std::size_t t = 0; t < frames; ++t) {
    clip.root_position.emplace_back(random.normal(), random.normal(), 0.9);
    for (int j = 0; j < clip.joints(); ++j) {
      const Vector3 axis = Vector3(random.normal(), random.normal(), random.normal()).normalized();
      clip.rotations.push_back(exp_map(axis * angles[random.below(std::size(angles))]));
    }
  }
  make_sign_continuous(clip);
  return clip;
}

void expect_same(const Clip& a, const Clip& b, double radians, double metres) {
  ASSERT_EQ(a.frames(), b.frames());
  ASSERT_EQ(a.rotations.size(), b.rotations.size());
  for (std::size_t i = 0; i < a.rotations.size(); ++i)
    EXPECT_LT(geodesic_distance(a.rotations[i], b.rotations[i]), radians);
  for (std::size_t t = 0; t < a.frames(); ++t) EXPECT_LT((a.root_position[t] - b.root_position[t]).norm(), metres);
  EXPECT_EQ(a.frame_rate_hz, b.frame_rate_hz);
}

std::shared_ptr<Skeleton> three_joints() {
  auto s = std::make_shared<Skeleton>();
  s->joint_names = {"Hips", "Rücken", "手"};
  s->parents = {-1, 0, 1};
  s->rest_offsets = {{0, 0, 0}, {0, 0.1, 0.2}, {0.3, 0, 0}};
  s->end_sites = {{2, {0.1, 0, 0}}, {1, {0, 0, 0.05}}};
  return s;
}

TEST(SourceLayout, RoundTrip) {
  Clip clip = random_clip(three_joints(), 40);
  clip.frame_rate_hz = 29.97;
  clip.attributes["gender"] = "female";
  const std::string bytes = format_npz(to_source_layout(clip, kHistory));
  const NpzMotion m = parse_motion_npz(bytes);
  EXPECT_EQ(m.release, "source");
  expect_same(clip, m.clip, 1e-9, 1e-15);
  EXPECT_TRUE(m.clip.skeleton->same_as(*clip.skeleton, 0));
  EXPECT_EQ(m.clip.attributes, clip.attributes);
  EXPECT_EQ(to_json_lines(m.history), to_json_lines(kHistory));
  EXPECT_TRUE(m.clip.translations.empty());
}

TEST(SourceLayout, KeepsTranslations) {
  Clip clip = random_clip(three_joints(), 3);
  for (int i = 0; i < 9; ++i) clip.translations.emplace_back(i, 2 * i, 0.5);
  const NpzMotion m = parse_motion_npz(format_npz(to_source_layout(clip, {})));
  EXPECT_EQ(m.clip.translations, clip.translations);
  EXPECT_TRUE(m.history.empty());
}

TEST(SourceLayout, WithoutEndSites) {
  auto skeleton = three_joints();
  skeleton->end_sites.clear();
  EXPECT_TRUE(
      parse_motion_npz(format_npz(to_source_layout(random_clip(skeleton, 2), {}))).clip.skeleton->end_sites.empty());
}

TEST(SourceLayout, NumPySeesThePromisedKeysTypesAndShapes) {
  test::TemporaryFolder folder;
  const std::string path = (folder.path / "walk.npz").string();
  Clip clip = random_clip(three_joints(), 5);
  clip.frame_rate_hz = 29.97;
  write_file(path, format_npz(to_source_layout(clip, kHistory)), Overwrite::refuse);
  const int status = test::python(std::string(TEST_DATA) + "/npz/check_source.py " + path + " 5 3 2");
  if (status == -1) GTEST_SKIP() << "NumPy is not installed";
  EXPECT_EQ(status, 0);
}

TEST(AmassLayout, RoundTripWithinOneNano) {
  Clip clip = random_clip(canonical_body(), 50);
  clip.frame_rate_hz = 30000.0 / 1001;
  clip.attributes["gender"] = "male";
  const std::string bytes = format_npz(to_amass_layout(clip, kHistory));
  const NpzMotion m = parse_motion_npz(bytes);
  EXPECT_EQ(m.release, "SMPL+H");
  expect_same(clip, m.clip, 1e-9, 1e-9);
  EXPECT_EQ(m.clip.attributes, clip.attributes);
  EXPECT_EQ(m.history.size(), 1u);
  EXPECT_EQ(m.clip.skeleton, canonical_body());
}

TEST(AmassLayout, SciPyFindsTheBodyInSmplFrames) {
  test::TemporaryFolder folder;
  const std::string path = (folder.path / "pose.npz").string();
  Clip clip;
  clip.skeleton = canonical_body();
  clip.frame_rate_hz = 60;
  clip.attributes["gender"] = "female";
  clip.root_position.assign(2, Vector3(1, 2, 0.9));
  clip.rotations.assign(44, Quaternion::Identity());
  clip.rotations[22] = yaw_rotation(kPi / 2);
  // The left arm lies along +Y; turning it by -90 degrees about Z brings it to +X, forward.
  clip.rotations[static_cast<std::size_t>(22 + canonical_body()->find("left_elbow"))] = yaw_rotation(-kPi / 2);
  write_file(path, format_npz(to_amass_layout(clip, {})), Overwrite::refuse);
  const int status = test::python(std::string(TEST_DATA) + "/npz/check_amass.py " + path);
  if (status == -1) GTEST_SKIP() << "NumPy and SciPy are not installed";
  EXPECT_EQ(status, 0);
}

TEST(Amass, AgreesWithSmplKinematicsOfSciPy) {
  const std::string bytes = data("npz/amass_smplh.npz");
  const NpzMotion m = parse_motion_npz(bytes);
  const Npz expected = parse_npz(bytes, {"expected_axes", "expected_pelvis"});
  const auto& axes = std::get<std::vector<double>>(expected.at("expected_axes").data);
  const auto& pelvis = std::get<std::vector<double>>(expected.at("expected_pelvis").data);
  EXPECT_EQ(m.release, "SMPL+H");
  EXPECT_EQ(m.clip.frame_rate_hz, 120);
  EXPECT_EQ(m.clip.attributes, (Attributes{{"gender", "female"}}));
  ASSERT_EQ(m.clip.frames(), 4u);
  Pose pose;
  for (std::size_t t = 0; t < 4; ++t) {
    world_pose(m.clip, t, pose);
    EXPECT_LT((pose.positions[0] - Vector3::Map(pelvis.data() + 3 * t)).norm(), 1e-12);
    for (std::size_t j = 0; j < 22; ++j) {
      // SMPL's axes of a joint are x left, y up, z forward; here left is y, up z, forward x.
      const Vector3 left_up_forward[] = {Vector3::UnitY(), Vector3::UnitZ(), Vector3::UnitX()};
      for (std::size_t k = 0; k < 3; ++k)
        EXPECT_LT(
            (pose.rotations[j] * left_up_forward[k] - Vector3::Map(axes.data() + ((t * 22 + j) * 3 + k) * 3)).norm(),
            1e-12)
            << "frame " << t << " joint " << j;
    }
  }
}

TEST(Amass, ReadsTheOtherReleases) {
  const NpzMotion reference = parse_motion_npz(data("npz/amass_smplh.npz"));
  const NpzMotion narrow = parse_motion_npz(data("npz/amass_smplh_float32.npz"));  // deflated, float32, bytes, 1-d rate
  EXPECT_EQ(narrow.clip.frame_rate_hz, 60);
  EXPECT_EQ(narrow.clip.attributes, (Attributes{{"gender", "male"}}));
  for (std::size_t i = 0; i < narrow.clip.rotations.size(); ++i)
    EXPECT_LT(geodesic_distance(narrow.clip.rotations[i], reference.clip.rotations[i]), 1e-6);
  const NpzMotion wide =
      parse_motion_npz(data("npz/amass_smplx.npz"));  // 165 columns, pickled members beside, other rate key
  EXPECT_EQ(wide.release, "SMPL-X");
  EXPECT_EQ(wide.clip.frame_rate_hz, 30);
  EXPECT_TRUE(wide.clip.attributes.empty());
  for (std::size_t i = 0; i < wide.clip.rotations.size(); ++i)
    EXPECT_LT(geodesic_distance(wide.clip.rotations[i], reference.clip.rotations[i]), 1e-12);
}

TEST(Amass, ReadsStageiiFilesWholeOrInParts) {
  const NpzMotion reference = parse_motion_npz(data("npz/amass_smplh.npz"));
  const auto expect_like = [&](const char* file, double radians, double metres) {
    const NpzMotion m = parse_motion_npz(data(file));
    EXPECT_EQ(m.clip.rotations.size(), reference.clip.rotations.size()) << file;
    for (std::size_t i = 0; i < reference.clip.rotations.size(); ++i)
      EXPECT_LT(geodesic_distance(m.clip.rotations[i], reference.clip.rotations[i]), radians) << file;
    for (std::size_t t = 0; t < reference.clip.frames(); ++t)
      EXPECT_LT((m.clip.root_position[t] - reference.clip.root_position[t]).norm(), metres) << file;
    return m;
  };
  const NpzMotion whole = expect_like("npz/amass_stageii.npz", 1e-12, 1e-15);  // every key of a release file
  EXPECT_EQ(whole.release, "SMPL-X");
  EXPECT_EQ(whole.clip.frame_rate_hz, 60);
  EXPECT_EQ(whole.clip.attributes, (Attributes{{"gender", "male"}}));
  const NpzMotion parts = expect_like("npz/amass_parts.npz", 1e-12, 1e-15);  // no poses, 0-d bytes
  EXPECT_EQ(parts.release, "SMPL-X");
  EXPECT_EQ(parts.clip.frame_rate_hz, 120);
  EXPECT_EQ(parts.clip.attributes, (Attributes{{"gender", "female"}}));
  const NpzMotion smplh = expect_like("npz/amass_parts_smplh.npz", 1e-6, 1e-6);  // deflated, float32 throughout, no gender
  EXPECT_EQ(smplh.release, "SMPL+H");
  EXPECT_EQ(smplh.clip.frame_rate_hz, 100);
  EXPECT_TRUE(smplh.clip.attributes.empty());
}

TEST(MotionNpz, WhyThereIsNoMotion) {
  const auto why = [](const std::string& file) { return why_no_motion(std::string(TEST_DATA) + "/" + file); };
  EXPECT_EQ(why("npz/shape.npz"), "no poses: a shape file");
  EXPECT_EQ(why("npz/stagei.npz"), "no poses: a shape file");
  EXPECT_EQ(why("npz/body_model.npz"), "no poses");
  EXPECT_EQ(why("npz/no_trans.npz"), "no trans: poses without a root position");
  for (const char* motion : {"amass_smplh", "amass_smplx", "amass_stageii", "amass_parts", "no_rate", "smpl24", "nan"})
    EXPECT_EQ(why("npz/" + std::string(motion) + ".npz"), "") << motion;
  EXPECT_EQ(why("bvh/plain.bvh"), "");  // no zip: others say
  EXPECT_EQ(why("npz/absent.npz"), "");
}

TEST(MotionNpz, RefusedWithTheReason) {
  const auto message = [](const char* file) {
    const Error e = error_of([&] { parse_motion_npz(data(std::string("npz/") + file + ".npz")); });
    EXPECT_EQ(e.status(), Exit::data);
    return e.where().object + ": " + e.message();
  };
  EXPECT_EQ(message("shape"), ": no poses: a shape file, expected a motion");
  EXPECT_EQ(message("dtypes"), ": no poses, expected a motion");
  EXPECT_EQ(message("no_trans"), ": no trans: poses without a root position, expected a motion");
  EXPECT_EQ(message("no_rate"), ": no mocap_framerate or mocap_frame_rate: not a motion file");
  EXPECT_EQ(message("smpl24"), "poses: 72 columns and no joint_names, expected 156 (SMPL+H) or 165 (SMPL-X)");
  EXPECT_EQ(message("trans_short"), "trans: shape (3, 3), expected (4, 3)");
  EXPECT_EQ(message("no_frames"), "poses: 0 frames, expected at least one");
  EXPECT_EQ(message("stagei"), ": no poses: a shape file, expected a motion");
  EXPECT_EQ(message("parts_short"), "pose_body: shape (3, 63), expected (4, 63)");
  EXPECT_EQ(message("parts_wide"), "root_orient: shape (4, 4), expected (frames, 3)");
  EXPECT_EQ(message("nan"), "poses: a value that is not finite in row 2, expected finite numbers");
}

TEST(MotionNpz, DamagedSourceLayoutsAreRefused) {
  using Doubles = std::vector<double>;
  using Integers = std::vector<std::int64_t>;
  using Texts = std::vector<std::string>;
  const Npz good = to_source_layout(random_clip(three_joints(), 2), kHistory);
  const auto message = [&](const char* member, const NpyArray& value) {
    Npz bad = good;
    bad[member] = value;
    const Error e = error_of([&] { parse_motion_npz(format_npz(bad)); });
    EXPECT_EQ(e.status(), Exit::data);
    return e.where().object + ": " + e.message();
  };
  EXPECT_EQ(message("parents", {{3}, Integers{-1, 0, 7}}), "parents: joint number 7, expected -1 to 2");
  EXPECT_EQ(message("parents", {{3}, Integers{-1, 2, 1}}), "joint Rücken: parent 2, expected a joint before it");
  EXPECT_EQ(message("parents", {{3}, Doubles{-1, 0, 1}}),
            "parents: an array that is not of whole numbers, expected joint numbers");
  EXPECT_EQ(message("joint_names", {{2}, Texts{"a", "b"}}), "poses: 9 columns, expected 3 x 2 joints");
  EXPECT_EQ(message("joint_names", {{3}, Texts{"a", "b", "a"}}),
            "joint a: the name occurs twice, expected unique names");
  EXPECT_EQ(message("joint_names", {{3}, Integers{1, 2, 3}}), "joint_names: an array of numbers, expected texts");
  EXPECT_EQ(message("rest_offsets", {{9}, Doubles(9)}), "rest_offsets: shape (9,), expected (3, 3)");
  EXPECT_EQ(message("end_sites", {{2, 2}, Doubles(4)}), "end_sites: shape (2, 2), expected (any, 3)");
  EXPECT_EQ(message("end_parents", {{1}, Integers{0}}), "end_parents: shape (1,), expected (2,)");
  EXPECT_EQ(message("end_parents", {{2}, Integers{-1, 0}}), "end site: a parent or offset out of range");
  EXPECT_EQ(message("poses", {{18}, Doubles(18)}), "poses: shape (18,), expected (frames, 3 x joints)");
  EXPECT_EQ(message("poses", {{2, 9}, Doubles(18, 1e9)}),
            "poses: frame 0 turns joint 0 by more than 1e6 rad, expected an axis-angle in radians");
  EXPECT_EQ(message("mocap_framerate", {{}, Doubles{0}}),
            "mocap_framerate: shape (), value 0, expected one number above 0");
  EXPECT_EQ(message("mocap_framerate", {{2}, Doubles{1, 2}}),
            "mocap_framerate: shape (2,), value 1, expected one number above 0");
  EXPECT_EQ(message("gender", {{}, Doubles{1}}), "gender: shape () or not a text, expected one text");
  EXPECT_EQ(message("history", {{}, Texts{"nonsense"}}),
            "history line 1: is not a JSON object with tool, version and argv");
}

TEST(AmassLayout, RefusesOtherBodies) {
  EXPECT_EQ(error_of([] { to_amass_layout(random_clip(three_joints(), 1), {}); }).message(),
            "a clip of 3 joints that are not the canonical body's 22, expected the canonical body");
  Clip clip = random_clip(canonical_body(), 1);
  clip.translations.assign(22, Vector3::Zero());
  EXPECT_EQ(error_of([&] { to_amass_layout(clip, {}); }).status(), Exit::data);
}

TEST(MotionNpz, CutAnywhereIsRefused) {
  const std::string bytes = format_npz(to_source_layout(random_clip(three_joints(), 1), {}));
  for (std::size_t n = 0; n < bytes.size(); ++n)
    ASSERT_EQ(error_of([&] { parse_motion_npz(std::string_view(bytes).substr(0, n)); }).status(), Exit::data) << n;
}

}  // namespace
}  // namespace mocap::io
