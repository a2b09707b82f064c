#include "libmocap/formats/motion_input.hpp"

#include <fcntl.h>
#include <fmt/core.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "libmocap/base/error.hpp"
#include "libmocap/base/output_file.hpp"
#include "libmocap/formats/rate_rules.hpp"
#include "libmocap/io/asf.hpp"
#include "libmocap/io/bvh.hpp"
#include "libmocap/io/npz.hpp"
#include "libmocap/skeleton/joint_map.hpp"
#include "libmocap/store/archive.hpp"

namespace mocap::formats {
namespace {

constexpr double kTypicalLeg = 0.83;  // hip to ankle of an adult, metres

constexpr std::string_view kHdf5 = "\x89HDF\r\n\x1a\n";

bool is_hdf5(std::string_view head) { return head.starts_with(kHdf5); }
bool is_zip(std::string_view head) { return head.starts_with("PK\x03\x04") || head.starts_with("PK\x05\x06"); }
std::string lower(std::string s) {
  for (char& c : s)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c + 32);
  return s;
}
bool is_bvh(std::string_view head) {
  if (head.starts_with("\xef\xbb\xbf")) head.remove_prefix(3);
  while (!head.empty() && (head[0] == ' ' || head[0] == '\t' || head[0] == '\r' || head[0] == '\n')) head.remove_prefix(1);
  return lower(std::string(head.substr(0, 9))) == "hierarchy";
}

bool ends_with(const std::string& s, std::string_view ending) {
  return s.size() > ending.size() && lower(s.substr(s.size() - ending.size())) == ending;
}

// The first lines of a text that hold more than a # comment; empty where there are fewer.
std::pair<std::string_view, std::string_view> first_lines(std::string_view text) {
  if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);
  std::string_view lines[2];
  for (int found = 0; found < 2 && !text.empty();) {
    const std::size_t end = std::min(text.find_first_of("\r\n"), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    while (!line.empty() && (line.front() == ' ' || line.front() == '\t')) line.remove_prefix(1);
    while (!line.empty() && (line.back() == ' ' || line.back() == '\t')) line.remove_suffix(1);
    if (!line.empty() && line.front() != '#') lines[found++] = line;
  }
  return {lines[0], lines[1]};
}
bool is_section(std::string_view line, std::initializer_list<const char*> sections) {
  const std::string word = lower(std::string(line.substr(0, std::min(line.find_first_of(" \t"), line.size()))));
  return std::find(sections.begin(), sections.end(), word) != sections.end();
}
bool is_amc(std::string_view head) {
  const auto [first, second] = first_lines(head);
  if (is_section(first, {":fully-specified", ":degrees", ":radians", ":samples-per-second", ":frame-range", ":asf-file", ":asf-path"})) return true;
  return !first.empty() && first.find_first_not_of("0123456789") == std::string_view::npos && (second.starts_with("root ") || second.starts_with("root\t"));
}
bool is_asf(std::string_view head) {
  return is_section(first_lines(head).first, {":version", ":name", ":units", ":documentation", ":root", ":bonedata", ":hierarchy"});
}

std::string stem_of(const std::string& label) {
  std::string stem = label == "-" ? "stdin" : label;
  for (const char* ending : {".gz", ".bvh", ".npz", ".h5", ".BVH", ".NPZ", ".amc", ".AMC"})
    if (stem.size() > std::string_view(ending).size() && stem.ends_with(ending)) stem.resize(stem.size() - std::string_view(ending).size());
  return stem;
}

struct Remarks {
  std::vector<std::string> notes, doubts;
  void add(const std::vector<std::string>& more_notes, const std::vector<std::string>& more_doubts) {
    notes.insert(notes.end(), more_notes.begin(), more_notes.end());
    doubts.insert(doubts.end(), more_doubts.begin(), more_doubts.end());
  }
};

// A text or npz file: one clip, held in memory.
class SingleClip final : public MotionInput {
 public:
  SingleClip(std::string format, Clip clip, History history, Remarks remarks, std::string sha256, std::vector<HistoryInput> companions = {})
      : format_(std::move(format)),
        clip_(std::move(clip)),
        history_(std::move(history)),
        remarks_(std::move(remarks)),
        sha256_(std::move(sha256)),
        companions_(std::move(companions)) {}
  std::string format() const override { return format_; }
  std::size_t size() const override { return 1; }
  Clip read(std::size_t) const override { return clip_; }
  const History& history() const override { return history_; }
  const std::vector<std::string>& notes() const override { return remarks_.notes; }
  std::vector<std::string> doubts() const override { return remarks_.doubts; }
  std::string sha256() const override { return sha256_; }
  std::vector<HistoryInput> companions() const override { return companions_; }

 private:
  std::string format_;
  Clip clip_;
  History history_;
  Remarks remarks_;
  std::string sha256_;
  std::vector<HistoryInput> companions_;
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
  std::map<std::string, std::vector<std::string>> attribute_classes() const override { return reader_.header().attribute_classes; }

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
void assign_roles(Clip& clip, std::vector<std::string>& notes, const ReadOptions& options) {
  auto skeleton = std::make_shared<Skeleton>(*clip.skeleton);
  const JointMap map = map_to_canonical(*skeleton, options.joints);
  skeleton->roles = roles_of(*skeleton, map);
  clip.skeleton = std::move(skeleton);
  if (map.missing().empty()) notes.push_back("joints as in " + (map.family == "unknown" ? "no convention known by name" : map.family));
}

// What BVH and AMC have in common once parsed: calibration frames dropped, metres, Z up.
void finish_clip(Clip& clip, std::vector<std::string>& notes, const WorldFrame& frame, const ReadOptions& options) {
  const std::size_t found = options.first_frame == FirstFrame::automatic ? calibration_frames(clip) : 0;
  const std::size_t drop = options.first_frame == FirstFrame::drop && clip.frames() > 1 ? 1 : found;
  if (drop > 0) {
    clip = cut(clip, drop, clip.frames() - drop);
    notes.push_back(fmt::format("{} leading frame{} dropped{}", drop, drop > 1 ? "s" : "", found > 0 ? ": a calibration pose" : ""));
  }
  to_metres_z_up(clip, frame);
  clip.source.up_axis = text(frame.up);
}

std::unique_ptr<MotionInput> open_bvh(const std::string& bytes, const std::string& label, const std::string& digest, const ReadOptions& options) {
  io::BvhFile file = io::parse_bvh(bytes, {options.lenient});
  Clip clip = std::move(file.clip);
  assign_roles(clip, file.notes, options);
  const WorldFrame frame = detect_world_frame(clip, options.unit, options.up);
  Remarks remarks;
  remarks.add(file.notes, file.repairs);
  remarks.add({}, frame.notes);
  remarks.notes.push_back(fmt::format("unit {}, up axis {}, {} Hz", text(frame.unit), text(frame.up), clip.frame_rate_hz));
  fill_source(clip, label, digest);
  clip.source.unit = text(frame.unit);
  finish_clip(clip, remarks.notes, frame, options);
  return std::make_unique<SingleClip>("bvh", std::move(clip), History{}, std::move(remarks), digest);
}

void scale_lengths(Clip& clip, double scale) {
  auto skeleton = std::make_shared<Skeleton>(*clip.skeleton);
  for (auto& v : skeleton->rest_offsets) v *= scale;
  for (auto& e : skeleton->end_sites) e.offset *= scale;
  clip.skeleton = skeleton;
  for (auto& v : clip.root_position) v *= scale;
  for (auto& v : clip.translations) v *= scale;
}

struct AsfPlace {
  std::string path, label;
};

// Where the ASF of an AMC is; Error(data) that says what was looked for.
AsfPlace find_asf(const std::string& path, const std::string& label, const ReadOptions& options) {
  namespace fs = std::filesystem;
  constexpr const char* kHint = "--asf FILE names the skeleton";
  if (!options.asf.empty()) return {options.asf, fs::path(options.asf).filename().string()};
  if (path == "-" || label == "-" || label == "<stdin>") refuse({}, "motion (AMC) without its skeleton (ASF), which standard input does not bring", kHint);
  const auto without_gz = [](std::string name) {
    if (ends_with(name, ".gz")) name.resize(name.size() - 3);
    return name;
  };
  const fs::path folder = fs::path(path).parent_path();
  std::string stem = without_gz(fs::path(path).filename().string());
  if (ends_with(stem, ".amc")) stem.resize(stem.size() - 4);
  std::vector<std::string> same, leading, all;  // file names
  std::size_t longest = 0;
  std::error_code error;
  fs::directory_iterator entry(folder.empty() ? fs::path(".") : folder, error);
  for (; !error && entry != fs::directory_iterator(); entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    std::string own = without_gz(name);
    std::error_code none;
    if (!ends_with(own, ".asf") || name.front() == '.' || entry->is_directory(none)) continue;
    own.resize(own.size() - 4);
    all.push_back(name);
    if (own == stem) same.push_back(name);
    if (own.size() < longest || own.size() >= stem.size() || stem[own.size()] != '_' || !stem.starts_with(own)) continue;
    if (own.size() > longest) leading.clear();
    longest = own.size();
    leading.push_back(name);
  }
  std::vector<std::string>& found = !same.empty() ? same : !leading.empty() ? leading : all;
  std::sort(found.begin(), found.end());
  if (found.size() != 1) {
    std::string list;
    for (std::size_t i = 0; i < std::min<std::size_t>(found.size(), 4); ++i) list += (i ? ", " : "") + found[i];
    if (found.size() > 4) list += fmt::format(" and {} more", found.size() - 4);
    refuse({}, fmt::format("motion (AMC) without its skeleton: looked in its folder for {}.asf, for an .asf that its name begins with and for the only .asf, found {}",
                           stem, found.empty() ? "none" : list),
           kHint);
  }
  const std::size_t slash = label.rfind('/');
  return {(folder / found[0]).string(), (slash == std::string::npos ? std::string() : label.substr(0, slash + 1)) + found[0]};
}

// `asf_path` is set as soon as it is known, so that errors can be told apart.
std::unique_ptr<MotionInput> open_amc(const std::string& bytes, const std::string& path, const std::string& label, const std::string& digest,
                                      const ReadOptions& options, std::string& asf_path) {
  const AsfPlace place = find_asf(path, label, options);
  asf_path = place.path;
  Digest asf_digest{};
  const std::string asf_bytes = read_file(place.path, std::size_t{1} << 36, &asf_digest);
  const io::Asf asf = [&] {
    try {
      if (!is_asf(asf_bytes)) refuse({}, "no skeleton, expected an ASF");
      return io::parse_asf(asf_bytes);
    } catch (const Error& e) {
      throw e.in_file(place.path);
    }
  }();
  io::AmcFile file = io::parse_amc(bytes, asf, {options.lenient});
  Clip clip = std::move(file.clip);
  assign_roles(clip, file.notes, options);
  Remarks remarks{asf.notes, {}};
  remarks.add(file.notes, file.repairs);
  const bool scaled = options.unit == Unit::automatic && asf.metres_per_unit > 0;
  if (scaled) scale_lengths(clip, asf.metres_per_unit);
  const WorldFrame frame = detect_world_frame(clip, scaled ? Unit::metre : options.unit, options.up);
  remarks.add({}, frame.notes);
  if (scaled && frame.leg_length_m > 0 && std::abs(std::log(frame.leg_length_m / kTypicalLeg)) > std::log(1.7))
    remarks.doubts.push_back(fmt::format("legs of {:.3g} m by the skeleton's own unit; force another with --unit", frame.leg_length_m));
  const std::string unit = scaled ? fmt::format("asf ({:.6g} m)", asf.metres_per_unit) : text(frame.unit);
  remarks.notes.push_back(fmt::format("skeleton {}, unit {}, up axis {}, {} Hz", place.label, unit, text(frame.up), clip.frame_rate_hz));
  fill_source(clip, label, digest);
  clip.source.unit = scaled ? "asf" : text(frame.unit);
  finish_clip(clip, remarks.notes, frame, options);
  std::vector<HistoryInput> companions{{place.label, to_hex(asf_digest)}};
  return std::make_unique<SingleClip>("amc", std::move(clip), History{}, std::move(remarks), digest, std::move(companions));
}

std::unique_ptr<MotionInput> open_npz(const std::string& bytes, const std::string& label, const std::string& digest, const ReadOptions& options) {
  io::NpzMotion motion = io::parse_motion_npz(bytes, options.body_model.get());
  Remarks remarks;
  if (motion.release == "source") assign_roles(motion.clip, remarks.notes, options);
  fill_source(motion.clip, label, digest);
  motion.clip.source.unit = "m";
  motion.clip.source.up_axis = "z";
  if (options.first_frame == FirstFrame::drop && motion.clip.frames() > 1) motion.clip = cut(motion.clip, 1, motion.clip.frames() - 1);
  return std::make_unique<SingleClip>("npz (" + motion.release + ")", std::move(motion.clip), std::move(motion.history), std::move(remarks), digest);
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
  std::string asf_path;
  try {
    if (path != "-" && is_hdf5(head_of(path))) return std::make_unique<ArchiveClips>(path);
    Digest digest{};
    const std::string bytes = read_file(path, std::size_t{1} << 36, &digest);
    if (bytes.empty()) refuse({name, 0, {}}, "an empty file, expected BVH, AMC, npz or a motion archive");
    if (is_hdf5(bytes)) return open_spooled(bytes);
    if (is_zip(bytes)) return open_npz(bytes, label, to_hex(digest), options);
    if (is_bvh(bytes)) return open_bvh(bytes, label, to_hex(digest), options);
    if (is_amc(bytes)) return open_amc(bytes, path, label, to_hex(digest), options, asf_path);
    if (is_asf(bytes)) refuse({name, 0, {}}, "a skeleton (ASF) without motion, expected an AMC", "give the AMC: the ASF beside it is found, or named with --asf");
    refuse({name, 0, {}}, "no format known here, expected BVH, AMC, npz or a motion archive");
  } catch (const Error& e) {
    throw e.status() == Exit::data && (asf_path.empty() || e.where().file != asf_path) ? e.in_file(name) : e;
  }
}

}  // namespace

std::vector<HistoryInput> companions_of(const std::string& path, const std::string& label, const ReadOptions& options) {
  if (path == "-" || !is_amc(head_of(path))) return {};
  try {
    const AsfPlace place = find_asf(path, label, options);
    Digest digest{};
    (void)read_file(place.path, std::size_t{1} << 36, &digest);
    return {{place.label, to_hex(digest)}};
  } catch (const Error&) {  // its turn comes
    return {};
  }
}

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
  return {is_bvh(head) || is_amc(head) || (is_hdf5(head) && store::probe(path) == "mocap-motion"), {}};
}

}  // namespace mocap::formats
