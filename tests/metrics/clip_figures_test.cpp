#include "libmocap/metrics/clip_figures.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "libmocap/base/error.hpp"
#include "libmocap/metrics/motion_statistics.hpp"
#include "libmocap/skeleton/canonical_body.hpp"

namespace mocap::metrics {
namespace {

// A figure in the rest pose that slides at `speed` m/s with its soles `lift` metres above the ground, an elbow turning at `rate(t)` rad/s.
template <class Rate>
Clip sliding(double speed, double lift, std::size_t frames, Rate&& rate) {
  Clip clip;
  clip.name = "sliding";
  clip.skeleton = canonical_body();
  const auto elbow = static_cast<std::size_t>(canonical_body()->find("left_elbow"));
  double angle = 0;
  for (std::size_t t = 0; t < frames; ++t) {
    for (std::size_t j = 0; j < 22; ++j) clip.rotations.push_back(j == elbow ? exp_map(Vector3(0, 0, angle)) : Quaternion::Identity());
    clip.root_position.emplace_back(speed * static_cast<double>(t) / 30, 0, canonical_pelvis_height() + lift);
    angle += rate(t) / 30;
  }
  return clip;
}
Clip sliding(double speed, double lift, std::size_t frames, double rate = 0) {
  return sliding(speed, lift, frames, [rate](std::size_t) { return rate; });
}

TEST(ClipFigures, FeetThatSlideNearTheGroundSkate) {
  EXPECT_NEAR(clip_figures(sliding(0.3, 0, 40)).skate_mps, 0.3, 1e-9);
  EXPECT_NEAR(clip_figures(sliding(0.3, 0.034, 40)).skate_mps, 0.3, 1e-9);   // toe base at 0.059 m
  EXPECT_TRUE(std::isnan(clip_figures(sliding(0.3, 0.036, 40)).skate_mps));  // at 0.061 m
  EXPECT_EQ(clip_figures(sliding(0.3, 0, 40)).skate_gmd, 0);
  // The first and the last step have 3 of 5 steps around them, so their mean is 0.42 m/s.
  EXPECT_NEAR(clip_figures(sliding(0.7, 0, 41)).skate_gmd, 38.0 / 40, 1e-12);
  EXPECT_EQ(clip_figures(sliding(0.7, 0.03, 41)).skate_gmd, 0);  // toe base at 0.055 m: above 0.05
}

TEST(ClipFigures, ContactsSayWhichFeetShouldStand) {
  Clip clip = sliding(0.3, 0.2, 11);
  EXPECT_TRUE(std::isnan(clip_figures(clip).contact_speed_mps) && std::isnan(clip_figures(clip).contact_height_m));
  clip.contacts.assign(11, {0, 0});
  EXPECT_TRUE(std::isnan(clip_figures(clip).contact_speed_mps) && std::isnan(clip_figures(clip).contact_height_m));
  clip.contacts[4][1] = 1;  // one frame: a height, and no step
  EXPECT_TRUE(std::isnan(clip_figures(clip).contact_speed_mps));
  EXPECT_NEAR(clip_figures(clip).contact_height_m, 0.2 + 0.025, 1e-9);  // of the toe base
  for (std::size_t t = 5; t < 8; ++t) clip.contacts[t][1] = 1;
  for (std::size_t t = 6; t < 11; ++t) clip.root_position[t] = clip.root_position[5] + Vector3(0, 0, 0.1);
  EXPECT_NEAR(clip_figures(clip).contact_speed_mps, 0.3 / 3, 1e-9);  // steps from 4, 5 and 6
  EXPECT_NEAR(clip_figures(clip).contact_height_m, 0.225 + 0.1 / 2, 1e-9);
}

TEST(ClipFigures, PenetrationAndJerk) {
  EXPECT_EQ(clip_figures(sliding(0, 0, 10)).penetration_m, 0);
  // 0.1 m lower: toe bases at -0.075, ankles at -0.0337 m, of 22 joints.
  EXPECT_NEAR(clip_figures(sliding(0, -0.1, 10)).penetration_m, 2 * (0.075 + 0.1 - kAnkleSoleHeight) / 22, 1e-6);
  EXPECT_NEAR(clip_figures(sliding(0.5, 0, 20)).jerk, 0, 1e-6);
  Clip cubic = sliding(0, 0, 20);
  for (std::size_t t = 0; t < 20; ++t) cubic.root_position[t].x() = 2 * std::pow(static_cast<double>(t) / 30, 3);
  EXPECT_NEAR(clip_figures(cubic).jerk, 12, 1e-6);
  EXPECT_TRUE(std::isnan(clip_figures(sliding(0, 0, 3)).jerk));
  EXPECT_TRUE(std::isnan(clip_figures(sliding(0, 0, 1)).energy));
}

TEST(ClipFigures, EnergyOverTimeTellsDeadFromWild) {
  const auto even = clip_figures(sliding(0, 0, 61, 0.7));
  const auto energy = joint_energy(sliding(0, 0, 61, 0.7));
  EXPECT_NEAR(even.energy, energy[0], 1e-9);
  for (const double e : even.thirds) EXPECT_NEAR(e, energy[0], 1e-9);
  EXPECT_EQ(liveliness(even, even.energy), Liveliness::alive);
  const auto dies = clip_figures(sliding(0, 0, 61, [](std::size_t t) { return t < 38 ? 0.7 : 0.1; }));
  EXPECT_EQ(liveliness(dies, even.energy), Liveliness::frozen);
  const auto explodes = clip_figures(sliding(0, 0, 61, [](std::size_t t) { return t > 25 && t < 45 ? 5.0 : 0.7; }));
  EXPECT_EQ(liveliness(explodes, even.energy), Liveliness::exploding);
  EXPECT_EQ(liveliness(clip_figures(sliding(0, 0, 3)), even.energy), Liveliness::alive);
  const auto many = clip_figures({sliding(0.3, 0, 40), sliding(0.7, 0, 41)}, 2);
  EXPECT_NEAR(many[1].skate_mps, 0.7, 1e-9);
}

TEST(ClipFigures, NeedFeet) {
  Clip clip = sliding(0, 0, 5);
  auto bare = std::make_shared<Skeleton>(*canonical_body());
  bare->roles.erase("left_foot");
  clip.skeleton = bare;
  try {
    clip_figures(clip);
    FAIL();
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("clip sliding: a skeleton without the roles"), std::string::npos);
  }
}

TEST(CommonLengths, BothSetsGetTheSameDistribution) {
  const std::vector<std::size_t> generated(6, 120), real = {200, 80, 100, 160, 90, 300};
  const auto [g, r] = common_lengths(generated, real);
  auto gs = g, rs = r;
  std::sort(gs.begin(), gs.end());
  std::sort(rs.begin(), rs.end());
  EXPECT_EQ(gs, rs);
  EXPECT_EQ(r, (std::vector<std::size_t>{120, 80, 100, 120, 90, 120}));
  for (std::size_t i = 0; i < 6; ++i) EXPECT_LE(g[i], generated[i]);
  const auto [a, b] = common_lengths({10, 50}, {30, 30, 30, 30}, 20);
  EXPECT_EQ(a, (std::vector<std::size_t>{10, 20}));
  EXPECT_EQ(b, (std::vector<std::size_t>{10, 10, 20, 20}));
  EXPECT_EQ(common_lengths({7, 9}, {}).first, (std::vector<std::size_t>{7, 9}));
}

TEST(NearestTrainingClips, FindsTheCopy) {
  std::vector<Clip> training;
  for (int i = 0; i < 40; ++i) training.push_back(sliding(0.1 * i, 0, 90, [i](std::size_t t) { return 0.3 + 0.1 * i + std::sin(0.2 * static_cast<double>(t)); }));
  NeighbourOptions o;
  o.window = 30;
  o.stride = 1;
  const std::vector<Clip> samples = {cut(training[17], 12, 50), sliding(0.11, 0, 20), sliding(1.77, 0.02, 60, 0.9)};
  const auto found = nearest_training_clips(samples, training, o);
  ASSERT_EQ(found.size(), 2u);  // the second is shorter than the window
  EXPECT_EQ(found[0].training_clip, 17u);
  EXPECT_EQ(found[0].frame, 12u + 10u);
  EXPECT_NEAR(found[0].distance, 0, 1e-5);
  EXPECT_EQ(found[1].clip, 2u);
  EXPECT_GT(found[1].distance, 0.05);
  o.stride = 5;  // 22 lies between 20 and 25
  EXPECT_EQ(nearest_training_clips(samples, training, o)[0].frame, 22u);
  o.stride = 1;
  o.threads = 2;
  EXPECT_EQ(nearest_training_clips(samples, training, o)[1].distance, found[1].distance);
  o.most = 1;
  EXPECT_EQ(nearest_training_clips(samples, training, o).size(), 1u);
  EXPECT_TRUE(nearest_training_clips(samples, {}, o).empty());
  o.window = 200;
  EXPECT_TRUE(nearest_training_clips(samples, training, o).empty());
}

}  // namespace
}  // namespace mocap::metrics
