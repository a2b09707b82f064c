#include "libmocap/features/motion_cell.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "libmocap/base/error.hpp"
#include "libmocap/features/state.hpp"
#include "tests/features/smooth_clip.hpp"

namespace mocap::features {
namespace {

class Representations : public testing::TestWithParam<RotationRepresentation> {};

TEST_P(Representations, DecodeInvertsEncode) {
  const Clip clip = smooth_clip(200, 3);
  const FeatureMatrix x = encode_motion_cell(clip, GetParam());
  EXPECT_EQ(x.cols(), 21 * static_cast<int>(GetParam()) + 6);
  const Clip back = decode_motion_cell(x, clip.skeleton, clip.frame_rate_hz, GetParam(), placement_of(clip));
  for (std::size_t i = 0; i < clip.rotations.size(); ++i) ASSERT_LT(geodesic_distance(clip.rotations[i], back.rotations[i]), 1e-9) << i;
  for (std::size_t t = 0; t < clip.frames(); ++t) ASSERT_LT((clip.root_position[t] - back.root_position[t]).norm(), 1e-9) << t;
}

TEST_P(Representations, FeaturesDoNotSeePlaceAndHeading) {
  const Clip clip = smooth_clip(50, 4);
  Clip moved = clip;
  const Quaternion turn = yaw_rotation(1.9);
  for (std::size_t t = 0; t < clip.frames(); ++t) {
    moved.root_position[t] = turn * clip.root_position[t] + Vector3(7, -3, 0);
    moved.rotations[t * 22] = turn * clip.rotations[t * 22];
  }
  EXPECT_LT((encode_motion_cell(clip, GetParam()) - encode_motion_cell(moved, GetParam())).cwiseAbs().maxCoeff(), 1e-9);
}

TEST_P(Representations, OtherJointCounts) {
  auto s = std::make_shared<Skeleton>();
  s->joint_names = {"a", "b", "c"};
  s->parents = {-1, 0, 1};
  s->rest_offsets = {Vector3::Zero(), Vector3::UnitZ(), Vector3::UnitZ()};
  const Clip clip = smooth_clip(10, 5, s);
  const FeatureMatrix x = encode_motion_cell(clip, GetParam());
  ASSERT_EQ(x.cols(), 2 * static_cast<int>(GetParam()) + 6);
  const Clip back = decode_motion_cell(x, s, 30, GetParam(), placement_of(clip));
  for (std::size_t i = 0; i < clip.rotations.size(); ++i) EXPECT_LT(geodesic_distance(clip.rotations[i], back.rotations[i]), 1e-9);
}

INSTANTIATE_TEST_SUITE_P(All, Representations,
                         testing::Values(RotationRepresentation::axis_angle, RotationRepresentation::quaternion, RotationRepresentation::rotation_matrix));

TEST(MotionCellFeatures, RootColumnsMeanWhatTheySay) {
  Clip clip;
  clip.skeleton = canonical_body();
  clip.frame_rate_hz = 10;
  for (int t = 0; t < 5; ++t) {
    // Facing +Y, walking forward at 2 m/s and drifting left (towards -X) at 1 m/s, turning left at 0.3 rad a frame.
    for (int j = 0; j < 22; ++j) clip.rotations.push_back(j == 0 ? yaw_rotation(M_PI / 2) : Quaternion::Identity());
    clip.root_position.emplace_back(-0.1 * t, 0.2 * t, 0.95);
  }
  FeatureMatrix x = encode_motion_cell(clip, RotationRepresentation::quaternion);
  EXPECT_NEAR(x(0, 84), 2, 1e-12);
  EXPECT_NEAR(x(0, 85), 1, 1e-12);
  EXPECT_NEAR(x(0, 86), 0.95, 1e-12);
  EXPECT_NEAR(x(4, 84), 2, 1e-12);
  for (std::size_t t = 0; t < 5; ++t) clip.rotations[t * 22] = yaw_rotation(3 + 0.3 * static_cast<double>(t)) * exp_map(Vector3(0.1, 0.2, 0));
  x = encode_motion_cell(clip, RotationRepresentation::quaternion);
  EXPECT_NEAR(x(1, 87), 3, 1e-9);
  EXPECT_NEAR(x(2, 88), 0.1, 1e-9);
  EXPECT_NEAR(x(2, 89), 0.2, 1e-9);
}

TEST(MotionCellFeatures, QuaternionsLieOnOneSideWhateverTheSignsStored) {
  Clip clip = smooth_clip(40, 6);
  const FeatureMatrix a = encode_motion_cell(clip, RotationRepresentation::quaternion);
  for (std::size_t i = 0; i < clip.rotations.size(); i += 3) clip.rotations[i].coeffs() *= -1;
  EXPECT_LT((a - encode_motion_cell(clip, RotationRepresentation::quaternion)).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(MotionCellFeatures, NetworkOutputNeedNotBeValid) {
  FeatureMatrix x = FeatureMatrix::Zero(3, 21 * 4 + 6);
  x.row(1).setConstant(0.3);
  const Clip clip = decode_motion_cell(x, canonical_body(), 30, RotationRepresentation::quaternion);
  EXPECT_NO_THROW(clip.validate());
}

TEST(MotionCellFeatures, StatisticsMatchADirectComputation) {
  const FeatureMatrix a = encode_motion_cell(smooth_clip(60, 7), RotationRepresentation::quaternion), b = encode_motion_cell(smooth_clip(40, 8), RotationRepresentation::quaternion);
  FeatureStatistics statistics({21, RotationRepresentation::quaternion});
  statistics.add(a);
  statistics.add(b);
  FeatureMatrix all(100, a.cols());
  all << a, b;
  const Eigen::RowVectorXd mean = all.colwise().mean();
  const Eigen::RowVectorXd sd = ((all.rowwise() - mean).array().square().colwise().mean()).sqrt();
  for (Eigen::Index c = 0; c < all.cols(); ++c) EXPECT_NEAR(statistics.mean()[static_cast<std::size_t>(c)], mean[c], 1e-6);
  EXPECT_NEAR(statistics.deviation()[84], sd[84], 1e-5);
  EXPECT_NEAR(statistics.deviation()[5], std::max(sd.segment(4, 4).maxCoeff(), 0.02), 1e-6);
  EXPECT_EQ(statistics.deviation()[4], statistics.deviation()[7]);
}

TEST(MotionCellFeatures, RefusesWhatItCannotEncode) {
  Clip clip = smooth_clip(3, 1);
  clip.translations.assign(clip.rotations.size(), Vector3::Zero());
  EXPECT_THROW(encode_motion_cell(clip, RotationRepresentation::quaternion), Error);
  EXPECT_THROW(parse_representation("euler"), Error);
  EXPECT_THROW(decode_motion_cell(FeatureMatrix::Zero(2, 5), canonical_body(), 30, RotationRepresentation::quaternion), Error);
}

}  // namespace
}  // namespace mocap::features
