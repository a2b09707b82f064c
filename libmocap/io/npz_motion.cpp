#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "libmocap/base/error.hpp"
#include "libmocap/io/bvh.hpp"
#include "libmocap/io/npy_header.hpp"
#include "libmocap/io/npz.hpp"
#include "libmocap/skeleton/canonical_body.hpp"

namespace mocap::io {
namespace {

constexpr std::size_t kBodyColumns = 66, kSmplhColumns = 156, kSmplxColumns = 165, kShapes = 16;

using Doubles = std::vector<double>;
using Integers = std::vector<std::int64_t>;
using Texts = std::vector<std::string>;

void put(Doubles& to, const Vector3& v) { to.insert(to.end(), {v.x(), v.y(), v.z()}); }
NpyArray scalar(double v) { return {{}, Doubles{v}}; }
NpyArray scalar(std::string v) { return {{}, Texts{std::move(v)}}; }

std::string gender_of(const Clip& clip) {
  const auto it = clip.attributes.find("gender");
  return it == clip.attributes.end() || it->second.empty() ? "neutral" : it->second;
}

Npz common_members(const Clip& clip, const History& history) {
  Npz out;
  out["mocap_framerate"] = scalar(clip.frame_rate_hz);
  out["gender"] = scalar(gender_of(clip));
  out["betas"] = {{kShapes}, Doubles(kShapes, 0.0)};
  out["history"] = scalar(to_json_lines(history));
  return out;
}

// What a file of these members lacks to be a motion, "" for nothing.
std::string missing(const std::function<bool(const char*)>& has) {
  if (!has("poses") && !(has("root_orient") && has("pose_body")))
    return has("betas") ? "no poses: a shape file" : "no poses";
  return has("trans") ? "" : "no trans: poses without a root position";
}

// Members of a file read, with what went wrong said by member.
class Members {
 public:
  explicit Members(std::string_view bytes)
      : npz_(parse_npz(bytes, {"poses", "trans", "mocap_framerate", "mocap_frame_rate", "gender", "betas",
                               "joint_names", "parents", "rest_offsets", "end_sites", "end_parents", "translations",
                               "history", "surface_model_type", "root_orient", "pose_body"})) {}

  bool has(const std::string& name) const { return npz_.contains(name); }

  // A float or integer array of the given shape; npos leaves a dimension open.
  static constexpr std::size_t npos = static_cast<std::size_t>(-1);
  Doubles numbers(const std::string& name, const std::vector<std::size_t>& shape) const {
    const NpyArray& a = shaped(name, shape);
    if (const auto* d = std::get_if<Doubles>(&a.data)) {
      for (std::size_t i = 0; i < d->size(); ++i)
        if (!std::isfinite((*d)[i]))
          refuse({{}, 0, name},
                 "a value that is not finite" +
                     (a.shape.empty() ? std::string() : " in row " + std::to_string(i / (d->size() / a.shape[0]))) +
                     ", expected finite numbers");
      return *d;
    }
    if (const auto* n = std::get_if<Integers>(&a.data)) return Doubles(n->begin(), n->end());
    refuse({{}, 0, name}, "an array of texts, expected numbers");
  }
  std::vector<Vector3> vectors(const std::string& name, const std::vector<std::size_t>& shape) const {
    const Doubles d = numbers(name, shape);
    std::vector<Vector3> v;
    v.reserve(d.size() / 3);
    for (std::size_t i = 0; i + 2 < d.size(); i += 3) v.emplace_back(d[i], d[i + 1], d[i + 2]);
    return v;
  }
  std::vector<int> indices(const std::string& name, std::size_t count, std::size_t below) const {
    const auto* n = std::get_if<Integers>(&shaped(name, {count}).data);
    if (!n) refuse({{}, 0, name}, "an array that is not of whole numbers, expected joint numbers");
    std::vector<int> out;
    for (const std::int64_t i : *n) {
      if (i < -1 || i >= static_cast<std::int64_t>(below))
        refuse({{}, 0, name}, "joint number " + std::to_string(i) + ", expected -1 to " + std::to_string(below - 1));
      out.push_back(static_cast<int>(i));
    }
    return out;
  }
  Texts texts(const std::string& name, const std::vector<std::size_t>& shape) const {
    const auto* t = std::get_if<Texts>(&shaped(name, shape).data);
    if (!t) refuse({{}, 0, name}, "an array of numbers, expected texts");
    return *t;
  }
  // 0-d, or one value in any number of dimensions.
  std::string text(const std::string& name) const {
    const auto* t = std::get_if<Texts>(&at(name).data);
    if (!t || t->size() != 1)
      refuse({{}, 0, name}, "shape " + shape_text(at(name).shape) + " or not a text, expected one text");
    return t->front();
  }
  double rate() const {
    for (const char* key : {"mocap_framerate", "mocap_frame_rate"}) {
      if (!has(key)) continue;
      const Doubles d = numbers(key, at(key).shape);
      if (d.size() != 1 || !(d[0] > 0))
        refuse({{}, 0, key}, "shape " + shape_text(at(key).shape) +
                                 (d.empty() ? std::string() : fmt::format(", value {}", d[0])) +
                                 ", expected one number above 0");
      return d[0];
    }
    refuse({}, "no mocap_framerate or mocap_frame_rate: not a motion file");
  }
  // Rows and columns of `poses`; of root_orient and pose_body side by side where they stand for it.
  std::pair<std::size_t, std::size_t> pose_shape() const {
    if (const std::string why = missing([&](const char* name) { return has(name); }); !why.empty())
      refuse({}, why + ", expected a motion");
    if (!has("poses")) {
      const auto& root = at("root_orient").shape;
      if (root.size() != 2 || root[1] != 3)
        refuse({{}, 0, "root_orient"}, "shape " + shape_text(root) + ", expected (frames, 3)");
      if (root[0] == 0) refuse({{}, 0, "root_orient"}, "0 frames, expected at least one");
      return {root[0], kBodyColumns};
    }
    const auto& shape = at("poses").shape;
    if (shape.size() != 2) refuse({{}, 0, "poses"}, "shape " + shape_text(shape) + ", expected (frames, 3 x joints)");
    if (shape[0] == 0) refuse({{}, 0, "poses"}, "0 frames, expected at least one");
    return {shape[0], shape[1]};
  }

  const NpyArray& at(const std::string& name) const {
    const auto it = npz_.find(name);
    if (it == npz_.end()) refuse({}, "no " + name + ", expected it beside poses");
    return it->second;
  }

 private:
  const NpyArray& shaped(const std::string& name, const std::vector<std::size_t>& shape) const {
    const NpyArray& a = at(name);
    bool fits = a.shape.size() == shape.size();
    for (std::size_t i = 0; fits && i < shape.size(); ++i) fits = shape[i] == npos || shape[i] == a.shape[i];
    if (!fits) {
      std::string expected = "(";
      for (std::size_t i = 0; i < shape.size(); ++i)
        expected += (i ? ", " : "") + (shape[i] == npos ? std::string("any") : std::to_string(shape[i]));
      refuse({{}, 0, name},
             "shape " + shape_text(a.shape) + ", expected " + expected + (shape.size() == 1 ? ",)" : ")"));
    }
    return a;
  }

  Npz npz_;
};

// Columns 0 .. 3 joints of poses, axis-angle.
std::vector<Quaternion> rotations_of(const Doubles& poses, std::size_t frames, std::size_t columns,
                                     std::size_t joints) {
  std::vector<Quaternion> out;
  out.reserve(frames * joints);
  for (std::size_t t = 0; t < frames; ++t)
    for (std::size_t j = 0; j < joints; ++j) {
      const double* v = poses.data() + t * columns + 3 * j;
      // Beyond a million radians an axis-angle has lost its angle: a damaged file.
      if (!(std::abs(v[0]) < 1e6 && std::abs(v[1]) < 1e6 && std::abs(v[2]) < 1e6))
        refuse({{}, 0, "poses"}, "frame " + std::to_string(t) + " turns joint " + std::to_string(j) +
                                     " by more than 1e6 rad, expected an axis-angle in radians");
      out.push_back(exp_map(Vector3(v[0], v[1], v[2])));
    }
  return out;
}

Clip read_source(const Members& in, std::size_t frames, std::size_t columns) {
  Skeleton s;
  s.joint_names = in.texts("joint_names", {Members::npos});
  const std::size_t joints = s.joint_names.size();
  if (columns != 3 * joints)
    refuse({{}, 0, "poses"}, std::to_string(columns) + " columns, expected 3 x " + std::to_string(joints) + " joints");
  s.parents = in.indices("parents", joints, joints);
  s.rest_offsets = in.vectors("rest_offsets", {joints, 3});
  if (in.has("end_sites")) {
    const auto tips = in.vectors("end_sites", {Members::npos, 3});
    const auto parents = in.indices("end_parents", tips.size(), joints);
    for (std::size_t e = 0; e < tips.size(); ++e) s.end_sites.push_back({parents[e], tips[e]});
  }
  s.validate();
  Clip clip;
  clip.skeleton = std::make_shared<const Skeleton>(std::move(s));
  clip.rotations = rotations_of(in.numbers("poses", {frames, columns}), frames, columns, joints);
  clip.root_position = in.vectors("trans", {frames, 3});
  if (in.has("translations")) clip.translations = in.vectors("translations", {frames, joints, 3});
  clip.frame_rate_hz = in.rate();
  return clip;
}

// SMPL axes to canonical ones, (x,y,z) -> (z,x,y): a third of a turn about (1,1,1).
const Quaternion kSmplAxes(0.5, 0.5, 0.5, 0.5);

// [N, columns]: `poses`, or root_orient and pose_body side by side.
Doubles amass_poses(const Members& in, std::size_t frames, std::size_t columns) {
  if (in.has("poses")) return in.numbers("poses", {frames, columns});
  const Doubles root = in.numbers("root_orient", {frames, 3}), body = in.numbers("pose_body", {frames, kBodyColumns - 3});
  Doubles out;
  out.reserve(frames * kBodyColumns);
  for (std::size_t t = 0; t < frames; ++t) {
    const auto row = [&](const Doubles& d, std::size_t width) {
      const auto begin = d.begin() + static_cast<std::ptrdiff_t>(t * width);
      out.insert(out.end(), begin, begin + static_cast<std::ptrdiff_t>(width));
    };
    row(root, 3);
    row(body, kBodyColumns - 3);
  }
  return out;
}

// One shape for the clip: (B,), (1,B), or of (N,B) the first row.
Doubles betas_of(const Members& in) {
  if (!in.has("betas")) return {};
  const auto& shape = in.at("betas").shape;
  Doubles betas = in.numbers("betas", shape);
  if (shape.size() > 1 && betas.size() > shape.back()) betas.resize(shape.back());
  return betas;
}

Clip read_amass(const Members& in, std::size_t frames, std::size_t columns, const BodyModel* model) {
  Clip clip;
  clip.skeleton = canonical_body();
  Vector3 rest_pelvis = kSmplPelvis;
  if (model) {
    const auto rest = model->joints(betas_of(in));
    clip.skeleton = skeleton_of(rest);
    rest_pelvis = rest[0];
  }
  const std::size_t joints = kBodyColumns / 3;
  clip.rotations = rotations_of(amass_poses(in, frames, columns), frames, columns, joints);
  for (std::size_t t = 0; t < frames; ++t) {
    Quaternion* const q = clip.rotations.data() + t * joints;
    q[0] = q[0] * kSmplAxes.conjugate();
    for (std::size_t j = 1; j < joints; ++j) q[j] = Quaternion(q[j].w(), q[j].z(), q[j].x(), q[j].y());
  }
  clip.root_position = in.vectors("trans", {frames, 3});
  for (Vector3& p : clip.root_position) p += rest_pelvis;
  const double rate = in.rate();
  clip.frame_rate_hz = snap_frame_rate(1 / rate, 1e-6 / rate);
  return clip;
}

}  // namespace

Npz to_source_layout(const Clip& clip, const History& history) {
  const Skeleton& s = *clip.skeleton;
  const std::size_t joints = s.parents.size(), frames = clip.frames();
  Npz out = common_members(clip, history);
  out["mocap_frame_rate"] = scalar(clip.frame_rate_hz);
  Doubles poses, trans, offsets, tips;
  poses.reserve(clip.rotations.size() * 3);
  trans.reserve(frames * 3);
  for (const Quaternion& q : clip.rotations) put(poses, log_map(q));
  for (const Vector3& p : clip.root_position) put(trans, p);
  for (const Vector3& o : s.rest_offsets) put(offsets, o);
  Integers tip_parents;
  for (const auto& e : s.end_sites) {
    put(tips, e.offset);
    tip_parents.push_back(e.parent);
  }
  out["poses"] = {{frames, 3 * joints}, std::move(poses)};
  out["trans"] = {{frames, 3}, std::move(trans)};
  out["joint_names"] = {{joints}, s.joint_names};
  out["parents"] = {{joints}, Integers(s.parents.begin(), s.parents.end())};
  out["rest_offsets"] = {{joints, 3}, std::move(offsets)};
  out["end_sites"] = {{s.end_sites.size(), 3}, std::move(tips)};
  out["end_parents"] = {{s.end_sites.size()}, std::move(tip_parents)};
  if (!clip.translations.empty()) {
    Doubles moved;
    moved.reserve(clip.translations.size() * 3);
    for (const Vector3& p : clip.translations) put(moved, p);
    out["translations"] = {{frames, joints, 3}, std::move(moved)};
  }
  return out;
}

Npz to_amass_layout(const Clip& clip, const History& history) {
  const Skeleton& body = *canonical_body();
  if (clip.skeleton->joint_names != body.joint_names || clip.skeleton->parents != body.parents)
    refuse({},
           "a clip of " + std::to_string(clip.joints()) +
               " joints that are not the canonical body's 22, expected the canonical body",
           "canonicalize brings clips onto it");
  if (!clip.translations.empty())
    refuse({}, "joints that change their distance to the parent, which the AMASS layout cannot hold");
  const std::size_t joints = kBodyColumns / 3, frames = clip.frames();
  Npz out = common_members(clip, history);
  Doubles poses, trans;
  poses.reserve(frames * kSmplhColumns);
  trans.reserve(frames * 3);
  for (std::size_t t = 0; t < frames; ++t) {
    put(poses, log_map(clip.rotations[t * joints] * kSmplAxes));
    for (std::size_t j = 1; j < joints; ++j) {
      const Vector3 v = log_map(clip.rotations[t * joints + j]);
      put(poses, Vector3(v.y(), v.z(), v.x()));
    }
    poses.resize((t + 1) * kSmplhColumns, 0.0);
    put(trans, clip.root_position[t] - kSmplPelvis);
  }
  out["poses"] = {{frames, kSmplhColumns}, std::move(poses)};
  out["trans"] = {{frames, 3}, std::move(trans)};
  return out;
}

std::string why_no_motion(const std::string& path) {
  const auto members = npz_members(path);
  if (!members) return {};  // damaged or packed: whoever reads it will say
  if (members->empty()) return "a zip file without arrays";
  return missing([&](const char* name) { return members->contains(name); });
}

NpzMotion parse_motion_npz(std::string_view bytes, const BodyModel* model) {
  const Members in(bytes);
  const auto [frames, columns] = in.pose_shape();
  NpzMotion out;
  if (in.has("joint_names")) {
    out.clip = read_source(in, frames, columns);
    out.release = "source";
  } else if (!in.has("poses") || columns == kSmplhColumns || columns == kSmplxColumns) {
    out.clip = read_amass(in, frames, columns, model);
    const bool smplx = in.has("poses") ? columns == kSmplxColumns
                                       : !in.has("surface_model_type") || in.text("surface_model_type") == "smplx";
    out.release = smplx ? "SMPL-X" : "SMPL+H";
  } else {
    refuse({{}, 0, "poses"},
           std::to_string(columns) + " columns and no joint_names, expected 156 (SMPL+H) or 165 (SMPL-X)");
  }
  if (in.has("gender"))
    if (const std::string gender = in.text("gender"); !gender.empty() && gender != "neutral")
      out.clip.attributes["gender"] = gender;
  if (in.has("history")) out.history = parse_history(in.text("history"), {});
  make_sign_continuous(out.clip);
  out.clip.validate();
  return out;
}

}  // namespace mocap::io
