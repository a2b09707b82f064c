#pragma once
#include <cmath>
#include <cstdlib>
#include <string>

#include "libmocap/base/error.hpp"
#include "libmocap/base/random.hpp"
#include "libmocap/skeleton/canonical_body.hpp"
#include "libmocap/store/archive.hpp"
#include "tests/base/temporary_folder.hpp"

namespace mocap::testing {

// A moving body of any skeleton; `seed` decides the motion.
inline Clip sample_clip(const std::string& name, std::size_t frames, std::uint64_t seed, std::shared_ptr<const Skeleton> skeleton = canonical_body()) {
  Clip clip;
  clip.name = name;
  clip.skeleton = std::move(skeleton);
  Random random(seed, 0);
  const auto joints = static_cast<std::size_t>(clip.joints());
  std::vector<Vector3> axis(joints);
  for (auto& a : axis) a = Vector3(random.normal(), random.normal(), random.normal());
  for (std::size_t t = 0; t < frames; ++t) {
    const double phase = 0.1 * static_cast<double>(t);
    for (std::size_t j = 0; j < joints; ++j) clip.rotations.push_back(exp_map(axis[j] * std::sin(phase + static_cast<double>(j))));
    clip.root_position.emplace_back(0.03 * static_cast<double>(t), std::sin(phase), 0.9);
  }
  clip.source = {name + ".bvh", std::string(64, 'a'), 0, clip.seconds(), 120, 0, false, "cm", "y"};
  return clip;
}

inline Clip with_contacts(Clip clip) {
  for (std::size_t t = 0; t < clip.frames(); ++t) clip.contacts.push_back({static_cast<std::uint8_t>(t / 5 % 2), static_cast<std::uint8_t>(t / 7 % 2)});
  return clip;
}

// The smallest body: one joint.
inline std::shared_ptr<const Skeleton> one_joint() {
  auto skeleton = std::make_shared<Skeleton>();
  skeleton->joint_names = {"root"};
  skeleton->parents = {-1};
  skeleton->rest_offsets = {Vector3::Zero()};
  return skeleton;
}

inline store::ArchiveHeader header_for(const Clip& clip, const std::string& rule = {}) {
  return {clip.skeleton, clip.frame_rate_hz, rule, {{"make", "1", "c0ffee", {"make", "--fps=30"}, 7, {{"a.bvh", std::string(64, 'a')}}}}};
}

inline void write_archive(const std::string& path, const std::vector<Clip>& clips, const std::string& rule = {}, int deflate = 0) {
  store::ArchiveWriter writer(path, Overwrite::allow, header_for(clips.at(0), rule), deflate);
  for (const Clip& clip : clips) writer.add(clip);
  writer.finish();
}

// Runs a script of tests/data/store under the system's Python (h5py and NumPy are Debian packages); -1: not installed.
inline int python(const std::string& script, const std::string& arguments) {
  if (std::system("/usr/bin/python3 -c 'import h5py, numpy' 2>/dev/null") != 0) return -1;
  const int status = std::system(("/usr/bin/python3 " TEST_DATA "/store/" + script + " " + arguments).c_str());
  return WIFEXITED(status) ? WEXITSTATUS(status) : 127;
}

// The message of the Error that `body` throws, or "" where it throws none.
template <class F>
std::string refusal(const F& body) {
  try {
    body();
  } catch (const Error& e) {
    return e.what();
  }
  return {};
}

}  // namespace mocap::testing
