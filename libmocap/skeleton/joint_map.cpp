#include "libmocap/skeleton/joint_map.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <limits>
#include <optional>
#include <set>

#include "libmocap/base/error.hpp"
#include "libmocap/skeleton/canonical_body.hpp"
#include "libmocap/skeleton/joint_names.hpp"

namespace mocap {
namespace {

using Words = std::vector<std::string>;  // sorted

// Spellings of each part, best first. A word that means the clavicle in one convention means the upper arm in another
// ("LeftShoulder"): parts are looked for in the order that settles it.
const std::vector<Words> kThigh = {Words{"thigh"}, Words{"leg", "up"}, Words{"femur"}, Words{"hip"}, Words{"leg"}};
const std::vector<Words> kShank = {Words{"knee"}, Words{"leg", "low"}, Words{"shin"}, Words{"calf"}, Words{"tibia"}, Words{"leg"}};
const std::vector<Words> kAnkle = {Words{"ankle"}, Words{"foot"}};
const std::vector<Words> kToe = {Words{"base", "toe"}, Words{"toe"}, Words{"ball"}, Words{"foot"}};
const std::vector<Words> kUpperArm = {Words{"arm", "up"}, Words{"arm"}, Words{"humerus"}, Words{"shoulder"}};
const std::vector<Words> kCollar = {Words{"collar"}, Words{"clavicle"}, Words{"shoulder"}, Words{"collar", "shoulder"}};
const std::vector<Words> kForearm = {Words{"elbow"}, Words{"arm", "low"}, Words{"radius"}, Words{"ulna"}, Words{"arm"}};
const std::vector<Words> kHand = {Words{"wrist"}, Words{"hand"}};

int canonical_index(std::string_view name) { return canonical_body()->find(name); }

class Finder {
 public:
  explicit Finder(const Skeleton& s) : skeleton_(s), names_(joint_names_of(s)) {
    const std::size_t n = s.parents.size();
    depth_.assign(n, 0);
    place_.assign(n, 0);
    size_.assign(n, 1);
    for (std::size_t j = n; j-- > 1;) size_[static_cast<std::size_t>(s.parents[j])] += size_[j];
    std::vector<int> next(n, 1);
    for (std::size_t j = 1; j < n; ++j) {
      const auto p = static_cast<std::size_t>(s.parents[j]);
      depth_[j] = depth_[p] + 1;
      place_[j] = next[p];
      next[p] += size_[j];
      next[j] = place_[j] + 1;
    }
  }

  // The part on one side, below `above` and none of `taken`: the best spelling, of that the joint nearest to the root that is no
  // helper; of several at one depth (the toes of a foot) the one in their middle.
  int side(Side side, const std::vector<Words>& spellings, int above, std::initializer_list<int> taken = {}) const {
    for (const Words& words : spellings) {
      std::vector<int> found;
      for (int j = 0; j < skeleton_.joint_count(); ++j) {
        const JointName& n = names_[static_cast<std::size_t>(j)];
        if (n.side != side || n.words != words || !below(j, above) || std::find(taken.begin(), taken.end(), j) != taken.end()) continue;
        if (!found.empty() && rank(j) > rank(found.front())) continue;
        if (!found.empty() && rank(j) < rank(found.front())) found.clear();
        found.push_back(j);
      }
      if (!found.empty()) return middle(found);
    }
    return -1;
  }
  // A joint without side, by words: the best spelling, of that the joint nearest to the root.
  int centre(const std::vector<Words>& spellings) const {
    for (const Words& words : spellings)
      if (const int j = nearest({words}); j >= 0) return j;
    return -1;
  }
  // The one nearest to the root (or farthest from it) of all that are spelt so.
  int nearest(const std::vector<Words>& spellings, bool farthest = false) const {
    int best = -1;
    for (int j = 0; j < skeleton_.joint_count(); ++j) {
      const JointName& n = names_[static_cast<std::size_t>(j)];
      if (n.side != Side::none || std::find(spellings.begin(), spellings.end(), n.words) == spellings.end()) continue;
      if (best < 0 || (farthest ? depth(j) > depth(best) : rank(j) < rank(best))) best = j;
    }
    return best;
  }

  bool below(int joint, int ancestor) const {
    if (ancestor < 0) return true;
    const auto j = static_cast<std::size_t>(joint), a = static_cast<std::size_t>(ancestor);
    return place_[j] > place_[a] && place_[j] < place_[a] + size_[a];
  }
  int common_ancestor(int a, int b) const {
    if (a < 0 || b < 0) return -1;
    while (a != b) (depth(a) >= depth(b) ? a : b) = parent(depth(a) >= depth(b) ? a : b);
    return a;
  }
  int parent(int j) const { return skeleton_.parents[static_cast<std::size_t>(j)]; }
  int depth(int j) const { return depth_[static_cast<std::size_t>(j)]; }
  const JointName& name(int j) const { return names_[static_cast<std::size_t>(j)]; }

 private:
  std::pair<bool, int> rank(int j) const { return {names_[static_cast<std::size_t>(j)].helper, depth(j)}; }
  int middle(const std::vector<int>& found) const {
    Vector3 mean = Vector3::Zero();
    for (const int j : found) mean += skeleton_.rest_offsets[static_cast<std::size_t>(j)] / static_cast<double>(found.size());
    const auto away = [&](int j) { return (skeleton_.rest_offsets[static_cast<std::size_t>(j)] - mean).norm(); };
    return *std::min_element(found.begin(), found.end(), [&](int a, int b) { return away(a) < away(b) - 1e-12; });
  }

  const Skeleton& skeleton_;
  std::vector<JointName> names_;
  std::vector<int> depth_, place_, size_;  // place: in a walk that takes each branch whole, so that a branch is an interval
};

// Canonical spine1..spine3 onto the joints between pelvis and neck: each takes the joint nearest by its share of the chain's length,
// so that a spine of any number of joints bends where the body does.
void match_spine(const Skeleton& s, const Finder& find, int pelvis, int top, bool top_is_spine, JointMap& map) {
  std::vector<int> chain;
  for (int j = top_is_spine ? top : find.parent(top); j >= 0 && j != pelvis && !find.below(pelvis, j); j = find.parent(j)) chain.push_back(j);
  std::reverse(chain.begin(), chain.end());
  if (chain.empty()) return;
  if (const std::size_t most = 24; chain.size() > most) {  // no spine, but it must not take cubic time
    for (std::size_t k = 0; k < most; ++k) chain[k] = chain[k * (chain.size() - 1) / (most - 1)];
    chain.resize(most);
  }
  std::vector<double> along;
  double length = 0;
  for (const int j : chain) along.push_back(length += s.rest_offsets[static_cast<std::size_t>(j)].norm());
  if (!top_is_spine) length += s.rest_offsets[static_cast<std::size_t>(top)].norm();
  const auto body = canonical_body();
  const std::array<const char*, 3> names = {"spine1", "spine2", "spine3"};
  double total = 0, at = 0;
  for (const char* n : {"spine1", "spine2", "spine3", "neck"}) total += body->rest_offsets[static_cast<std::size_t>(body->find(n))].norm();
  std::array<double, 3> share{};
  for (std::size_t k = 0; k < 3; ++k) share[k] = (at += body->rest_offsets[static_cast<std::size_t>(body->find(names[k]))].norm()) / total;
  // Every assignment that keeps the order, at most one joint each; as many placed as there are joints, then the nearest.
  const auto n = static_cast<int>(chain.size());
  double best = std::numeric_limits<double>::infinity();
  std::array<int, 3> chosen{-1, -1, -1};
  for (int a = -1; a < n; ++a)
    for (int b = -1; b < n; ++b)
      for (int c = -1; c < n; ++c) {
        const std::array<int, 3> pick{a, b, c};
        int last = -1, placed = 0;
        double cost = 0;
        bool ordered = true;
        for (std::size_t k = 0; k < 3; ++k) {
          if (pick[k] < 0) continue;
          ordered = ordered && pick[k] > last;
          last = pick[k];
          ++placed;
          cost += std::abs((length > 0 ? along[static_cast<std::size_t>(pick[k])] / length : 0.5) - share[k]);
        }
        cost += 10.0 * (std::min(n, 3) - placed);
        if (ordered && cost < best - 1e-12) {
          best = cost;
          chosen = pick;
        }
      }
  for (std::size_t k = 0; k < 3; ++k)
    if (chosen[k] >= 0) map.source[static_cast<std::size_t>(canonical_index(names[k]))] = chain[static_cast<std::size_t>(chosen[k])];
}

// Where the spine ends: neck and head, whatever the rig has of them.
void match_head(const Finder& find, JointMap& map) {
  // "lowerneck" below "Neck" in one convention, below "upperneck" in another: the neck is the lowest of them.
  int head = find.centre({Words{"head"}}), neck = find.nearest({Words{"neck"}, Words{"low", "neck"}});
  if (neck < 0) neck = find.nearest({Words{"neck", "twist"}});
  if (head < 0) {
    head = find.nearest({Words{"neck", "up"}, Words{"neck"}}, true);
    if (head == neck) head = -1;
  }
  if (neck >= 0 && head >= 0 && !find.below(head, neck)) neck = -1;
  const auto set = [&](const char* name, int joint) { map.source[static_cast<std::size_t>(canonical_index(name))] = joint; };
  set("head", head);
  set("neck", neck);
}

// A spine that goes on beyond the arms under its own name ("spine.004" to "spine.006") is neck and head.
void match_unnamed_head(const Skeleton& s, const Finder& find, int chest, JointMap& map) {
  int neck = -1, head = -1;
  for (int j = chest + 1; chest >= 0 && j < s.joint_count(); ++j) {
    if (find.parent(j) != (head < 0 ? chest : head) || find.name(j).side != Side::none || find.name(j).words.empty() || find.name(j).words != find.name(chest).words) continue;
    head = j;
    if (neck < 0) neck = j;
  }
  map.source[static_cast<std::size_t>(canonical_index("head"))] = head;
  map.source[static_cast<std::size_t>(canonical_index("neck"))] = neck == head ? -1 : neck;
}

bool has(const Skeleton& s, std::initializer_list<const char*> names) {
  return std::all_of(names.begin(), names.end(), [&](const char* n) { return s.find(n) >= 0; });
}

// The name of a convention, for people; nothing depends on it.
std::string family_of(const Skeleton& s) {
  if (has(s, {"joint_Root", "Hips", "UpperLeg_L", "LowerLeg_R", "UpperArm_L", "Hand_R", "Toes_L"})) return "bandai-namco";
  if (has(s, {"lfemur", "ltibia", "lhumerus", "lradius"})) return "cmu (asf)";
  if (has(s, {"LHipJoint"})) return s.find("LeftUpLeg") >= 0 ? "cmu (cgspeed)" : "cmu (cgspeed, 3ds max)";
  if (has(s, {"left_hip", "left_collar", "spine3"}) || has(s, {"L_Hip", "L_Collar", "Spine3"})) return "smpl";
  const auto starts = [&](const char* prefix) { return std::any_of(s.joint_names.begin(), s.joint_names.end(), [&](const auto& n) { return n.starts_with(prefix); }); };
  if (starts("mixamorig")) return "mixamo";
  if (starts("Bip0") || starts("Bip 0")) return "biped";
  if (has(s, {"LeftThigh", "LeftShin", "LeftForeArm"})) return "rokoko";
  if (has(s, {"LeftUpLeg", "LeftToe", "LeftForeArm"})) return "lafan1";
  if (has(s, {"LeftUpLeg", "LeftForeArm"})) return "humanik";
  if (has(s, {"UpLeg_L", "LoLeg_L"}) || has(s, {"upperleg01.L", "lowerleg01.L"})) return "makehuman";
  if (has(s, {"lThigh", "lShin", "lShldr"})) return "poser";
  if (has(s, {"thigh_l", "calf_l", "upperarm_l"})) return "unreal";
  if (has(s, {"thigh.L", "shin.L", "upper_arm.L"})) return "blender";
  if (has(s, {"LeftHip", "LeftKnee", "LeftAnkle"})) return s.find("Chest4") >= 0 ? "xsens" : "biovision";
  if (has(s, {"LThigh", "LShin", "LFArm"})) return "motive";
  return "unknown";
}

const std::map<std::string, std::string>& role_names() {  // canonical name -> role, where they differ
  static const std::map<std::string, std::string> names = {{"pelvis", "root"}, {"left_wrist", "left_hand"}, {"right_wrist", "right_hand"}};
  return names;
}

std::string role_of(const std::string& canonical_name) {
  const auto it = role_names().find(canonical_name);
  return it == role_names().end() ? canonical_name : it->second;
}

std::optional<JointMap> by_roles(const Skeleton& s) {
  JointMap map;
  map.family = "roles";
  const auto body = canonical_body();
  for (std::size_t c = 0; c < 22; ++c) map.source[c] = s.find_role(role_of(body->joint_names[c]));
  if (!map.missing().empty()) return std::nullopt;
  // roles_of() gives a rig without toes its ankles as feet.
  for (const char* side : {"left", "right"}) {
    int& foot = map.source[static_cast<std::size_t>(canonical_index(std::string(side) + "_foot"))];
    if (foot == map.source_of(std::string(side) + "_ankle")) foot = -1;
  }
  return map;
}

// `given` is what somebody named by hand: the rest is looked for around it.
JointMap by_name(const Skeleton& s, const std::map<std::string, int>& given = {}) {
  JointMap map;
  map.source.fill(-1);
  map.family = family_of(s);
  const auto set = [&](const std::string& name, int joint) { map.source[static_cast<std::size_t>(canonical_index(name))] = joint; };
  const Finder find(s);
  const auto pick = [&](const std::string& name, const auto& found) {
    const auto it = given.find(name);
    return it != given.end() ? it->second : found();
  };
  std::array<int, 2> thigh{}, arm{};
  for (const std::size_t k : {0, 1}) {
    const Side side = k == 0 ? Side::left : Side::right;
    const std::string p = k == 0 ? "left_" : "right_";
    // "LeftLeg" is the shank below "LeftUpLeg" and the thigh above "LeftShin": a thigh is what has a shank below it.
    const auto upper_and_lower = [&](const std::string& upper_name, const std::vector<Words>& upper_words, const std::string& lower_name, const std::vector<Words>& lower_words) {
      int upper = -1, lower = -1;
      for (const Words& spelling : upper_words) {
        upper = pick(upper_name, [&] { return find.side(side, {spelling}, -1); });
        lower = pick(lower_name, [&] { return upper < 0 ? -1 : find.side(side, lower_words, upper, {upper}); });
        if (upper >= 0 && lower >= 0) return std::pair(upper, lower);
      }
      return std::pair(pick(upper_name, [&] { return find.side(side, upper_words, -1); }), lower);
    };
    const auto [hip, knee] = upper_and_lower(p + "hip", kThigh, p + "knee", kShank);
    const int ankle = pick(p + "ankle", [&, above = hip, below = knee] { return below < 0 ? -1 : find.side(side, kAnkle, below, {above, below}); });
    set(p + "hip", thigh[k] = hip);
    set(p + "knee", knee);
    set(p + "ankle", ankle);
    set(p + "foot", pick(p + "foot", [&] { return ankle < 0 ? -1 : find.side(side, kToe, ankle, {ankle}); }));
    const auto [upper, elbow] = upper_and_lower(p + "shoulder", kUpperArm, p + "elbow", kForearm);
    const int wrist = pick(p + "wrist", [&, above = upper, below = elbow] { return below < 0 ? -1 : find.side(side, kHand, below, {above, below}); });
    set(p + "shoulder", arm[k] = upper);
    set(p + "elbow", elbow);
    set(p + "wrist", wrist);
    set(p + "collar", pick(p + "collar", [&, above = upper, below = elbow] {
          const int collar = find.side(side, kCollar, -1, {above, below, wrist});
          return collar >= 0 && above >= 0 && !find.below(above, collar) ? -1 : collar;
        }));
  }
  const int pelvis = pick("pelvis", [&] {
    const int legs = find.common_ancestor(thigh[0], thigh[1]), named = find.centre({Words{"hip"}, Words{"pelvis"}, Words{"base", "spine"}});
    return legs >= 0 && legs != thigh[0] && legs != thigh[1] ? legs : named >= 0 ? named : 0;
  });
  set("pelvis", pelvis);
  match_head(find, map);
  const int chest = find.common_ancestor(arm[0], arm[1]);
  if (map.source_of("neck") < 0 && map.source_of("head") < 0) match_unnamed_head(s, find, chest, map);
  for (const char* name : {"neck", "head"}) set(name, pick(name, [&] { return map.source_of(name); }));
  const int neck = map.source_of("neck") >= 0 ? map.source_of("neck") : map.source_of("head");
  if (neck >= 0) match_spine(s, find, pelvis, neck, false, map);
  else if (chest >= 0) match_spine(s, find, pelvis, chest, true, map);
  for (const auto& [name, joint] : given) set(name, joint);
  return map;
}

}  // namespace

int JointMap::source_of(std::string_view name) const {
  const int c = canonical_index(name);
  return c < 0 ? -1 : source[static_cast<std::size_t>(c)];
}

std::vector<std::string> JointMap::missing() const {
  std::vector<std::string> names;
  for (const char* n : {"pelvis", "left_hip", "right_hip", "left_knee", "right_knee", "left_ankle", "right_ankle", "left_shoulder", "right_shoulder", "left_elbow", "right_elbow"})
    if (source_of(n) < 0) names.emplace_back(n);
  return names;
}

JointMap map_to_canonical(const Skeleton& s) { return map_to_canonical(s, {}); }

JointMap map_to_canonical(const Skeleton& s, const std::map<std::string, std::string>& by_hand) {
  std::map<std::string, int> given;
  for (const auto& [name, joint] : by_hand) {
    if (canonical_index(name) < 0)
      refuse({{}, 0, "joint map"}, fmt::format("'{}', expected a joint of the canonical body: {}", name, fmt::join(canonical_body()->joint_names, ", ")));
    const int j = joint.empty() ? -1 : s.find(joint);
    if (!joint.empty() && j < 0) refuse({{}, 0, "joint map"}, fmt::format("joint '{}' for {} is not in the skeleton", joint, name));
    given[name] = j;
  }
  JointMap map;
  const auto body = canonical_body();
  if (std::all_of(body->joint_names.begin(), body->joint_names.end(), [&](const auto& n) { return s.find(n) >= 0; })) {
    map.family = "canonical";
    for (std::size_t c = 0; c < 22; ++c) map.source[c] = s.find(body->joint_names[c]);
  } else if (auto roles = by_roles(s)) {
    map = *roles;
  } else {
    map = by_name(s, given);
  }
  for (const auto& [name, joint] : given) map.source[static_cast<std::size_t>(canonical_index(name))] = joint;
  if (!given.empty()) map.family = "by hand";
  return map;
}

std::map<std::string, std::string> roles_of(const Skeleton& s, const JointMap& map) {
  std::map<std::string, std::string> roles;
  const auto body = canonical_body();
  for (std::size_t c = 0; c < 22; ++c)
    if (map.source[c] >= 0) roles[role_of(body->joint_names[c])] = s.joint_names[static_cast<std::size_t>(map.source[c])];
  for (const char* side : {"left", "right"})
    if (const auto ankle = roles.find(std::string(side) + "_ankle"); ankle != roles.end()) roles.try_emplace(std::string(side) + "_foot", ankle->second);
  return roles;
}

std::string describe_missing(const Skeleton& s, const JointMap& map) {
  const std::set<int> used(map.source.begin(), map.source.end());
  std::vector<std::string> left;
  for (int j = 0; j < s.joint_count(); ++j)
    if (!used.contains(j)) left.push_back(s.joint_names[static_cast<std::size_t>(j)]);
  const std::size_t shown = std::min<std::size_t>(left.size(), 24);
  return fmt::format("no joint found for {} among {} joints{}{}{}", fmt::join(map.missing(), ", "), s.joint_count(), shown > 0 ? "; not placed: " : "",
                     fmt::join(left.begin(), left.begin() + static_cast<std::ptrdiff_t>(shown), ", "),
                     left.size() > shown ? fmt::format(" and {} more", left.size() - shown) : "");
}

}  // namespace mocap
