#include "libmodels/train/schedule.hpp"

#include <algorithm>
#include <cmath>

namespace mocap::train {

double Ramp::at(double progress) const {
  if (progress <= begin) return from;
  if (progress >= end) return to;
  return from + (to - from) * (progress - begin) / (end - begin);
}

double LearningRate::at(std::int64_t step, std::int64_t steps) const {
  const double progress = steps > 0 ? static_cast<double>(step) / static_cast<double>(steps) : 0;
  const double rise = warm_up > 0 ? std::min(1.0, static_cast<double>(step + 1) / warm_up) : 1.0;
  const double fall = progress <= decay_begin ? 1.0 : std::pow(final_factor, (progress - decay_begin) / (1 - decay_begin));
  return rate * rise * fall;
}

}  // namespace mocap::train
