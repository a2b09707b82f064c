#include "libmodels/train/schedule.hpp"

#include <gtest/gtest.h>

namespace mocap::train {
namespace {

TEST(Ramp, CornersAndBetween) {
  const Ramp r{1, 3, 0.2, 0.6};
  EXPECT_EQ(r.at(0), 1);
  EXPECT_EQ(r.at(0.2), 1);
  EXPECT_NEAR(r.at(0.4), 2, 1e-12);
  EXPECT_EQ(r.at(0.6), 3);
  EXPECT_EQ(r.at(1), 3);
  EXPECT_EQ((Ramp{3, 1, 0, 1}.at(0.25)), 2.5);
}

TEST(Ramp, AnEmptyIntervalIsAStep) {
  const Ramp r{0, 1, 0.5, 0.5};
  EXPECT_EQ(r.at(0.5), 0);
  EXPECT_EQ(r.at(0.5001), 1);
  EXPECT_EQ((Ramp{0, 1, 0, 0}.at(1e-9)), 1);
  EXPECT_EQ((Ramp{0, 1, 1, 1}.at(0.999)), 0);
}

TEST(LearningRate, WarmUpPlateauDecay) {
  const LearningRate l{0.01, 0.5, 0.1, 10};
  EXPECT_NEAR(l.at(0, 1000), 0.001, 1e-15);
  EXPECT_NEAR(l.at(4, 1000), 0.005, 1e-15);
  EXPECT_EQ(l.at(9, 1000), 0.01);
  EXPECT_EQ(l.at(500, 1000), 0.01);
  EXPECT_NEAR(l.at(750, 1000), 0.01 * std::sqrt(0.1), 1e-15);
  EXPECT_NEAR(l.at(1000, 1000), 0.001, 1e-15);
  for (int step = 501; step < 1000; ++step) ASSERT_LT(l.at(step, 1000), l.at(step - 1, 1000));
}

TEST(LearningRate, Corners) {
  EXPECT_EQ((LearningRate{0.01, 1, 0.1, 0}.at(999, 1000)), 0.01);
  EXPECT_NEAR((LearningRate{0.01, 0, 0.1, 0}.at(500, 1000)), 0.01 * std::sqrt(0.1), 1e-15);
  EXPECT_EQ((LearningRate{0.01, 0, 1, 0}.at(500, 1000)), 0.01);
  EXPECT_EQ((LearningRate{0.01, 0.5, 0.1, 30}.at(0, 1)), 0.01 / 30);
}

TEST(Schedule, JsonRoundTrip) {
  const nlohmann::json j = {{"ramp", Ramp{0.125, 2, 0.1, 0.7}}, {"rate", LearningRate{0.002, 0.3, 0.01, 7}}};
  const auto back = nlohmann::json::parse(j.dump());
  const auto ramp = back.at("ramp").get<Ramp>();
  const auto rate = back.at("rate").get<LearningRate>();
  for (const double p : {0.0, 0.3, 0.9}) EXPECT_EQ(ramp.at(p), (Ramp{0.125, 2, 0.1, 0.7}.at(p)));
  for (const int s : {0, 6, 90}) EXPECT_EQ(rate.at(s, 100), (LearningRate{0.002, 0.3, 0.01, 7}.at(s, 100)));
}

}  // namespace
}  // namespace mocap::train
