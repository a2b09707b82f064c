#include "libmocap/metrics/position_error.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "libmocap/base/error.hpp"
#include "tests/store/sample_clips.hpp"

namespace mocap::metrics {
namespace {

TEST(PositionError, SeesWhereTheRootIsAndWhatThePoseIs) {
  const Clip truth = testing::sample_clip("a", 12, 3);
  Clip moved = truth, turned = truth, raised = truth;
  for (std::size_t t = 0; t < 12; ++t) {
    moved.root_position[t] += Vector3(0.03, 0.04, 0);
    turned.root_position[t] = yaw_rotation(1) * truth.root_position[t];
    turned.frame(t)[0] = yaw_rotation(1) * truth.frame(t)[0];
    raised.root_position[t] += Vector3(0, 0, 0.02);
  }
  EXPECT_EQ(position_error(truth, truth).world_mm, 0);
  EXPECT_NEAR(position_error(moved, truth).world_mm, 50, 1e-9);
  EXPECT_NEAR(position_error(moved, truth).pose_mm, 0, 1e-9);
  EXPECT_GT(position_error(turned, truth).world_mm, 50);
  EXPECT_NEAR(position_error(turned, truth).pose_mm, 0, 1e-6);
  EXPECT_NEAR(position_error(raised, truth).world_mm, 20, 1e-9);
  EXPECT_NEAR(position_error(raised, truth).pose_mm, 20, 1e-9);
  EXPECT_THROW((void)position_error(cut(truth, 0, 5), truth), Error);
}

}  // namespace
}  // namespace mocap::metrics
