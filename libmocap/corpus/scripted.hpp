// Jumping and lifting: motions in phases, on feet that stay where they are put.
//
// Jumping: stand, crouch with the arms drawn back, push off over the balls of the feet with the arms thrown up, fly,
// land, recover; upwards and up to 0.6 m forwards. In flight the pelvis falls freely (9.81 m/s^2, exact), and the feet
// leave and meet the ground where the legs can reach no further. Lifting: stand, bend down (each subject between
// bending the back and bending the knees), grasp a box with both hands, lift it to the chest, hold, put it back where
// it was, let go, straighten up. Grasping hands stand still in the world. Both repeat as often as `frames` allows, with
// other heights, depths and durations every time and pauses between.
#pragma once
#include "libmocap/clip/clip.hpp"
#include "libmocap/corpus/subject.hpp"

namespace mocap::corpus {

// frames frames in metres, Z up, at a random place and heading; contacts are the times at which the ball of the foot
// stands still. `random`: the clip's own stream. Attributes are the caller's.
Clip make_jumping(const Subject& subject, Random& random, std::size_t frames, double rate_hz);
Clip make_lifting(const Subject& subject, Random& random, std::size_t frames, double rate_hz);

}  // namespace mocap::corpus
