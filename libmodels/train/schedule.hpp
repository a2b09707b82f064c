// Coefficients that change over a training, as functions of progress p in [0, 1] (step / steps). Stored in /config.
#pragma once
#include <cstdint>
#include <nlohmann/json.hpp>

namespace mocap::train {

// Linear from `from` to `to` between progress `begin` and `end`, constant outside.
struct Ramp {
  double from = 0, to = 1, begin = 0, end = 1;
  double at(double progress) const;
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Ramp, from, to, begin, end)

// `warm_up` steps of linear rise, then `rate` until progress `decay_begin`, then exponential down to rate * final_factor.
struct LearningRate {
  double rate = 1e-3, decay_begin = 0.5, final_factor = 0.1;
  int warm_up = 30;
  double at(std::int64_t step, std::int64_t steps) const;
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(LearningRate, rate, decay_begin, final_factor, warm_up)

// Length of the training windows from a progress on; a list of them, ascending from 0, is a curriculum.
struct WindowStage {
  double begin = 0;
  std::int64_t frames = 120;
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(WindowStage, begin, frames)

}  // namespace mocap::train
