#include "libmocap/store/common_parts.hpp"

#include <bit>
#include <nlohmann/json.hpp>

#include "libmocap/base/error.hpp"
#include "libmocap/base/utf8.hpp"

namespace mocap::store {
namespace {

static_assert(std::endian::native == std::endian::little, "archives and digests are little-endian; this build would have to swap bytes");

std::vector<float> flat(const Vector3& v) { return {static_cast<float>(v.x()) + 0.0f, static_cast<float>(v.y()) + 0.0f, static_cast<float>(v.z()) + 0.0f}; }

void append(std::vector<float>& out, const Vector3& v) {
  for (const float f : flat(v)) out.push_back(f);
}

Vector3 vector3(const std::vector<float>& v, std::size_t row) { return Eigen::Vector3f(v[3 * row], v[3 * row + 1], v[3 * row + 2]).cast<double>(); }

}  // namespace

void require_text(const std::string& text, const Where& where) {
  if (!is_utf8(text)) refuse(where, "is not UTF-8 text");
  if (text.find('\0') != std::string::npos) refuse(where, "a NUL character inside a text");
}

void write_skeleton(h5::Writer& out, const Skeleton& s, const std::string& file) {
  for (const auto& name : s.joint_names) require_text(name, {file, 0, "joint " + name});
  std::vector<float> offsets, tips;
  std::vector<std::int32_t> tip_parents;
  std::vector<std::string> roles;
  for (const auto& v : s.rest_offsets) append(offsets, v);
  for (const auto& e : s.end_sites) {
    append(tips, e.offset);
    tip_parents.push_back(e.parent);
  }
  for (const auto& [role, joint] : s.roles) {
    require_text(role, {file, 0, "role " + role});
    roles.insert(roles.end(), {role, joint});
  }
  out.strings("/skeleton/joint_names", s.joint_names);
  out.values("/skeleton/parents", std::vector<std::int32_t>(s.parents.begin(), s.parents.end()));
  out.values("/skeleton/rest_offsets", offsets, {s.rest_offsets.size(), 3});
  out.strings("/skeleton/roles", roles, {s.roles.size(), 2});
  out.values("/skeleton/end_sites", tips, {s.end_sites.size(), 3});
  out.values("/skeleton/end_parents", tip_parents);
}

std::shared_ptr<const Skeleton> read_skeleton(const h5::Reader& in) {
  auto s = std::make_shared<Skeleton>();
  const auto parents = in.values<std::int32_t>("/skeleton/parents", {h5::kAny});
  const std::size_t joints = parents.size();
  s->parents.assign(parents.begin(), parents.end());
  s->joint_names = in.strings("/skeleton/joint_names", {joints});
  const auto offsets = in.values<float>("/skeleton/rest_offsets", {joints, 3});
  for (std::size_t j = 0; j < joints; ++j) s->rest_offsets.push_back(vector3(offsets, j));
  const auto tip_parents = in.values<std::int32_t>("/skeleton/end_parents", {h5::kAny});
  const auto tips = in.values<float>("/skeleton/end_sites", {tip_parents.size(), 3});
  for (std::size_t e = 0; e < tip_parents.size(); ++e) s->end_sites.push_back({tip_parents[e], vector3(tips, e)});
  const auto roles = in.strings("/skeleton/roles", {h5::kAny, 2});
  for (std::size_t r = 0; r + 1 < roles.size(); r += 2)
    if (!s->roles.emplace(roles[r], roles[r + 1]).second) in.refuse("skeleton/roles", "role " + roles[r] + " occurs twice");
  s->validate(in.name());
  return s;
}

void write_history(h5::Writer& out, const History& history) { out.bytes("/history", to_json_lines(history)); }

History read_history(const h5::Reader& in) { return parse_history(in.bytes("/history"), in.name()); }

std::string format_complete(const std::string& counted, const Complete& complete) {
  return nlohmann::ordered_json{{counted, complete.count}, {"digest", complete.digest}}.dump();
}

Complete parse_complete(const h5::Reader& in, const std::string& json, const std::string& counted) {
  try {
    const auto j = nlohmann::json::parse(json);
    return {j.at(counted).get<std::uint64_t>(), j.at("digest").get<std::string>()};
  } catch (const nlohmann::json::exception&) {
    in.refuse("attribute complete", "'" + json + "', expected {\"" + counted + "\": N, \"digest\": \"...\"}");
  }
}

void hash_number(Sha256& hash, double value) { hash.update(&value, sizeof value); }
void hash_number(Sha256& hash, std::int32_t value) { hash.update(&value, sizeof value); }

void hash_text(Sha256& hash, const std::string& text) {
  hash_number(hash, static_cast<std::int32_t>(text.size()));
  hash.update(text);
}

void hash_skeleton(Sha256& hash, const Skeleton& s) {
  hash_number(hash, static_cast<std::int32_t>(s.parents.size()));
  for (const auto& name : s.joint_names) hash_text(hash, name);
  for (const int p : s.parents) hash_number(hash, static_cast<std::int32_t>(p));
  std::vector<float> offsets;
  for (const auto& v : s.rest_offsets) append(offsets, v);
  hash_number(hash, static_cast<std::int32_t>(s.end_sites.size()));
  for (const auto& e : s.end_sites) {
    hash_number(hash, static_cast<std::int32_t>(e.parent));
    append(offsets, e.offset);
  }
  hash.update(offsets.data(), offsets.size() * sizeof(float));
}

}  // namespace mocap::store
