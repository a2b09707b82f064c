// Walking, jogging and the changes between them.
//
// The phase of the stride runs with a slowly varying cadence; footsteps are planned in the world along the path that
// the pelvis takes, one per half cycle; between them the feet roll over heel and ball and swing; the pelvis and the
// upper body follow Fourier series of the phase (Troje 2002, "Decomposing biological motion": a walk is its mean pose
// plus two harmonics); the legs follow by inverse kinematics, so a planted foot stands still exactly. Population means
// of walking are those of adult gait: 1.25 m/s at 115 steps a minute, knee flexion near 15 degrees in stance and 60 in
// swing, pelvis rising and falling twice a stride by 4 cm; jogging: 2.6 m/s, duty factor 0.37 with two flights a
// stride, forward lean, knees to 100 degrees.
#pragma once
#include "libmocap/clip/clip.hpp"
#include "libmocap/corpus/curves.hpp"
#include "libmocap/corpus/subject.hpp"

namespace mocap::corpus {

// How much of jogging is in the motion over time, 0 walking to 1 jogging.
struct GaitPlan {
  KeyCurve jogging;               // finished; constant 0 or 1 for a steady clip
  std::vector<Segment> segments;  // labels in frames of the clip, for transitions
  double turning = 1;             // factor on the change of heading
  static GaitPlan steady(bool jogging);
  // Walk, jog, walk: two changes over about 1.5 s each; segments change where the mixture crosses 1/2.
  static GaitPlan walk_jog_walk(Random& random, double seconds, double rate_hz);
};

// frames frames of gait in metres, Z up, at a random place and heading. `random`: the clip's own stream. Contacts are
// the times at which the ball of the foot stands still. Attributes are the caller's.
Clip make_gait(const Subject& subject, const GaitPlan& plan, Random& random, std::size_t frames, double rate_hz);

}  // namespace mocap::corpus
