// Feet and ground: where the floor is, and when a foot is on it.
#pragma once
#include <string>
#include <vector>

#include "libmocap/clip/clip.hpp"

namespace mocap {

// Height of the floor under the soles, from the frames in which the lower foot is slow (weight 1 below 0.20 m/s, falling
// to 0 at 0.30): the 25th percentile of the lower sole's height; over all frames the 5th percentile where fewer than 5 frames are slow.
// Height of a sole: the lower of ankle and toe base above it (skeleton/rest_pose.hpp, sole_heights). Robust against single frames; 0 for a
// skeleton without feet. Where most of the time some other joint of the body is 0.15 m below that - lying with the feet up, on the hands - the
// floor is 0.05 m under the lowest joint (its 25th percentile).
double floor_height(const Clip& clip);

// Lowers or lifts the whole clip so that floor_height() is 0; returns the shift applied. source.origin follows.
double set_on_ground(Clip& clip);

// A contact rule in physical units: the foot is down while its toe base or its ankle is slower than speed_mps and its sole
// point lower than height_m (speed: of the slower step to either side); a foot that is down stays down until both exceed (1 + hysteresis) times the limits.
// Runs and gaps shorter than min_seconds are removed.
struct ContactPreset {
  std::string name;
  double speed_mps, height_m;
  double hysteresis;
  double min_seconds;
  bool ankle;  // whether the ankle counts as well as the toe base
};
// "default", and the rules of public code in the same terms: "holden", "lafan1", "humanml3d", "humor", "motion-matching".
const std::vector<ContactPreset>& contact_presets();
const ContactPreset& contact_preset(const std::string& name);  // Error(usage) lists the names

// [T] left, right. Works on any skeleton with the roles left_foot and right_foot (and the ankles, where the rule uses
// them); a skeleton without them gets no labels (an empty result).
std::vector<std::array<std::uint8_t, 2>> label_contacts(const Clip& clip, const ContactPreset& preset);

}  // namespace mocap
