#include "libmodels/train/reference.hpp"

#include <fmt/core.h>

#include <cmath>

namespace mocap::train {

void check_alike(const Skeleton& skeleton, double frame_rate_hz, const Reference& reference, const Where& where, const std::string& of) {
  if (!skeleton.same_as(*reference.skeleton, 1e-5)) refuse(where, "another skeleton than " + of + "'s");
  if (std::abs(frame_rate_hz - reference.frame_rate_hz) > 1e-6 * reference.frame_rate_hz) refuse(where, fmt::format("{} Hz, expected {}'s {} Hz", frame_rate_hz, of, reference.frame_rate_hz));
}

}  // namespace mocap::train
