#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <tuple>
#include <unordered_set>
#include <utility>

#include "libmocap/base/error.hpp"
#include "libmocap/store/archive.hpp"
#include "libmocap/store/common_parts.hpp"
#include "libmocap/store/frames.hpp"
#include "libmocap/store/hdf5.hpp"

namespace mocap::store {
namespace {

using Column = std::vector<std::string>;

// One column of text per attribute name; rows without the attribute are "".
class AttributeTable {
 public:
  void add(const Attributes& attributes) {
    for (const auto& [name, value] : attributes) {
      Column& column = columns_[name];
      column.resize(rows_);
      column.push_back(value);
    }
    ++rows_;
  }
  // `always`: columns that are written even where no row has the attribute.
  void write(h5::Writer& out, const std::string& group, const std::set<std::string>& always) {
    out.group(group);
    for (const auto& name : always) columns_.try_emplace(name);
    for (auto& [name, column] : columns_) {
      column.resize(rows_);
      out.strings(group + "/" + h5::escape_link(name), column);
    }
  }

 private:
  std::size_t rows_ = 0;
  std::map<std::string, Column> columns_;
};

bool fits_float(const Vector3& v) { return (v.array().abs() <= static_cast<double>(std::numeric_limits<float>::max())).all(); }

void require_attributes(const Attributes& attributes, const Where& where) {
  for (const auto& [name, value] : attributes) {
    if (name.empty()) refuse(where, "an attribute without a name");
    require_text(name, {where.file, 0, where.object + " attribute " + name});
    require_text(value, {where.file, 0, where.object + " attribute " + name});
  }
}

}  // namespace

struct ArchiveWriter::State {
  State(const std::string& path, Overwrite mode, ArchiveHeader h, int deflate)
      : file(path == "-" ? "<stdout>" : path),
        header(std::move(h)),
        joints(static_cast<std::size_t>(header.skeleton->joint_count())),
        out(path, mode),
        rotations(out, "/frames/rotations", h5::Type::f32, {joints, 4}, chunk_rows(), deflate),
        root_position(out, "/frames/root_position", h5::Type::f32, {3}, chunk_rows(), deflate),
        contacts(out, "/frames/contacts", h5::Type::u8, {2}, chunk_rows(), deflate) {}

  // The same rows for all frame datasets: a clip is in the same chunk of each. A quarter of a megabyte: reading one clip
  // unpacks every chunk that it touches, which should stay well below a millisecond.
  std::uint64_t chunk_rows() const { return std::max<std::uint64_t>(h5::kChunkBytes / 4 / (16 * joints), 1); }

  std::string file;
  ArchiveHeader header;
  std::size_t joints;
  h5::Writer out;
  h5::Rows rotations, root_position, contacts;
  bool finished = false;

  std::unordered_set<std::string> names;
  Column name, source, source_sha256, source_unit, source_up_axis;
  std::vector<std::int64_t> start, length, segment_clip, segment_start, segment_length;
  std::vector<double> source_start, source_end, source_rate, source_scale, source_yaw, source_origin;
  std::vector<std::int32_t> phase;
  std::vector<std::uint8_t> mirrored;
  std::vector<Digest> digests;
  AttributeTable attributes, segment_attributes;
  std::map<std::string, std::vector<float>> probability;  // attribute of the header -> [N,C]

  void require(const Clip& clip) const;
  Digest add_frames(const Clip& clip);
};

// Everything that can be wrong with a clip is found before its first frame is taken.
void ArchiveWriter::State::require(const Clip& clip) const {
  clip.validate(file);
  const Where where{file, 0, "clip " + clip.name};
  if (clip.name.empty()) refuse(where, "a clip without a name");
  require_text(clip.name, where);
  if (names.contains(clip.name)) refuse(where, "the name occurs twice, expected unique names");
  if (clip.skeleton != header.skeleton && !clip.skeleton->same_as(*header.skeleton)) refuse(where, "another skeleton than the archive's, expected one for all clips");
  if (std::abs(clip.frame_rate_hz - header.frame_rate_hz) > 1e-9 * header.frame_rate_hz)
    refuse(where, std::to_string(clip.frame_rate_hz) + " Hz, expected the archive's " + std::to_string(header.frame_rate_hz) + " Hz");
  if (!clip.translations.empty()) refuse(where, "joint translations, expected rotations only");
  if (clip.contacts.empty() != header.contacts_rule.empty())
    refuse(where, header.contacts_rule.empty() ? "contacts, expected none: the archive names no rule for them" : "no contacts, expected contacts by rule " + header.contacts_rule);
  for (const auto& c : clip.contacts)
    if (c[0] > 1 || c[1] > 1) refuse(where, "a contact other than 0 and 1");
  for (const Vector3& p : clip.root_position)
    if (!fits_float(p)) refuse(where, "a root position beyond the range of float32");
  for (const Vector2& p : clip.path)
    if (!fits_float({p.x(), p.y(), 0})) refuse(where, "a path beyond the range of float32");
  require_attributes(clip.attributes, where);
  for (const Segment& s : clip.segments) require_attributes(s.attributes, where);
  for (const auto& [name, classes] : clip.attribute_probability)
    for (const auto& [value, p] : classes)
      if (!(p >= 0 && p <= 1)) refuse(where, "probability " + std::to_string(p) + " of " + name + "=" + value + ", expected a number in 0..1");
  require_text(clip.source.path, {file, 0, where.object + " source"});
  if (!clip.source.sha256.empty()) from_hex(clip.source.sha256);
  if (!std::isfinite(clip.source.start_s) || !std::isfinite(clip.source.end_s) || !std::isfinite(clip.source.frame_rate_hz))
    refuse(where, "source times or rate that are not finite");
  require_text(clip.source.unit, {file, 0, where.object + " source unit"});
  require_text(clip.source.up_axis, {file, 0, where.object + " source up axis"});
  if (!(std::isfinite(clip.source.scale) && clip.source.scale > 0))
    refuse(where, "source scale " + std::to_string(clip.source.scale) + ", expected a finite number above 0");
  if (!std::isfinite(clip.source.yaw) || !clip.source.origin.allFinite()) refuse(where, "a source yaw or origin that is not finite");
}

Digest ArchiveWriter::State::add_frames(const Clip& clip) {
  ClipHash hash(header.frame_rate_hz, *header.skeleton);
  const std::size_t frames = clip.frames();
  // Encodes straight into the buffer of the next chunk.
  const auto fill = [&](h5::Rows& rows, std::size_t row_bytes, const auto& encode) {
    for (std::size_t t = 0; t < frames;) {
      std::uint64_t n = 0;
      void* room = rows.space(frames - t, n);
      encode(t, static_cast<std::size_t>(n), room);
      hash.add(room, static_cast<std::size_t>(n) * row_bytes);
      rows.commit(n);
      t += static_cast<std::size_t>(n);
    }
  };
  RotationEncoder encoder(joints);
  fill(rotations, joints * 16, [&](std::size_t t, std::size_t n, void* room) {
    encoder.encode({clip.rotations.data() + t * joints, n * joints}, static_cast<float*>(room));
  });
  fill(root_position, 12, [&](std::size_t t, std::size_t n, void* room) { encode_positions({clip.root_position.data() + t, n}, static_cast<float*>(room)); });
  if (!clip.contacts.empty())
    fill(contacts, 2, [&](std::size_t t, std::size_t n, void* room) { std::copy_n(clip.contacts[t].data(), 2 * n, static_cast<std::uint8_t*>(room)); });
  return hash.finish();
}

ArchiveWriter::ArchiveWriter(const std::string& path, Overwrite mode, ArchiveHeader header, int deflate) {
  const std::string file = path == "-" ? "<stdout>" : path;
  if (!header.skeleton || deflate < 0 || deflate > 9) throw Error(Exit::internal, {file, 0, {}}, "an archive needs a skeleton and a deflate level of 0 to 9");
  header.skeleton->validate(file);
  for (const auto& v : header.skeleton->rest_offsets)
    if (!fits_float(v)) refuse({file, 0, "skeleton"}, "an offset beyond the range of float32");
  for (const auto& e : header.skeleton->end_sites)
    if (!fits_float(e.offset)) refuse({file, 0, "skeleton"}, "an end site beyond the range of float32");
  if (!(std::isfinite(header.frame_rate_hz) && header.frame_rate_hz > 0)) refuse({file, 0, {}}, "frame rate " + std::to_string(header.frame_rate_hz) + ", expected a finite number above 0");
  require_text(header.contacts_rule, {file, 0, "contacts rule"});
  for (const auto* columns : {&header.attributes, &header.segment_attributes})
    for (const auto& name : *columns) require_attributes({{name, ""}}, {file, 0, "header"});
  for (const auto& [name, classes] : header.attribute_classes) {
    const Where where{file, 0, "classes of " + name};
    if (classes.empty()) refuse(where, "none, expected at least one");
    if (std::set<std::string>(classes.begin(), classes.end()).size() != classes.size()) refuse(where, "a class occurs twice, expected each once");
    for (const auto& value : classes) {
      if (value.empty()) refuse(where, "a class without a name");
      require_attributes({{name, value}}, where);
    }
  }

  state_ = std::make_unique<State>(path, mode, std::move(header), deflate);
  State& s = *state_;
  s.out.attribute("format", kMotionFormat);
  s.out.attribute("format_version", kFormatVersion);
  s.out.attribute("frame_rate_hz", s.header.frame_rate_hz);
  s.out.attribute("length_unit", "m");
  s.out.attribute("angle_unit", "rad");
  s.out.attribute("up_axis", "z");
  s.out.attribute("forward_axis", "x");
  s.out.attribute("quaternion_order", "wxyz");
  if (!s.header.contacts_rule.empty()) s.out.attribute("contacts", s.header.contacts_rule);
  write_skeleton(s.out, *s.header.skeleton, file);
}

ArchiveWriter::~ArchiveWriter() = default;

std::size_t ArchiveWriter::size() const { return state_->name.size(); }

void ArchiveWriter::set_history(History history) { state_->header.history = std::move(history); }

void ArchiveWriter::add(const Clip& clip) {
  State& s = *state_;
  if (s.finished) throw Error(Exit::internal, {s.file, 0, {}}, "a clip after the archive was finished");
  s.require(clip);
  const auto row = static_cast<std::int64_t>(s.name.size());
  s.start.push_back(static_cast<std::int64_t>(s.rotations.size()));
  s.length.push_back(static_cast<std::int64_t>(clip.frames()));
  s.digests.push_back(s.add_frames(clip));
  s.names.insert(clip.name);
  s.name.push_back(clip.name);
  s.source.push_back(clip.source.path);
  s.source_sha256.push_back(clip.source.sha256);
  s.source_start.push_back(clip.source.start_s);
  s.source_end.push_back(clip.source.end_s);
  s.source_rate.push_back(clip.source.frame_rate_hz);
  s.phase.push_back(clip.source.phase);
  s.mirrored.push_back(clip.source.mirrored ? 1 : 0);
  s.source_unit.push_back(clip.source.unit);
  s.source_up_axis.push_back(clip.source.up_axis);
  s.source_scale.push_back(clip.source.scale);
  s.source_yaw.push_back(clip.source.yaw);
  for (const double x : clip.source.origin) s.source_origin.push_back(x + 0.0);  // no negative zeros
  s.attributes.add(clip.attributes);
  for (const auto& [name, classes] : s.header.attribute_classes) {
    const auto found = clip.attribute_probability.find(name);
    for (const auto& value : classes) {
      const auto p = found == clip.attribute_probability.end() ? std::map<std::string, float>::const_iterator() : found->second.find(value);
      s.probability[name].push_back(found == clip.attribute_probability.end() || p == found->second.end() ? 0.0f : p->second + 0.0f);
    }
  }
  for (const Segment& segment : clip.segments) {
    s.segment_clip.push_back(row);
    s.segment_start.push_back(segment.start);
    s.segment_length.push_back(segment.length);
    s.segment_attributes.add(segment.attributes);
  }
  if (!clip.path.empty()) {
    std::vector<float> points;
    for (const Vector2& p : clip.path) points.insert(points.end(), {static_cast<float>(p.x()) + 0.0f, static_cast<float>(p.y()) + 0.0f});
    s.out.values("/paths/" + h5::escape_link(clip.name), points, {clip.path.size(), 2});
  }
}

void ArchiveWriter::finish() {
  State& s = *state_;
  if (s.finished) throw Error(Exit::internal, {s.file, 0, {}}, "the archive was finished already");
  if (s.name.empty()) refuse({s.file, 0, {}}, "no clips, expected at least one");
  s.finished = true;
  s.rotations.finish();
  s.root_position.finish();
  if (!s.header.contacts_rule.empty()) s.contacts.finish();

  s.out.strings("/clips/name", s.name);
  s.out.values("/clips/start", s.start);
  s.out.values("/clips/length", s.length);
  s.out.strings("/clips/source", s.source);
  s.out.strings("/clips/source_sha256", s.source_sha256);
  s.out.values("/clips/source_start", s.source_start);
  s.out.values("/clips/source_end", s.source_end);
  s.out.values("/clips/source_frame_rate_hz", s.source_rate);
  s.out.values("/clips/phase", s.phase);
  s.out.values("/clips/mirrored", s.mirrored);
  s.out.strings("/clips/source_unit", s.source_unit);
  s.out.strings("/clips/source_up_axis", s.source_up_axis);
  s.out.values("/clips/source_scale", s.source_scale);
  s.out.values("/clips/source_yaw", s.source_yaw);
  s.out.values("/clips/source_origin", s.source_origin, {s.name.size(), 3});
  s.out.dataset("/clips/digest", h5::Type::u8, {s.digests.size(), 32}, s.digests.data());
  s.attributes.write(s.out, "/clips/attributes", s.header.attributes);
  for (const auto& [name, classes] : s.header.attribute_classes) {
    s.out.strings("/clips/attribute_classes/" + h5::escape_link(name), classes);
    s.out.values("/clips/attribute_probability/" + h5::escape_link(name), s.probability.at(name), {s.name.size(), classes.size()});
  }
  if (!s.segment_clip.empty()) {
    s.out.values("/segments/clip", s.segment_clip);
    s.out.values("/segments/start", s.segment_start);
    s.out.values("/segments/length", s.segment_length);
    s.segment_attributes.write(s.out, "/segments/attributes", s.header.segment_attributes);
  }
  write_history(s.out, s.header.history);
  s.out.finish(format_complete("clips", {s.name.size(), to_hex(combined_digest(s.digests))}));
}

bool source_order(const ClipSource& a, const ClipSource& b) {
  return std::tie(a.path, a.phase, a.mirrored, a.start_s) < std::tie(b.path, b.phase, b.mirrored, b.start_s);
}

}  // namespace mocap::store
