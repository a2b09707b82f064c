#include "libmocap/store/archive_set.hpp"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <unordered_map>
#include <unordered_set>

#include "libmocap/base/error.hpp"

namespace mocap::store {
namespace {

// What makes `s` another skeleton than `expected`, which `of` has; "" where nothing does.
std::string difference(const Skeleton& s, const Skeleton& expected, const std::string& of) {
  if (s.joint_count() != expected.joint_count()) return fmt::format("{} joints, expected the {} of {}", s.joint_count(), expected.joint_count(), of);
  for (std::size_t j = 0; j < s.parents.size(); ++j) {
    if (s.joint_names[j] != expected.joint_names[j]) return fmt::format("joint {} is '{}', expected '{}' as in {}", j, s.joint_names[j], expected.joint_names[j], of);
    if (s.parents[j] != expected.parents[j])
      return fmt::format("joint {} hangs on '{}', expected '{}' as in {}", s.joint_names[j], s.joint_names[static_cast<std::size_t>(std::max(s.parents[j], 0))],
                         s.joint_names[static_cast<std::size_t>(std::max(expected.parents[j], 0))], of);
  }
  if (s.end_sites.size() != expected.end_sites.size()) return fmt::format("{} end sites, expected the {} of {}", s.end_sites.size(), expected.end_sites.size(), of);
  double worst = 1e-6;
  std::string where;
  const auto compare = [&](const Vector3& a, const Vector3& b, const std::string& what) {
    if (const double d = (a - b).norm(); d > worst) {
      worst = d;
      where = what;
    }
  };
  for (std::size_t j = 0; j < s.parents.size(); ++j) compare(s.rest_offsets[j], expected.rest_offsets[j], "joint " + s.joint_names[j]);
  for (std::size_t e = 0; e < s.end_sites.size(); ++e) {
    const std::string& on = s.joint_names[static_cast<std::size_t>(s.end_sites[e].parent)];
    if (s.end_sites[e].parent != expected.end_sites[e].parent)
      return fmt::format("end site {} is on '{}', expected '{}' as in {}", e, on, expected.joint_names[static_cast<std::size_t>(expected.end_sites[e].parent)], of);
    compare(s.end_sites[e].offset, expected.end_sites[e].offset, "the end site of " + on);
  }
  if (!where.empty()) return fmt::format("{} lies {:.3g} mm elsewhere at rest, expected the skeleton of {}", where, 1000 * worst, of);
  for (const auto& [role, joint] : s.roles)
    if (const auto other = expected.roles.find(role); other != expected.roles.end() && other->second != joint)
      return fmt::format("role {} is '{}', expected '{}' as in {}", role, joint, other->second, of);
  return {};
}

std::string contacts_text(const std::string& rule) { return rule.empty() ? "no contacts" : "contacts by " + rule; }

}  // namespace

ArchiveSet::ArchiveSet(const std::vector<std::string>& paths) {
  if (paths.empty()) throw Error(Exit::internal, {}, "a set of no archives");
  std::map<std::pair<dev_t, ino_t>, std::string> seen;
  for (const auto& path : paths) {
    struct stat s {};
    if (path != "-" && ::stat(path.c_str(), &s) == 0) {
      const auto [first, fresh] = seen.emplace(std::pair{s.st_dev, s.st_ino}, path);
      if (!fresh) refuse({path, 0, {}}, first->second == path ? "given twice, expected each archive once" : "the same file as " + first->second + ", expected each archive once");
    }
    archives_.push_back(std::make_unique<ArchiveReader>(path, paths.size() > 4 ? Caching::in_order : Caching::random));
    const ArchiveReader& in = *archives_.back();
    const ArchiveHeader& h = in.header();
    if (archives_.size() == 1) {
      header_ = h;
      header_.history.clear();
      continue;
    }
    const std::string& of = archives_.front()->name();
    if (const auto why = difference(*h.skeleton, *header_.skeleton, of); !why.empty()) refuse({in.name(), 0, "skeleton"}, why, "canonicalize brings archives to one body");
    if (std::abs(h.frame_rate_hz - header_.frame_rate_hz) > 1e-9 * header_.frame_rate_hz)
      refuse({in.name(), 0, {}}, fmt::format("{} Hz, expected the {} Hz of {}", h.frame_rate_hz, header_.frame_rate_hz, of), "canonicalize --fps brings archives to one rate");
    if (h.contacts_rule != header_.contacts_rule)
      refuse({in.name(), 0, {}}, fmt::format("{}, expected {} as in {}", contacts_text(h.contacts_rule), contacts_text(header_.contacts_rule), of),
             "canonicalize --contacts labels archives by one rule");
    header_.attributes.insert(h.attributes.begin(), h.attributes.end());
    header_.segment_attributes.insert(h.segment_attributes.begin(), h.segment_attributes.end());
    for (const auto& [name, classes] : h.attribute_classes) {
      auto& known = header_.attribute_classes[name];
      for (const auto& value : classes)
        if (std::find(known.begin(), known.end(), value) == known.end()) known.push_back(value);
    }
    auto skeleton = std::make_shared<Skeleton>(*header_.skeleton);
    skeleton->roles.insert(h.skeleton->roles.begin(), h.skeleton->roles.end());
    header_.skeleton = std::move(skeleton);
  }
  refuse_repeated();
}

void ArchiveSet::refuse_repeated() const {
  std::unordered_map<std::string, std::size_t> seen;  // name and digest -> archive
  for (std::size_t a = 0; a < size(); ++a)
    for (std::size_t i = 0; i < archive(a).size(); ++i) {
      const ClipInfo& clip = archive(a).info(i);
      const auto [first, fresh] = seen.emplace(clip.name + '\0' + clip.digest, a);
      if (!fresh) refuse({archive(a).name(), 0, "clip " + clip.name}, "the very clip that " + archive(first->second).name() + " holds, expected each once", "was a shard given twice?");
    }
}

std::vector<ArchiveSet::Item> ArchiveSet::items() const {
  std::vector<Item> out;
  std::unordered_set<std::string> taken;
  for (std::size_t a = 0; a < size(); ++a)
    for (std::size_t i = 0; i < archive(a).size(); ++i) {
      const std::string& own = archive(a).info(i).name;
      Item item{a, i, own};
      for (int n = 2; !taken.insert(item.name).second; ++n) item.name = fmt::format("{}#{}", own, n);
      out.push_back(std::move(item));
    }
  return out;
}

std::vector<ArchiveSet::Item> ArchiveSet::items_of_shards() const {
  std::vector<Item> out;
  for (std::size_t a = 0; a < size(); ++a) {
    std::unordered_set<std::string> names;
    for (std::size_t i = 0; i < archive(a).size(); ++i) {
      const std::string& own = archive(a).info(i).name;
      const auto mark = own.rfind('#');
      const bool numbered = mark != std::string::npos && mark + 1 < own.size() && own[mark + 1] != '0' &&
                            std::all_of(own.begin() + static_cast<std::ptrdiff_t>(mark) + 1, own.end(), [](char c) { return c >= '0' && c <= '9'; });
      out.push_back({a, i, numbered && names.contains(own.substr(0, mark)) ? own.substr(0, mark) : own});
      names.insert(own);
    }
  }
  std::stable_sort(out.begin(), out.end(), [&](const Item& x, const Item& y) { return source_order(info(x).source, info(y).source); });
  std::unordered_set<std::string> taken;
  for (Item& item : out) {
    const std::string base = item.name;
    for (int n = 2; !taken.insert(item.name).second; ++n) item.name = fmt::format("{}#{}", base, n);
  }
  return out;
}

Clip ArchiveSet::read(const Item& item) const {
  Clip clip = archive(item.archive).read(item.clip);
  clip.name = item.name;
  // The writer compares skeletons by identity first.
  clip.skeleton = header_.skeleton;
  return clip;
}

}  // namespace mocap::store
