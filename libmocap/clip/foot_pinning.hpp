// Feet that are down are held still (Kovar, Schreiner, Gleicher: Footskate cleanup for motion capture editing, SCA 2002).
#pragma once
#include <cstddef>

#include "libmocap/clip/clip.hpp"

namespace mocap {

struct PinningOptions {
  double blend_seconds = 0.25;  // over which a correction comes in before a foot is down and goes out after it, seconds
  double most_root = 0.06;      // by which the root may sink so that legs reach, or rise, by half of it, so that straight legs stay so; metres
};

struct PinningReport {
  std::size_t runs = 0;           // times that a foot was down
  std::size_t frames = 0;         // frames that a foot was down, both feet counted
  std::size_t unreached = 0;      // of these, those in which the foot is more than a millimetre from where it would be still
  double largest_correction = 0;  // by which a foot is moved, metres
  double largest_miss = 0;        // distance that a foot lacks while down, metres
  double largest_root = 0;        // by which the root sinks or rises, metres
};

// Moves each foot by a path c(t) in the world so that its point of contact stands still in every run of frames in which `contacts` has it down:
//
//   c(t+1) - c(t) = -((1 - s) (heel(t+1) - heel(t)) + s (toe(t+1) - toe(t)))     horizontally
//
// heel: the point of the sole below the ankle (on real walks and runs a third to three quarters as fast as the ankle while the foot is down); toe: the toe
// base (role left_foot, right_foot).
// s goes from 0 to 1 as the foot comes down from the heel on to the toes (10 to 3 degrees), and is 1 with the heel up; a flat foot is held where it turns
// slowest, at the toes where it does not turn. What is free, a shift of each run, is chosen so that c vanishes on average, frames in which the foot
// stands counting most, and so that runs close to each other join. Corrections of more than 0.15 m are taken ever shorter and stay below 0.30 m.
// Vertically the lower of heel and toe is held at its median over the run, or at the ground, z = 0, where that is up to 0.05 m higher; a foot is pulled
// down by 5 mm at most. Between runs c is a cubic with the place and speed of either end (to 0 over blend_seconds, where there is time for two of them).
//
// Hip and knee then bring the ankle there, in the plane in which the knee is bent (in that in which it bends in the clip, where it is straight); the ankle
// keeps the foot's rotation in the world. The root rises and sinks a little so that straight legs keep their length; where a leg would be straighter than
// 99 % of its length and than it was, the root sinks as far as that takes. No bone is stretched: what is still beyond reach is approached ever slower, as
// in clip/leg_reach.hpp. Knees that are bent backwards are put right while the foot is down.
//
// Takes any skeleton with the roles hip, knee, ankle and foot of both sides, other joints in between and joints that move (`translations`) included; metres,
// Z up, ground at 0. Changes the rotations of hips, knees and ankles and the height of the root, in frames less than 3 blend_seconds from one with a foot
// down; all else keeps its bits (joints of the legs may change sign). The point of contact moves less than 1e-9 m a frame horizontally where it is reached
// and corrections are below 0.15 m. The same bits every time.
// Error(data): no contacts, a role missing or not in line. Error(usage): an option negative or not finite. Cost O(T (J + blend)): 300,000 frames/s of 22 joints.
PinningReport pin_feet(Clip& clip, const PinningOptions& options = {});

}  // namespace mocap
