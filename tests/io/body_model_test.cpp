#include "libmocap/io/body_model.hpp"

#include <limits>

#include "libmocap/io/npz.hpp"
#include "libmocap/skeleton/canonical_body.hpp"
#include "tests/io/io_test_support.hpp"

namespace mocap::io {
namespace {

using test::data;
using test::error_of;
using Doubles = std::vector<double>;
using Integers = std::vector<std::int64_t>;

const std::string kFile = std::string(TEST_DATA) + "/npz/body_model.npz";

Doubles expected(const char* name) { return std::get<Doubles>(parse_npz(data("npz/body_model.npz"), {name}).at(name).data); }
Doubles betas() { return std::get<Doubles>(parse_npz(data("npz/amass_shaped.npz"), {"betas"}).at("betas").data); }

TEST(BodyModel, JointsOfAShapeAgreeWithNumPy) {
  const auto model = BodyModel::read(kFile);
  EXPECT_EQ(model->shapes(), 5u);
  EXPECT_EQ(model->sha256().size(), 64u);
  const auto joints = model->joints(betas());  // the first five of sixteen count
  const Doubles want = expected("expected_joints");
  for (std::size_t j = 0; j < BodyModel::kJoints; ++j) EXPECT_LT((joints[j] - Vector3::Map(want.data() + 3 * j)).norm(), 1e-12) << j;
  // Fewer betas than shapes: the others are 0. float32 without shapes: the template.
  const auto plain = BodyModel::parse(data("npz/body_model_plain.npz"));
  EXPECT_EQ(plain.shapes(), 0u);
  for (std::size_t j = 0; j < BodyModel::kJoints; ++j) EXPECT_LT((plain.joints(betas())[j] - model->joints({})[j]).norm(), 1e-6) << j;
  EXPECT_GT((joints[15] - model->joints({})[15]).norm(), 1e-3);
}

TEST(BodyModel, AmassClipsStandOnTheirOwnBones) {
  const auto model = BodyModel::read(kFile);
  const NpzMotion m = parse_motion_npz(data("npz/amass_shaped.npz"), model.get());
  EXPECT_EQ(m.clip.skeleton->joint_names, canonical_body()->joint_names);
  EXPECT_FALSE(m.clip.skeleton->same_as(*canonical_body(), 1e-3));
  const Doubles want = expected("expected_positions");
  ASSERT_EQ(want.size(), m.clip.frames() * 22 * 3);
  Pose pose;
  for (std::size_t t = 0; t < m.clip.frames(); ++t) {
    world_pose(m.clip, t, pose);
    for (std::size_t j = 0; j < 22; ++j) EXPECT_LT((pose.positions[j] - Vector3::Map(want.data() + (t * 22 + j) * 3)).norm(), 1e-12) << t << " " << j;
  }
  EXPECT_EQ(parse_motion_npz(data("npz/amass_shaped.npz")).clip.skeleton, canonical_body());
  // A file without betas gets the template; the release that keeps them as a row its own.
  EXPECT_TRUE(parse_motion_npz(data("npz/amass_parts_smplh.npz"), model.get()).clip.skeleton->same_as(*skeleton_of(model->joints({})), 1e-12));
  EXPECT_FALSE(parse_motion_npz(data("npz/amass_stageii.npz"), model.get()).clip.skeleton->same_as(*skeleton_of(model->joints({})), 1e-4));
}

TEST(BodyModel, RefusedWithTheMember) {
  EXPECT_EQ(std::string(error_of([] { BodyModel::read(std::string(TEST_DATA) + "/npz/shape.npz"); }).what()),
            std::string(TEST_DATA) + "/npz/shape.npz: no J_regressor, expected a body model with J_regressor, v_template and kintree_table");
  EXPECT_NE(std::string(error_of([] { BodyModel::parse(data("npz/body_model_sparse.npz")); }).what()).find("J_regressor: "), std::string::npos);
  EXPECT_EQ(error_of([] { BodyModel::read("absent.npz"); }).where().file, "absent.npz");
  const Npz good = parse_npz(data("npz/body_model.npz"), {"J_regressor", "v_template", "shapedirs", "kintree_table"});
  EXPECT_NO_THROW(BodyModel::parse(format_npz(good)));
  const auto message = [&](const char* member, const std::function<void(NpyArray&)>& change) {
    Npz bad = good;
    change(bad.at(member));
    const Error e = error_of([&] { BodyModel::parse(format_npz(bad)); });
    EXPECT_EQ(e.status(), Exit::data);
    EXPECT_EQ(e.where().object, member);
    return e.message();
  };
  EXPECT_EQ(message("J_regressor", [](NpyArray& a) { a = {{2, 60}, Doubles(120)}; }), "shape (2, 60), expected (joints, vertices) with at least 22 joints");
  EXPECT_EQ(message("J_regressor", [](NpyArray& a) { a = {{24, 60}, Integers(1440)}; }), "an array that is not of floats, expected metres and weights");
  EXPECT_EQ(message("v_template", [](NpyArray& a) { a = {{59, 3}, Doubles(177)}; }), "shape (59, 3), expected (60, 3)");
  EXPECT_EQ(message("v_template", [](NpyArray& a) { std::get<Doubles>(a.data)[7] = std::numeric_limits<double>::quiet_NaN(); }), "a value that is not finite, expected finite numbers");
  EXPECT_EQ(message("kintree_table", [](NpyArray& a) { a = {{2, 23}, Integers(46)}; }), "shape (2, 23), expected (2, 24)");
  EXPECT_EQ(message("kintree_table", [](NpyArray& a) { a = {{2, 24}, Doubles(48)}; }), "an array that is not of whole numbers, expected joint numbers");
  EXPECT_EQ(message("kintree_table", [](NpyArray& a) { std::get<Integers>(a.data)[5] = 1; }), "joint 5 has the parent 1, expected 2 as in SMPL's body");
  EXPECT_EQ(message("shapedirs", [](NpyArray& a) { a = {{60, 15}, Doubles(900)}; }), "shape (60, 15), expected (60, 3, shapes) with at most 400 shapes");
  EXPECT_EQ(message("shapedirs", [](NpyArray& a) { a = {{60, 3, 401}, Doubles(60 * 3 * 401)}; }), "shape (60, 3, 401), expected (60, 3, shapes) with at most 400 shapes");
}

}  // namespace
}  // namespace mocap::io
