// One motion: a skeleton, a rate, and per frame the local rotations and the root's place in the world.
#pragma once
#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "libmocap/skeleton/forward_kinematics.hpp"
#include "libmocap/skeleton/skeleton.hpp"

namespace mocap {

using Attributes = std::map<std::string, std::string>;  // action=walking, gender=female, ...; unlabelled: absent or ""

// Where a clip came from: what leak checks and splits go by (contract/motion-archive.md, /clips/source*).
struct ClipSource {
  std::string path;            // relative to the folder given on the command line; a lone file: its base name
  std::string sha256;          // of the file's bytes, hexadecimal; empty for generated motion
  double start_s = 0, end_s = 0;  // the part of the file used
  double frame_rate_hz = 0;    // the file's own rate
  int phase = 0;               // decimation offset in source frames
  bool mirrored = false;
  std::string unit;            // of the file's lengths, as found or forced: "m", "cm", "mm", "in", "cmu", "asf"; "" where there is no file
  std::string up_axis;         // of the file: "y" or "z"; "" where there is no file
  // Where the clip's frame lies in the source's world (metres, Z up): scale * p_source = Rz(yaw) p_clip + origin, before
  // mirroring. scale is the ratio of leg lengths that retargeting applied; 1, 0 and the origin where nothing was moved.
  double scale = 1, yaw = 0;
  Vector3 origin = Vector3::Zero();
};

struct Segment {  // attributes that hold for a part of a clip
  std::int64_t start = 0, length = 0;  // frames of the clip
  Attributes attributes;
};

// Invariants (validate()): rotations.size() == T*J, unit within 1e-6 and sign-continuous in time after normalisation;
// root_position.size() == T; contacts and translations empty or full; all values finite; rate finite and > 0;
// segments within the clip.
// Once normalised (clip/world_frame.hpp) lengths are metres and the world is Z up.
struct Clip {
  std::string name;
  std::shared_ptr<const Skeleton> skeleton;
  double frame_rate_hz = 30;
  std::vector<Quaternion> rotations;    // [T*J] frame-major: joint j of frame t at t*J + j; joint to parent (root: to world)
  std::vector<Vector3> root_position;   // [T] of joint 0 in the world
  std::vector<Vector3> translations;    // [T*J] or empty: joint positions in the parent where they vary (BVH position channels)
  std::vector<std::array<std::uint8_t, 2>> contacts;  // [T] or empty: left, right foot on the ground
  Attributes attributes;
  ClipSource source;
  std::vector<Segment> segments;
  std::vector<Vector2> path;  // ground curve the clip was asked to follow, or empty
  std::map<std::string, std::map<std::string, float>> attribute_probability;  // attribute -> class -> what a classifier found; mostly empty

  std::size_t frames() const { return root_position.size(); }
  int joints() const { return skeleton ? skeleton->joint_count() : 0; }
  double seconds() const { return frames() < 2 ? 0.0 : static_cast<double>(frames() - 1) / frame_rate_hz; }
  std::span<const Quaternion> frame(std::size_t t) const { return {rotations.data() + t * static_cast<std::size_t>(joints()), static_cast<std::size_t>(joints())}; }
  std::span<Quaternion> frame(std::size_t t) { return {rotations.data() + t * static_cast<std::size_t>(joints()), static_cast<std::size_t>(joints())}; }

  void validate(const std::string& file = {}) const;  // Error(data) naming the invariant broken, frame and joint
};

// World rotations and positions of one frame.
void world_pose(const Clip& clip, std::size_t t, Pose& out);

// The clip without its frames: name, skeleton, rate, attributes and their probabilities, source and path. What counts or indexes frames (rotations,
// positions, contacts, segments) is left empty: whoever makes new frames of old ones starts from this, so that no field is forgotten.
Clip without_frames(const Clip& clip);

// Frames [first, first + count), metadata kept, source times and segments moved along. Error(internal) out of range.
Clip cut(const Clip& clip, std::size_t first, std::size_t count);

// Sign continuity of every joint over time (rotations are unchanged as rotations).
void make_sign_continuous(Clip& clip);

}  // namespace mocap
