#include "libmocap/draw/sides.hpp"

#include <algorithm>
#include <cctype>

#include "libmocap/skeleton/joint_map.hpp"

namespace mocap::draw {
namespace {

bool is_upper(char c) { return std::isupper(static_cast<unsigned char>(c)) != 0; }
bool is_letter(char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0; }
char lower(char c) { return static_cast<char>(std::tolower(static_cast<unsigned char>(c))); }

// "mixamorig:LeftUpLeg" -> mixamorig, left, up, leg
std::vector<std::string> words_of(std::string_view name) {
  std::vector<std::string> words;
  for (std::size_t i = 0; i < name.size(); ++i) {
    if (!is_letter(name[i])) continue;
    const bool starts = i == 0 || !is_letter(name[i - 1]) || (is_upper(name[i]) && !is_upper(name[i - 1]));
    if (starts) words.emplace_back();
    words.back() += lower(name[i]);
  }
  return words;
}

}  // namespace

Side side_of_name(std::string_view name) {
  const auto words = words_of(name);
  for (const auto& w : words) {
    if (w == "l" || w.starts_with("left")) return Side::left;
    if (w == "r" || w.starts_with("right")) return Side::right;
  }
  for (const auto& w : words)
    for (const char* limb : {"hip",    "thigh",    "femur", "upleg", "leg",   "knee", "tibia",  "shin",  "calf",    "ankle",   "foot",
                             "toe",    "clavicle", "collar", "shoulder", "shldr", "scapula", "humerus", "arm", "uparm", "elbow", "radius",
                             "ulna",   "forearm",  "wrist", "hand",  "finger", "thumb", "buttock", "heel"})
      if (std::string_view(w).substr(1).starts_with(limb) && (w[0] == 'l' || w[0] == 'r')) return w[0] == 'l' ? Side::left : Side::right;
  return Side::trunk;
}

Anatomy anatomy_of(const Skeleton& s) {
  Anatomy a;
  a.with_roles = s;
  const JointMap map = map_to_canonical(s);
  for (const char* role : {"left_hip", "right_hip", "left_shoulder", "right_shoulder", "left_foot", "right_foot", "left_ankle", "right_ankle", "head"})
    if (const int j = map.source_of(role); s.find_role(role) < 0 && j >= 0) a.with_roles.roles[role] = s.joint_names[static_cast<std::size_t>(j)];
  a.head = a.with_roles.find_role("head");
  a.left_foot = a.with_roles.find_role("left_foot");
  a.right_foot = a.with_roles.find_role("right_foot");

  const std::size_t n = s.parents.size();
  a.sides.resize(n);
  a.limbs.resize(n);
  for (const auto& [role, joint] : s.roles)
    if (const int j = s.find(joint); j >= 0 && side_of_name(role) != Side::trunk) a.sides[static_cast<std::size_t>(j)] = side_of_name(role);
  int limbs = 0;
  for (std::size_t j = 0; j < n; ++j) {
    const auto p = static_cast<std::size_t>(std::max(0, s.parents[j]));
    if (a.sides[j] == Side::trunk) a.sides[j] = side_of_name(s.joint_names[j]);
    if (a.sides[j] == Side::trunk && j > 0) a.sides[j] = a.sides[p];
    if (a.sides[j] != Side::trunk) a.limbs[j] = j > 0 && a.sides[p] == a.sides[j] ? a.limbs[p] : ++limbs;
  }
  return a;
}

}  // namespace mocap::draw
