#include <algorithm>
#include <cmath>
#include <numeric>

#include "libmocap/store/archive_state.hpp"
#include "libmocap/store/frames.hpp"

namespace mocap::store {
namespace {

// What the index alone shows: clips end to end without gaps, texts that mean something.
void check_index(const std::vector<ClipInfo>& clips, std::int64_t frames, const std::function<void(const std::string&, const std::string&)>& found) {
  std::vector<std::size_t> order(clips.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return clips[a].start < clips[b].start; });
  std::int64_t next = 0;
  for (const std::size_t i : order) {
    const ClipInfo& c = clips[i];
    if (c.start != next) found("clip " + c.name, "starts at frame " + std::to_string(c.start) + ", expected " + std::to_string(next) + ": clips lie end to end");
    next = std::max(next, c.start + c.length);
  }
  if (next != frames) found("frames", std::to_string(frames) + " rows, expected " + std::to_string(next) + " as the clips use");
  for (const ClipInfo& c : clips) {
    try {
      if (!c.source.sha256.empty()) from_hex(c.source.sha256);
    } catch (const Error& e) {
      found("clip " + c.name + " source", e.message());
    }
    if (c.source.end_s < c.source.start_s) found("clip " + c.name, "the source part ends before it starts");
    if (c.source.up_axis != "" && c.source.up_axis != "y" && c.source.up_axis != "z") found("clip " + c.name, "source up axis '" + c.source.up_axis + "', expected y or z");
  }
}

}  // namespace

std::vector<std::string> ArchiveReader::check(bool full) const {
  const State& s = *state_;
  std::vector<std::string> defects;
  const auto found = [&](const std::string& object, const std::string& what) { defects.push_back(Error(Exit::data, {s.in.name(), 0, object}, what).what()); };
  const auto attempt = [&](const auto& body) {
    try {
      body();
    } catch (const Error& e) {
      if (e.status() != Exit::data) throw;
      defects.push_back(e.what());
    }
  };
  check_index(s.clips, static_cast<std::int64_t>(s.rotations->shape()[0]), found);
  attempt([&] {
    for (const auto& link : s.in.list("/paths"))
      if (!s.by_name.contains(h5::unescape_link(link))) found("paths/" + link, "no clip of this name");
  });
  if (!full) return defects;

  const auto joints = static_cast<std::size_t>(s.header.skeleton->joint_count());
  for (std::size_t i = 0; i < s.clips.size(); ++i) {
    const std::string object = "clip " + s.clips[i].name;
    attempt([&] {
      State::RawClip raw = s.read_raw(i);
      const std::size_t frames = raw.root_position.size() / 3;
      for (std::size_t k = 0; k < frames * joints; ++k) {
        const float* q = raw.rotations.data() + 4 * k;
        const double norm = std::sqrt(static_cast<double>(q[0]) * q[0] + static_cast<double>(q[1]) * q[1] + static_cast<double>(q[2]) * q[2] + static_cast<double>(q[3]) * q[3]);
        const bool unit = std::abs(norm - 1) <= 1e-6;
        if (unit && continues_sign(k < joints ? nullptr : q - 4 * joints, q)) continue;
        found(object + " frame " + std::to_string(k / joints) + " joint " + s.header.skeleton->joint_names[k % joints],
              unit ? "a quaternion on the other side of the sphere than its predecessor, expected continuous signs" : "a quaternion of norm " + std::to_string(norm) + ", expected 1");
        break;  // one line a clip and kind
      }
      if (to_hex(clip_digest(s.assemble(i, std::move(raw)))) != s.clips[i].digest) found(object, "the frames do not fit the clip's digest: the file is damaged");
    });
  }
  // Everything else in the file, known here or not: its checksums.
  attempt([&] {
    for (const auto& path : s.in.datasets("/"))
      if (!path.starts_with("/frames/") || path == "/frames/joint_positions") attempt([&] { s.in.open(path).verify(); });
  });
  return defects;
}

}  // namespace mocap::store
