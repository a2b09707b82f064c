// The corpus as a whole: which clips there are, what each holds, and the tables beside them.
#pragma once
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "libmocap/clip/clip.hpp"
#include "libmocap/corpus/noise.hpp"
#include "libmocap/corpus/subject.hpp"

namespace mocap::corpus {

inline constexpr double kFrameRateHz = 120;

enum class Action { walking, jogging, jumping, lifting, transition };
std::string text(Action action);
Action parse_action(std::string_view name);  // Error(usage) for anything else

struct ClipId {
  Action action = Action::walking;
  Gender gender = Gender::female;
  int subject = 1, take = 1;  // from 1
  std::string stem() const;   // "walking_f001_1"
};

// What to make. Takes and actions do not influence each other: a smaller plan makes a subset of the same clips.
struct CorpusPlan {
  std::uint64_t seed = 1;
  int subjects = 12;    // of each gender
  int takes = 1;        // of each action and subject
  int transitions = 1;  // walk-jog-walk clips of each subject
  double seconds = 8;   // of a clip
  double turning = 1;   // factor on how fast walkers and joggers turn: 1 up to about 20 degrees/s, 5 up to 100
  std::vector<Action> actions = {Action::walking, Action::jogging, Action::jumping, Action::lifting};
};

// Every clip, sorted by action, gender, subject, take.
std::vector<ClipId> list_clips(const CorpusPlan& plan);

// One clip at 120 Hz in metres, Z up, somewhere on the ground facing anywhere; name = stem, source.path = stem +
// ".bvh"; attributes action (not on transitions, whose segments carry it), gender, subject; contacts. The same bits for
// equal (seed, id, seconds, turning), whatever else is made. Cost: about 3 us a frame.
Clip make_clip(const CorpusPlan& plan, const ClipId& id);

// The noisy twin of a clip: a copy disturbed by add_sensor_noise with the clip's own stream.
Clip make_noisy(const CorpusPlan& plan, const ClipId& id, const Clip& clean, double level,
                std::vector<NoiseEvent>& events);

// The same motion as BVH files commonly hold it: (x, y, z) -> (y, z, x) and centimetres; a figure facing +X faces +Z.
// The inverse of to_metres_z_up (clip/world_frame.hpp).
Clip to_y_up_centimetres(const Clip& clip);

// labels.tsv: file, action, gender, subject; with transitions also start and end in seconds, empty for whole clips, and
// one row for each segment. Reads only attributes and segments.
std::string labels_table(const std::vector<Clip>& clips);

// Rows of the manifest of a noisy twin: file, kind, joint, start, end (seconds), size, unit.
std::string manifest_header();
std::string manifest_rows(const Clip& clip, const std::vector<NoiseEvent>& events);

}  // namespace mocap::corpus
