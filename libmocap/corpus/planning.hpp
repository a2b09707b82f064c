// What every kind of motion of the corpus needs on the way from plans to clips.
#pragma once
#include <vector>

#include "libmocap/clip/clip.hpp"
#include "libmocap/corpus/body_state.hpp"

namespace mocap::corpus {

// A smooth curve that is nowhere below `values` (>= 0): the running maximum over +- `radius` samples, averaged over the
// same window with a Hann weight. Zero where `values` are zero within 2 x radius.
std::vector<double> smooth_cover(const std::vector<double>& values, std::size_t radius);

// frames frames of identity rotations on the subject's skeleton, contacts 0.
Clip empty_clip(const BodyPlan& body, std::size_t frames, double rate_hz);

// Writes one frame: rotations, root, contacts.
void put_frame(const BodyPlan& body, const BodyState& state, std::size_t t, Clip& clip);

}  // namespace mocap::corpus
