#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "libmocap/base/error.hpp"
#include "libmocap/store/archive.hpp"
#include "libmocap/store/archive_state.hpp"
#include "libmocap/store/common_parts.hpp"
#include "libmocap/store/frames.hpp"

namespace mocap::store {
namespace {

std::string clip_object(const ClipInfo& clip) { return "clip " + clip.name; }

// Puts a group's attribute columns on its rows; "" is unlabelled. Returns the names of the columns.
template <class Row>
std::set<std::string> read_attributes(const h5::Reader& in, const std::string& group, std::vector<Row>& rows, const std::function<Attributes&(Row&)>& of) {
  std::set<std::string> names;
  for (const auto& link : in.list(group)) {
    auto column = in.strings(group + "/" + link, {rows.size()});
    const std::string name = h5::unescape_link(link);
    names.insert(name);
    for (std::size_t i = 0; i < rows.size(); ++i)
      if (!column[i].empty()) of(rows[i]).emplace(name, std::move(column[i]));
  }
  return names;
}

}  // namespace

ArchiveReader::State::State(const std::string& path, Caching caching) : in(path, "motion archive", caching == Caching::random ? 4 * h5::kChunkBytes : h5::kChunkBytes) {
  const Complete complete = parse_complete(in, in.require_format(kMotionFormat, kFormatVersion), "clips");
  for (const auto& [name, value] : {std::pair{"length_unit", "m"}, {"angle_unit", "rad"}, {"up_axis", "z"}, {"forward_axis", "x"}, {"quaternion_order", "wxyz"}})
    in.require_attribute(name, value);
  header.frame_rate_hz = in.double_attribute("frame_rate_hz").value_or(0);
  if (!(std::isfinite(header.frame_rate_hz) && header.frame_rate_hz > 0))
    in.refuse("attribute frame_rate_hz", std::to_string(header.frame_rate_hz) + ", expected a finite number above 0");
  header.contacts_rule = in.text_attribute("contacts").value_or("");
  header.skeleton = read_skeleton(in);
  header.history = read_history(in);
  read_index(complete);
  read_probabilities();
  open_frames();
  read_segments();
  read_path_sizes();
}

void ArchiveReader::State::read_index(const Complete& complete) {
  auto names = in.strings("/clips/name", {h5::kAny});
  const std::size_t n = names.size();
  if (n == 0) in.refuse("clips/name", "no clips, expected at least one");
  if (complete.count != n) in.refuse("clips/name", std::to_string(n) + " clips, expected " + std::to_string(complete.count) + " as the attribute complete says");
  const h5::Shape rows{n};
  const auto start = in.values<std::int64_t>("/clips/start", rows), length = in.values<std::int64_t>("/clips/length", rows);
  auto source = in.strings("/clips/source", rows), sha256 = in.strings("/clips/source_sha256", rows);
  const auto from = in.values<double>("/clips/source_start", rows), to = in.values<double>("/clips/source_end", rows);
  const auto rate = in.values<double>("/clips/source_frame_rate_hz", rows);
  const auto phase = in.values<std::int32_t>("/clips/phase", rows);
  const auto mirrored = in.values<std::uint8_t>("/clips/mirrored", rows);
  const auto bytes = in.values<std::uint8_t>("/clips/digest", {n, 32});
  std::vector<Digest> digests(n);
  clips.resize(n);
  by_name.reserve(n);
  for (std::size_t i = 0; i < n; ++i) {
    ClipInfo& c = clips[i];
    c.name = std::move(names[i]);
    if (c.name.empty()) in.refuse("clips/name", "row " + std::to_string(i) + " is empty");
    if (!by_name.emplace(c.name, i).second) in.refuse(clip_object(c), "the name occurs twice, expected unique names");
    c.start = start[i];
    c.length = length[i];
    if (!std::isfinite(from[i]) || !std::isfinite(to[i]) || !std::isfinite(rate[i])) in.refuse(clip_object(c), "source times or rate that are not finite");
    c.source.path = std::move(source[i]);
    c.source.sha256 = std::move(sha256[i]);
    c.source.start_s = from[i];
    c.source.end_s = to[i];
    c.source.frame_rate_hz = rate[i];
    c.source.phase = phase[i];
    c.source.mirrored = mirrored[i] != 0;
    std::copy_n(bytes.begin() + static_cast<std::ptrdiff_t>(32 * i), 32, digests[i].begin());
    c.digest = to_hex(digests[i]);
  }
  digest = to_hex(combined_digest(std::move(digests)));
  if (digest != complete.digest) in.refuse("clips/digest", "the digests do not fit the attribute complete: the file is damaged");
  read_source_frames();
  header.attributes = read_attributes<ClipInfo>(in, "/clips/attributes", clips, [](ClipInfo& c) -> Attributes& { return c.attributes; });
}

// Columns that older archives lack.
void ArchiveReader::State::read_source_frames() {
  const h5::Shape rows{clips.size()};
  const auto column = [&](const char* path, const auto& read, const auto& set) {
    if (!in.has(path)) return;
    const auto values = read(path);
    for (std::size_t i = 0; i < clips.size(); ++i) set(clips[i], values, i);
  };
  const auto strings = [&](const char* path) { return in.strings(path, rows); };
  const auto numbers = [&](const char* path) { return in.values<double>(path, rows); };
  column("/clips/source_unit", strings, [](ClipInfo& c, const auto& v, std::size_t i) { c.source.unit = v[i]; });
  column("/clips/source_up_axis", strings, [](ClipInfo& c, const auto& v, std::size_t i) { c.source.up_axis = v[i]; });
  column("/clips/source_scale", numbers, [&](ClipInfo& c, const auto& v, std::size_t i) {
    c.source.scale = v[i];
    if (!(std::isfinite(v[i]) && v[i] > 0)) in.refuse(clip_object(c), "source scale " + std::to_string(v[i]) + ", expected a finite number above 0");
  });
  column("/clips/source_yaw", numbers, [&](ClipInfo& c, const auto& v, std::size_t i) {
    c.source.yaw = v[i];
    if (!std::isfinite(v[i])) in.refuse(clip_object(c), "a source yaw that is not finite");
  });
  column("/clips/source_origin", [&](const char* path) { return in.values<double>(path, {clips.size(), 3}); }, [&](ClipInfo& c, const auto& v, std::size_t i) {
    c.source.origin = Vector3(v[3 * i], v[3 * i + 1], v[3 * i + 2]);
    if (!c.source.origin.allFinite()) in.refuse(clip_object(c), "a source origin that is not finite");
  });
}

void ArchiveReader::State::read_probabilities() {
  for (const auto& link : in.list("/clips/attribute_classes")) {
    const std::string name = h5::unescape_link(link), object = "clips/attribute_probability/" + link;
    auto classes = in.strings("/clips/attribute_classes/" + link, {h5::kAny});
    if (classes.empty() || std::set<std::string>(classes.begin(), classes.end()).size() != classes.size() || std::find(classes.begin(), classes.end(), "") != classes.end())
      in.refuse("clips/attribute_classes/" + link, "no class, an empty one or one that occurs twice, expected the columns of " + object);
    if (!in.has("/" + object)) in.refuse(object, "missing, expected the probabilities of the classes in clips/attribute_classes/" + link);
    auto values = in.values<float>("/" + object, {clips.size(), classes.size()});
    for (std::size_t k = 0; k < values.size(); ++k)
      if (!(values[k] >= 0 && values[k] <= 1)) in.refuse(object, "row " + std::to_string(k / classes.size()) + ": " + std::to_string(values[k]) + ", expected a number in 0..1");
    probability[name] = std::move(values);
    header.attribute_classes[name] = std::move(classes);
  }
}

void ArchiveReader::State::open_frames() {
  const std::uint64_t joints = static_cast<std::uint64_t>(header.skeleton->joint_count());
  rotations.emplace(in.open("/frames/rotations"));
  rotations->require(h5::Type::f32, {h5::kAny, joints, 4});
  const std::uint64_t frames = rotations->shape()[0];
  root_position.emplace(in.open("/frames/root_position"));
  root_position->require(h5::Type::f32, {frames, 3});
  if (in.has("/frames/contacts")) {
    if (header.contacts_rule.empty()) in.refuse("attribute contacts", "missing, expected the rule of /frames/contacts");
    contacts.emplace(in.open("/frames/contacts"));
    contacts->require(h5::Type::u8, {frames, 2});
  } else if (!header.contacts_rule.empty()) {
    in.refuse("frames/contacts", "missing, expected contacts by rule " + header.contacts_rule);
  }
  const auto rows = static_cast<std::int64_t>(frames);
  for (const ClipInfo& c : clips)
    if (c.start < 0 || c.length < 1 || c.start >= rows || c.length > rows - c.start)
      in.refuse(clip_object(c), "frames " + std::to_string(c.start) + " + " + std::to_string(c.length) + ", expected rows of the " + std::to_string(rows) + " stored");
}

void ArchiveReader::State::read_segments() {
  if (!in.has("/segments")) return;
  const auto clip = in.values<std::int64_t>("/segments/clip", {h5::kAny});
  const auto start = in.values<std::int64_t>("/segments/start", {clip.size()}), length = in.values<std::int64_t>("/segments/length", {clip.size()});
  std::vector<Segment> segments(clip.size());
  for (std::size_t k = 0; k < clip.size(); ++k) {
    const std::string object = "segments row " + std::to_string(k);
    if (clip[k] < 0 || clip[k] >= static_cast<std::int64_t>(clips.size())) in.refuse(object, "clip " + std::to_string(clip[k]) + ", expected a row of /clips");
    const std::int64_t frames = clips[static_cast<std::size_t>(clip[k])].length;
    if (start[k] < 0 || length[k] < 0 || start[k] > frames || length[k] > frames - start[k])
      in.refuse(object, "frames " + std::to_string(start[k]) + " + " + std::to_string(length[k]) + ", expected frames of the clip's " + std::to_string(frames));
    segments[k].start = start[k];
    segments[k].length = length[k];
  }
  header.segment_attributes = read_attributes<Segment>(in, "/segments/attributes", segments, [](Segment& s) -> Attributes& { return s.attributes; });
  for (std::size_t k = 0; k < clip.size(); ++k) clips[static_cast<std::size_t>(clip[k])].segments.push_back(std::move(segments[k]));
}

void ArchiveReader::State::read_path_sizes() {
  for (const auto& link : in.list("/paths")) {
    const auto row = by_name.find(h5::unescape_link(link));
    if (row == by_name.end()) continue;
    const auto points = in.open("/paths/" + link);
    points.require(h5::Type::f32, {h5::kAny, 2});
    clips[row->second].path_points = static_cast<std::size_t>(points.shape()[0]);
  }
}

ArchiveReader::State::RawClip ArchiveReader::State::read_raw(std::size_t i) const {
  const ClipInfo& info = clips.at(i);
  const auto frames = static_cast<std::size_t>(info.length), joints = static_cast<std::size_t>(header.skeleton->joint_count());
  const auto first = static_cast<std::uint64_t>(info.start), count = static_cast<std::uint64_t>(info.length);
  RawClip raw;
  raw.rotations.resize(frames * joints * 4);
  raw.root_position.resize(frames * 3);
  rotations->read(first, count, raw.rotations.data());
  root_position->read(first, count, raw.root_position.data());
  if (contacts) {
    raw.contacts.resize(frames);
    contacts->read(first, count, raw.contacts.data());
  }
  return raw;
}

Clip ArchiveReader::State::assemble(std::size_t i, RawClip&& raw) const {
  const ClipInfo& info = clips.at(i);
  Clip clip;
  clip.name = info.name;
  clip.skeleton = header.skeleton;
  clip.frame_rate_hz = header.frame_rate_hz;
  clip.attributes = info.attributes;
  clip.source = info.source;
  clip.segments = info.segments;
  for (const auto& [name, classes] : header.attribute_classes) {
    const float* row = probability.at(name).data() + i * classes.size();
    if (std::all_of(row, row + classes.size(), [](float p) { return p == 0; })) continue;
    for (std::size_t c = 0; c < classes.size(); ++c) clip.attribute_probability[name][classes[c]] = row[c];
  }
  clip.rotations.resize(raw.rotations.size() / 4);
  for (std::size_t k = 0; k < clip.rotations.size(); ++k) {
    const float* q = raw.rotations.data() + 4 * k;
    clip.rotations[k] = Quaternion(q[0], q[1], q[2], q[3]);
  }
  clip.root_position.resize(raw.root_position.size() / 3);
  for (std::size_t t = 0; t < clip.root_position.size(); ++t) {
    const float* p = raw.root_position.data() + 3 * t;
    clip.root_position[t] = Vector3(p[0], p[1], p[2]);
  }
  clip.contacts = std::move(raw.contacts);
  if (info.path_points > 0) {
    const auto points = in.values<float>("/paths/" + h5::escape_link(info.name), {info.path_points, 2});
    for (std::size_t p = 0; p < info.path_points; ++p) clip.path.emplace_back(points[2 * p], points[2 * p + 1]);
  }
  clip.validate(in.name());
  for (const auto& c : clip.contacts)
    if (c[0] > 1 || c[1] > 1) in.refuse(clip_object(info), "a contact other than 0 and 1");
  return clip;
}

ArchiveReader::ArchiveReader(const std::string& path, Caching caching) : state_(std::make_unique<State>(path, caching)) {}
ArchiveReader::~ArchiveReader() = default;

const ArchiveHeader& ArchiveReader::header() const { return state_->header; }
std::size_t ArchiveReader::size() const { return state_->clips.size(); }
const ClipInfo& ArchiveReader::info(std::size_t i) const { return state_->clips.at(i); }
std::string ArchiveReader::digest() const { return state_->digest; }
std::string ArchiveReader::file_sha256() const { return state_->in.file_sha256(); }
const std::string& ArchiveReader::name() const { return state_->in.name(); }

Clip ArchiveReader::read(std::size_t i) const {
  if (i >= size()) throw Error(Exit::internal, {name(), 0, {}}, "clip " + std::to_string(i) + " of " + std::to_string(size()));
  return state_->assemble(i, state_->read_raw(i));
}

std::string probe(const std::string& path) {
  if (path == "-") return {};
  try {
    const h5::Reader in(path, "motion archive or model file");
    const std::string format = in.text_attribute("format").value_or("");
    return format == kMotionFormat || format == kModelFormat ? format : std::string();
  } catch (const Error&) {
    return {};
  }
}

}  // namespace mocap::store
