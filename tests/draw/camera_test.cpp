#include "libmocap/draw/camera.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "libmocap/base/error.hpp"
#include "libmocap/skeleton/canonical_body.hpp"

namespace mocap::draw {
namespace {

// Stands still, turned by `yaw`.
Clip standing(double yaw, int frames = 3) {
  Clip c;
  c.name = "still";
  c.skeleton = canonical_body();
  for (int t = 0; t < frames; ++t) {
    c.root_position.emplace_back(0, 0, canonical_pelvis_height());
    c.rotations.resize(c.rotations.size() + 22, Quaternion::Identity());
    c.rotations[c.rotations.size() - 22] = yaw_rotation(yaw);
  }
  return c;
}

TEST(View, ParsesItsNames) {
  for (const View v : {View::side, View::front, View::top, View::oblique}) EXPECT_EQ(parse_view(text(v)), v);
  EXPECT_THROW(parse_view("back"), Error);
}

TEST(Camera, IsRightHandedForEveryView) {
  for (const View v : {View::side, View::front, View::top, View::oblique})
    for (const double yaw : {0.0, 1.0, -2.0}) {
      const Camera c = camera_for(v, {std::cos(yaw), std::sin(yaw), 0});
      EXPECT_LT((c.right.cross(c.up) - c.toward).norm(), 1e-15);
      EXPECT_NEAR(c.right.norm(), 1, 1e-15);
      EXPECT_NEAR(c.up.norm(), 1, 1e-15);
      EXPECT_NEAR(c.right.dot(c.up), 0, 1e-15);
    }
}

TEST(Camera, ShowsTheSideTheWordSays) {
  const Vector3 forward = Vector3::UnitX(), left = Vector3::UnitY(), up = Vector3::UnitZ();
  const Camera side = camera_for(View::side, forward);
  EXPECT_LT((side.project(forward) - Vector2(1, 0)).norm(), 1e-15);
  EXPECT_LT((side.project(up) - Vector2(0, 1)).norm(), 1e-15);
  EXPECT_LT(side.nearness(left), -0.99);  // the right side is nearer
  const Camera front = camera_for(View::front, forward);
  EXPECT_GT(front.nearness(forward), 0.99);
  EXPECT_LT((front.project(left) - Vector2(1, 0)).norm(), 1e-15);
  const Camera top = camera_for(View::top, forward);
  EXPECT_GT(top.nearness(up), 0.99);
  EXPECT_LT((top.project(forward) - Vector2(1, 0)).norm(), 1e-15);
  EXPECT_LT((top.project(left) - Vector2(0, 1)).norm(), 1e-15);
  const Camera oblique = camera_for(View::oblique, forward);
  EXPECT_GT(oblique.project(up).y(), 0.9);
  EXPECT_GT(oblique.project(forward).x(), 0.5);
  EXPECT_GT(oblique.nearness(forward), 0.5);
  EXPECT_GT(oblique.nearness(up), 0.3);
  EXPECT_LT(oblique.nearness(left), -0.5);
}

TEST(MeanFacing, IsTheFiguresOwn) {
  for (const double yaw : {0.0, 1.0, 3.0, -2.0}) EXPECT_LT((mean_facing(standing(yaw)) - Vector3(std::cos(yaw), std::sin(yaw), 0)).norm(), 1e-12);
}

TEST(MeanFacing, OfAFullTurnIsTheFirst) {
  Clip c = standing(0.5, 100);
  for (int t = 0; t < 100; ++t) c.rotations[static_cast<std::size_t>(t) * 22] = yaw_rotation(0.5 + 2 * std::numbers::pi * t / 100);
  EXPECT_LT((mean_facing(c) - Vector3(std::cos(0.5), std::sin(0.5), 0)).norm(), 1e-12);
}

TEST(MeanFacing, WithoutLimbsFollowsTheWayOrX) {
  auto s = std::make_shared<Skeleton>();
  s->joint_names = {"point"};
  s->parents = {-1};
  s->rest_offsets = {{0, 0, 0}};
  Clip c;
  c.skeleton = s;
  c.root_position = {{0, 0, 1}, {0, -3, 5}};
  c.rotations.assign(2, Quaternion::Identity());
  EXPECT_LT((mean_facing(c) + Vector3::UnitY()).norm(), 1e-12);
  c.root_position[1] = {0.01, 0.01, 9};
  EXPECT_EQ(mean_facing(c), Vector3::UnitX());
}

}  // namespace
}  // namespace mocap::draw
