#include "libmocap/features/state.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "libmocap/base/error.hpp"
#include "tests/features/smooth_clip.hpp"

namespace mocap::features {
namespace {

void expect_same_motion(const Clip& a, const Clip& b, double tolerance) {
  ASSERT_EQ(a.frames(), b.frames());
  for (std::size_t i = 0; i < a.rotations.size(); ++i) ASSERT_LT(geodesic_distance(a.rotations[i], b.rotations[i]), tolerance) << i;
  for (std::size_t t = 0; t < a.frames(); ++t) ASSERT_LT((a.root_position[t] - b.root_position[t]).norm(), tolerance) << t;
}

Clip joined(Clip a, const Clip& b) {
  a.rotations.insert(a.rotations.end(), b.rotations.begin(), b.rotations.end());
  a.root_position.insert(a.root_position.end(), b.root_position.begin(), b.root_position.end());
  return a;
}

TEST(State, DecodeInvertsEncode) {
  const Clip clip = smooth_clip(200, 3);
  const FeatureMatrix x = encode_state(clip);
  ASSERT_EQ(x.cols(), 69);
  expect_same_motion(clip, decode_state(x, clip.skeleton, clip.frame_rate_hz, placement_of(clip)), 1e-9);
}

TEST(State, StepsAreSeenFromTheFrameBefore) {
  // A quarter circle to the left: every step is the same, forwards and a little to the left, whatever the heading.
  Clip clip = smooth_clip(31, 4);
  for (std::size_t t = 0; t < 31; ++t) {
    const double a = std::numbers::pi / 60 * static_cast<double>(t);
    clip.rotations[t * 22] = yaw_rotation(a + 1);
    clip.root_position[t] = yaw_rotation(1) * Vector3(2 * std::sin(a), 2 * (1 - std::cos(a)), 0.9);
  }
  const FeatureMatrix x = encode_state(clip);
  const double step = std::numbers::pi / 60;
  for (Eigen::Index t = 0; t < 31; ++t) {
    EXPECT_NEAR(x(t, 0), 2 * std::sin(step), 1e-12);
    EXPECT_NEAR(x(t, 1), 2 * (1 - std::cos(step)), 1e-12);
    EXPECT_NEAR(x(t, 2), step, 1e-12);
    EXPECT_NEAR(x(t, 3), 0.9, 1e-12);
  }
}

TEST(State, DoesNotSeePlaceAndHeading) {
  const Clip clip = smooth_clip(50, 4);
  Clip moved = clip;
  const Quaternion turn = yaw_rotation(1.9);
  for (std::size_t t = 0; t < clip.frames(); ++t) {
    moved.root_position[t] = turn * clip.root_position[t] + Vector3(7, -3, 0);
    moved.rotations[t * 22] = turn * clip.rotations[t * 22];
  }
  EXPECT_LT((encode_state(clip) - encode_state(moved)).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(State, SignsOfQuaternionsDoNotMatter) {
  const Clip clip = smooth_clip(80, 5);
  Clip flipped = clip;
  for (std::size_t i = 0; i < flipped.rotations.size(); i += 3) flipped.rotations[i].coeffs() *= -1;
  EXPECT_LT((encode_state(clip) - encode_state(flipped)).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(State, AnglesPassAHalfTurnWithoutAJump) {
  Clip clip = smooth_clip(60, 6);
  for (std::size_t t = 0; t < 60; ++t) clip.rotations[t * 22 + 5] = exp_map(Vector3(0, 0.08 * static_cast<double>(t), 0));  // to 4.7 rad
  const FeatureMatrix x = encode_state(clip);
  for (Eigen::Index t = 0; t < 60; ++t) EXPECT_NEAR(x(t, 6 + 3 * 4 + 1), 0.08 * static_cast<double>(t), 1e-9);
}

TEST(State, PiecesGiveWhatTheWholeGives) {
  const Clip clip = smooth_clip(97, 7);
  const FeatureMatrix whole = encode_state(clip);
  StateEncoder encode;
  StateDecoder decode(clip.skeleton, clip.frame_rate_hz, placement_of(clip));
  Clip back;
  Eigen::Index row = 0;
  for (const auto& [first, count] : {std::pair<std::size_t, std::size_t>{0, 2}, {2, 1}, {3, 50}, {53, 44}}) {
    const FeatureMatrix piece = encode(cut(clip, first, count));
    EXPECT_EQ(piece, whole.middleRows(row, piece.rows()));
    row += piece.rows();
    const Clip part = decode(piece);
    back = first == 0 ? part : joined(back, part);
  }
  expect_same_motion(clip, back, 1e-9);
  const Clip at_once = decode_state(whole, clip.skeleton, clip.frame_rate_hz, placement_of(clip));
  for (std::size_t i = 0; i < back.rotations.size(); ++i) ASSERT_EQ(back.rotations[i].coeffs(), at_once.rotations[i].coeffs());
}

TEST(State, OneFrame) {
  const Clip clip = smooth_clip(1, 8);
  const FeatureMatrix x = encode_state(clip);
  EXPECT_EQ(x.row(0).head<3>().norm(), 0);
  expect_same_motion(clip, decode_state(x, clip.skeleton, clip.frame_rate_hz, placement_of(clip)), 1e-9);
}

TEST(State, RefusesWhatItCannotHold) {
  Clip clip = smooth_clip(3, 1);
  clip.translations.resize(clip.rotations.size(), Vector3::Zero());
  EXPECT_THROW(encode_state(clip), Error);
  EXPECT_THROW(encode_state(smooth_clip(0, 1)), Error);
  EXPECT_THROW(decode_state(FeatureMatrix::Zero(3, 68), canonical_body(), 30), Error);
}

}  // namespace
}  // namespace mocap::features
