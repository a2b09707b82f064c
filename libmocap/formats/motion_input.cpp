#include "libmocap/formats/motion_input.hpp"

#include <fcntl.h>
#include <fmt/core.h>
#include <unistd.h>
#include <zlib.h>

#include "libmocap/base/error.hpp"
#include "libmocap/base/output_file.hpp"
#include "libmocap/formats/rate_rules.hpp"
#include "libmocap/io/bvh.hpp"
#include "libmocap/io/npz.hpp"
#include "libmocap/skeleton/joint_map.hpp"
#include "libmocap/store/archive.hpp"

namespace mocap::formats {
namespace {

constexpr std::string_view kHdf5 = "\x89HDF\r\n\x1a\n";

bool is_hdf5(std::string_view head) { return head.starts_with(kHdf5); }
bool is_zip(std::string_view head) { return head.starts_with("PK\x03\x04") || head.starts_with("PK\x05\x06"); }
bool is_bvh(std::string_view head) {
  if (head.starts_with("\xef\xbb\xbf")) head.remove_prefix(3);
  while (!head.empty() && (head[0] == ' ' || head[0] == '\t' || head[0] == '\r' || head[0] == '\n')) head.remove_prefix(1);
  return head.starts_with("HIERARCHY");
}

std::string stem_of(const std::string& label) {
  std::string stem = label == "-" ? "stdin" : label;
  for (const char* ending : {".gz", ".bvh", ".npz", ".h5", ".BVH", ".NPZ"})
    if (stem.size() > std::string_view(ending).size() && stem.ends_with(ending)) stem.resize(stem.size() - std::string_view(ending).size());
  return stem;
}

// A text or npz file: one clip, held in memory.
class SingleClip final : public MotionInput {
 public:
  SingleClip(std::string format, Clip clip, History history, std::vector<std::string> notes, std::string sha256)
      : format_(std::move(format)), clip_(std::move(clip)), history_(std::move(history)), notes_(std::move(notes)), sha256_(std::move(sha256)) {}
  std::string format() const override { return format_; }
  std::size_t size() const override { return 1; }
  Clip read(std::size_t) const override { return clip_; }
  const History& history() const override { return history_; }
  const std::vector<std::string>& notes() const override { return notes_; }
  std::string sha256() const override { return sha256_; }

 private:
  std::string format_;
  Clip clip_;
  History history_;
  std::vector<std::string> notes_;
  std::string sha256_;
};

class ArchiveClips final : public MotionInput {
 public:
  explicit ArchiveClips(const std::string& path) : reader_(path) {}
  std::string format() const override { return "archive"; }
  std::size_t size() const override { return reader_.size(); }
  Clip read(std::size_t i) const override { return reader_.read(i); }
  std::string name(std::size_t i) const override { return reader_.info(i).name; }
  Attributes attributes(std::size_t i) const override { return reader_.info(i).attributes; }
  const History& history() const override { return reader_.header().history; }
  const std::vector<std::string>& notes() const override { return notes_; }
  std::string sha256() const override { return reader_.file_sha256(); }
  std::string contacts_rule() const override { return reader_.header().contacts_rule; }

 private:
  store::ArchiveReader reader_;
  std::vector<std::string> notes_;
};

void fill_source(Clip& clip, const std::string& label, const std::string& digest) {
  clip.name = stem_of(label);
  clip.source.path = label;
  clip.source.sha256 = digest;
  clip.source.frame_rate_hz = clip.frame_rate_hz;
  clip.source.start_s = 0;
  clip.source.end_s = clip.seconds();
}

// Which joint is which is found once, here; everything later goes by the roles.
void assign_roles(Clip& clip, const ReadOptions& options) {
  auto skeleton = std::make_shared<Skeleton>(*clip.skeleton);
  skeleton->roles = roles_of(*skeleton, map_to_canonical(*skeleton, options.joints));
  clip.skeleton = std::move(skeleton);
}

std::unique_ptr<MotionInput> open_bvh(const std::string& bytes, const std::string& label, const std::string& digest, const ReadOptions& options) {
  io::BvhFile file = io::parse_bvh(bytes, {options.lenient});
  Clip clip = std::move(file.clip);
  assign_roles(clip, options);
  const WorldFrame frame = detect_world_frame(clip, options.unit, options.up);
  file.notes.insert(file.notes.end(), frame.notes.begin(), frame.notes.end());
  file.notes.push_back(fmt::format("unit {}, up axis {}, {} Hz", text(frame.unit), text(frame.up), clip.frame_rate_hz));
  fill_source(clip, label, digest);
  const std::size_t found = options.first_frame == FirstFrame::automatic ? calibration_frames(clip) : 0;
  const std::size_t drop = options.first_frame == FirstFrame::drop && clip.frames() > 1 ? 1 : found;
  if (drop > 0) {
    clip = cut(clip, drop, clip.frames() - drop);
    file.notes.push_back(fmt::format("{} leading frame{} dropped{}", drop, drop > 1 ? "s" : "", found > 0 ? ": a calibration pose" : ""));
  }
  to_metres_z_up(clip, frame);
  return std::make_unique<SingleClip>("bvh", std::move(clip), History{}, std::move(file.notes), digest);
}

std::unique_ptr<MotionInput> open_npz(const std::string& bytes, const std::string& label, const std::string& digest, const ReadOptions& options) {
  io::NpzMotion motion = io::parse_motion_npz(bytes, options.body_model.get());
  if (motion.release == "source") assign_roles(motion.clip, options);
  fill_source(motion.clip, label, digest);
  if (options.first_frame == FirstFrame::drop && motion.clip.frames() > 1) motion.clip = cut(motion.clip, 1, motion.clip.frames() - 1);
  return std::make_unique<SingleClip>("npz (" + motion.release + ")", std::move(motion.clip), std::move(motion.history), std::vector<std::string>{}, digest);
}

// Standard input's archive goes through an unlinked file: HDF5 needs to seek.
std::unique_ptr<MotionInput> open_spooled(const std::string& bytes) {
  const std::string path = temporary_file("mocapkit-stdin");
  try {
    write_file(path, bytes, Overwrite::allow);
    auto input = std::make_unique<ArchiveClips>(path);
    ::unlink(path.c_str());
    return input;
  } catch (...) {
    ::unlink(path.c_str());
    throw;
  }
}

// The first bytes of a file, expanded where it is gzip.
std::string head_of(const std::string& path) {
  gzFile f = gzopen(path.c_str(), "rb");
  if (!f) return {};
  std::string head(4096, '\0');
  const int n = gzread(f, head.data(), static_cast<unsigned>(head.size()));
  gzclose(f);
  head.resize(n > 0 ? static_cast<std::size_t>(n) : 0);
  return head;
}

std::unique_ptr<MotionInput> open_as_stated(const std::string& path, const std::string& label, const ReadOptions& options) {
  const std::string name = path == "-" ? "<stdin>" : path;
  try {
    if (path != "-" && is_hdf5(head_of(path))) return std::make_unique<ArchiveClips>(path);
    Digest digest{};
    const std::string bytes = read_file(path, std::size_t{1} << 36, &digest);
    if (bytes.empty()) refuse({name, 0, {}}, "an empty file, expected BVH, npz or a motion archive");
    if (is_hdf5(bytes)) return open_spooled(bytes);
    if (is_zip(bytes)) return open_npz(bytes, label, to_hex(digest), options);
    if (is_bvh(bytes)) return open_bvh(bytes, label, to_hex(digest), options);
    refuse({name, 0, {}}, "no format known here, expected BVH, npz or a motion archive");
  } catch (const Error& e) {
    throw e.status() == Exit::data ? e.in_file(name) : e;
  }
}

}  // namespace

std::unique_ptr<MotionInput> open_motion(const std::string& path, const std::string& label, const ReadOptions& options) {
  const auto rate = options.rates ? options.rates->rate_for(path, label) : std::nullopt;
  auto input = open_as_stated(path, label, options);
  return rate ? with_rate(std::move(input), *rate) : std::move(input);
}

Probe probe_motion(const std::string& path) {
  const std::string head = head_of(path);
  if (is_zip(head)) {
    const std::string why_not = io::why_no_motion(path);
    return {why_not.empty(), why_not};
  }
  return {is_bvh(head) || (is_hdf5(head) && store::probe(path) == "mocap-motion"), {}};
}

}  // namespace mocap::formats
