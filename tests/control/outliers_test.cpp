#include "libmodels/control/outliers.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/control/control_support.hpp"

namespace mocap::control {
namespace {

// Groups that swing, of which one stands still, with white noise.
Values swinging(Eigen::Index frames, double noise, std::uint64_t seed = 1) {
  const auto body = canonical_body();
  Values v(frames, 3 * (body->joint_count() + 1));
  Random random(seed, 0);
  for (Eigen::Index t = 0; t < frames; ++t)
    for (Eigen::Index c = 0; c < v.cols(); ++c) v(t, c) = (c / 3 == 9 ? 0.2 : 0.5 * std::sin(0.15 * static_cast<double>(t) + 0.7 * static_cast<double>(c / 3))) + noise * random.normal();
  return v;
}

std::int64_t marked(const Suspects& s) { return s.marks.cast<std::int64_t>().sum(); }

TEST(Outliers, StatesOfValuesAreTheStatesOfTheClip) {
  const Clip clip = gentle_motions(1, 3, 30)[0];
  const auto states = features::encode_state(clip);
  EXPECT_LT((states_of(measured_values(clip, states)) - states).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(Outliers, NoiseIsSeenForWhatItIs) {
  for (const double noise : {0.002, 0.01, 0.05})
    for (const double found : noise_deviations(swinging(400, noise))) EXPECT_NEAR(found, noise, 0.15 * noise);
}

TEST(Outliers, NothingIsSuspectedInSmoothMotion) {
  const Values v = swinging(200, 0);
  EXPECT_EQ(marked(find_suspects(v, noise_deviations(v), 0.005, 0.01, 4, *canonical_body())), 0);
}

TEST(Outliers, SpikesOfOneToFourFrames) {
  for (Eigen::Index length = 1; length <= 4; ++length)
    for (const Eigen::Index first : {Eigen::Index{0}, Eigen::Index{50}, 100 - length}) {
      if (length > 1 && first != 50) continue;  // at an end a longer one may as well be what the motion does
      Values v = swinging(100, 0.004);
      v.block(first, 3 * 7, length, 3).rowwise() += Eigen::RowVector3d(0.3, -0.3, 0.2);
      const Suspects s = find_suspects(v, noise_deviations(v), 0.005, 0.01, 4, *canonical_body());
      EXPECT_TRUE((s.marks.col(7).segment(first, length) == 1).all()) << length << " " << first;
    }
}

TEST(Outliers, ASpikeNearAnEndIsNotTheFramesBeyondIt) {
  for (const Eigen::Index at : {2, 3, 4, 5, 95, 97}) {
    Values v = swinging(100, 0.002);
    v.row(at).segment<3>(0) += Eigen::RowVector3d(0.2, 0.1, -0.2);
    const Suspects s = find_suspects(v, noise_deviations(v), 0.005, 0.01, 4, *canonical_body());
    EXPECT_EQ(s.marks(at, 0), 1) << at;
    EXPECT_EQ(s.marks.col(0).cast<int>().sum(), 1) << at;
  }
}

TEST(Outliers, WhatHappensInEveryStrideIsNoSpike) {
  Values v = swinging(200, 0.002);
  for (Eigen::Index t = 7; t < 200; t += 22) v.row(t).segment<3>(3 * 5) += Eigen::RowVector3d(0.1, 0, 0.1);
  v.row(120).segment<3>(3 * 5) += Eigen::RowVector3d(0.5, 0.2, 0);
  const Suspects s = find_suspects(v, noise_deviations(v), 0.005, 0.01, 4, *canonical_body());
  EXPECT_EQ(s.marks(120, 5), 1);
  EXPECT_EQ(s.marks.col(5).cast<int>().sum(), 1);
}

TEST(Outliers, HeldValuesExactAndUnderNoise) {
  const auto body = canonical_body();
  for (const double noise : {0.0, 0.004})
    for (const bool after : {false, true}) {  // noise on what is held as well
      Values v = swinging(120, noise);
      Random random(9, 0);
      for (Eigen::Index t = 41; t <= 47; ++t)
        for (Eigen::Index c = 3 * 6; c < 3 * 7; ++c) v(t, c) = v(40, c) + (after ? noise * random.normal() : 0);
      const Suspects s = find_suspects(v, noise_deviations(v), 0.005, 0.01, 4, *body);
      EXPECT_TRUE((s.marks.col(6).segment(42, 5) == 1).all()) << noise << after;
      bool held = false;
      for (const auto& r : s.held) held = held || (r.group == 6 && r.first <= 42 && r.last == 47);
      EXPECT_TRUE(held);
      // What hangs below it as well.
      for (int j = 0; j < body->joint_count(); ++j)
        if (body->parents[static_cast<std::size_t>(j)] == 5) {
          EXPECT_EQ(s.marks(45, j + 1), 1);
        }
    }
}

TEST(Outliers, MarkedValuesAreBridged) {
  Values v = swinging(60, 0);
  const Values clean = v;
  Marks marks = Marks::Zero(60, v.cols() / 3);
  for (const Eigen::Index t : {0, 30, 31, 59}) {
    v.row(t).segment<3>(6).setConstant(40);
    marks(t, 2) = 1;
  }
  EXPECT_LT((bridged(v, marks) - clean).cwiseAbs().maxCoeff(), 0.12);
  EXPECT_LT((bridged(clean, Marks::Zero(60, v.cols() / 3)) - clean).cwiseAbs().maxCoeff(), 0.01);
}

TEST(Outliers, RunsBelowADropoutArePartOfIt) {
  const auto body = canonical_body();
  const auto joints = static_cast<std::size_t>(body->joint_count());
  std::size_t child = 1;
  while (body->parents[child] <= 0) ++child;
  const int parent = body->parents[child];
  Marks marks = Marks::Zero(30, static_cast<Eigen::Index>(joints) + 1);
  marks.col(parent + 1).segment(10, 6) = 1;
  marks.col(static_cast<Eigen::Index>(child) + 1).segment(11, 3) = 1;
  marks(20, static_cast<Eigen::Index>(child) + 1) = 1;
  marks(29, 0) = 1;
  Eigen::ArrayXXd off = Eigen::ArrayXXd::Zero(30, static_cast<Eigen::Index>(joints) + 1);
  off(12, parent + 1) = 0.5;
  off(29, 0) = 0.1;
  const std::vector<HeldRun> held = {{parent + 1, 10, 15}, {static_cast<int>(child) + 1, 10, 15}};
  const auto all = list_outliers(marks, held, off, *body);
  ASSERT_EQ(all.size(), 3u);
  EXPECT_EQ(all[0].joint, parent);
  EXPECT_TRUE(all[0].dropout);
  EXPECT_EQ(all[0].last, 15);
  EXPECT_EQ(all[0].largest, 0.5);
  EXPECT_EQ(all[1].joint, static_cast<int>(child));
  EXPECT_FALSE(all[1].dropout);
  EXPECT_EQ(all[1].first, 20);
  EXPECT_EQ(all[2].joint, -1);
  EXPECT_EQ(all[2].first, 29);
  EXPECT_EQ(all[2].last, 29);
}

}  // namespace
}  // namespace mocap::control
