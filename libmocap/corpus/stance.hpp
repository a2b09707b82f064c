// Standing on two feet: what jumping and lifting start from and come back to.
#pragma once
#include "libmocap/corpus/body_state.hpp"
#include "libmocap/corpus/curves.hpp"

namespace mocap::corpus {

// A place to stand, the posture there, and the small unrest of a standing body.
struct Stance {
  Vector2 place;  // on the ground, between the ankles
  double heading;
  double half_width;  // of the ankles
  double toe_out[2];
  Style day;  // the subject's traits as they are in this clip
  SlowNoise sway_ahead, sway_aside, turn, nod, arms;

  Stance(const Subject& subject, Random& random);

  Vector2 forward() const;
  Vector2 left() const;
  // Where the ball of a foot rests when the stance has moved `ahead` metres forwards.
  Vector2 ball(const BodyPlan& body, int side, double ahead = 0) const;
  // Height of the pelvis with nearly straight legs.
  double pelvis_height(const BodyPlan& body) const;
  // Upright with hanging arms at time t; feet flat and planted; the pelvis `ahead` of the place.
  BodyState upright(const Subject& subject, double t, double ahead = 0) const;
};

// Times at which `durations` start so that they fill `seconds` with random pauses between; only as many as fit, but at
// least one. At most `shortest_pause` before the first where nothing is left to share.
std::vector<double> schedule(const std::vector<double>& durations, double seconds, double shortest_pause,
                             Random& random);

}  // namespace mocap::corpus
