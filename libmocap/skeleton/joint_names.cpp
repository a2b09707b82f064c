#include "libmocap/skeleton/joint_names.hpp"

#include <algorithm>
#include <cctype>
#include <iterator>
#include <map>
#include <set>
#include <utility>

namespace mocap {
namespace {

bool is_letter(char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0; }
bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_upper(char c) { return c >= 'A' && c <= 'Z'; }
bool is_lower(char c) { return c >= 'a' && c <= 'z'; }

// Words in which joints are named, and the one spelling they get; "" for those that say nothing.
const std::map<std::string, std::string, std::less<>>& dictionary() {
  static const std::map<std::string, std::string, std::less<>> words = {
      {"left", "L"},      {"lft", "L"},       {"right", "R"},    {"rgt", "R"},       {"up", "up"},        {"upper", "up"},    {"low", "low"},      {"lo", "low"},
      {"lower", "low"},   {"fore", "low"},    {"leg", "leg"},    {"legs", "leg"},    {"arm", "arm"},      {"hip", "hip"},     {"hips", "hip"},     {"pelvis", "pelvis"},
      {"thigh", "thigh"}, {"femur", "femur"}, {"knee", "knee"},  {"shin", "shin"},   {"shank", "shin"},  {"calf", "calf"},    {"tibia", "tibia"}, {"ankle", "ankle"},  {"foot", "foot"},
      {"feet", "foot"},   {"toe", "toe"},     {"toes", "toe"},   {"base", "base"},   {"ball", "ball"},    {"heel", "heel"},   {"butt", "buttock"}, {"buttock", "buttock"},
      {"collar", "collar"}, {"clavicle", "clavicle"}, {"clav", "clavicle"}, {"scapula", "clavicle"}, {"shoulder", "shoulder"}, {"shldr", "shoulder"}, {"humerus", "humerus"}, {"elbow", "elbow"},
      {"radius", "radius"}, {"ulna", "ulna"}, {"wrist", "wrist"}, {"hand", "hand"},  {"carpus", "wrist"}, {"neck", "neck"},   {"head", "head"},    {"skull", "head"},
      {"spine", "spine"}, {"chest", "chest"}, {"abdomen", "abdomen"}, {"torso", "torso"}, {"thorax", "thorax"}, {"waist", "waist"}, {"back", "back"}, {"root", "root"},
      {"finger", "finger"}, {"fingers", "finger"}, {"thumb", "thumb"}, {"index", "index"}, {"middle", "middle"}, {"mid", "middle"}, {"ring", "ring"}, {"pinky", "pinky"},
      {"little", "pinky"}, {"palm", "palm"}, {"end", "end"},      {"nub", "end"},     {"tip", "end"},      {"site", "end"},    {"twist", "twist"},  {"roll", "twist"},
      {"joint", "joint"}, {"jnt", ""},        {"bone", ""},      {"bn", ""},         {"mocap", ""},       {"actor", ""},      {"skeleton", ""},   {"bip", ""},    {"def", ""},
      {"talus", "ankle"}, {"calcn", "heel"}, {"calcaneus", "heel"}, {"bend", ""},       {"stretch", ""},
      {"top", "top"},     {"in", "in"},       {"eye", "eye"},    {"jaw", "jaw"},     {"inhand", "finger"}};
  return words;
}

// A run of letters without case changes as words of the dictionary: "lhipjoint" is l hip joint, "LU" of "LUArm" is l up.
// The fewest words win; empty where it is none.
std::vector<std::string> segment(const std::string& run) {
  const auto& known = dictionary();
  const auto meaning = [&](std::size_t from, std::size_t to) -> const std::string* {
    static const std::string left = "L", right = "R", up = "up", low = "low";
    const std::string_view word = std::string_view(run).substr(from, to - from);
    if (const auto it = known.find(word); it != known.end()) return &it->second;
    // Letters stand for words only before others: "lhip", "LUArm", "LFArm". Alone they may be the middle: "C_Neck", "neck.x", "Chest_M".
    static const std::string nothing;
    if (run.size() == 1 && (word == "c" || word == "m" || word == "x")) return &nothing;
    if (word == "l" && from == 0) return &left;
    if (word == "r" && from == 0) return &right;
    if (run.size() > 2 || from > 1) return nullptr;
    return word == "u" ? &up : word == "f" ? &low : nullptr;
  };
  std::vector<int> count(run.size() + 1, 1000), back(run.size() + 1, -1);
  count[0] = 0;
  for (std::size_t to = 1; to <= run.size(); ++to)
    for (std::size_t from = 0; from < to; ++from)
      if (count[from] + 1 < count[to] && meaning(from, to)) {
        count[to] = count[from] + 1;
        back[to] = static_cast<int>(from);
      }
  std::vector<std::string> words;
  if (count[run.size()] >= 1000) return words;
  for (std::size_t to = run.size(); to > 0; to = static_cast<std::size_t>(back[to])) words.push_back(*meaning(static_cast<std::size_t>(back[to]), to));
  std::reverse(words.begin(), words.end());
  return words;
}

// Japanese names, as MikuMikuDance has them, in the words of the dictionary; of two that begin alike the longer one first.
constexpr std::pair<std::string_view, std::string_view> kJapanese[] = {
    {"左", "left"},   {"右", "right"},   {"足首", "ankle"}, {"つま先", "toe"}, {"足", "leg"},      {"ひざ", "knee"},  {"膝", "knee"},      {"手首", "wrist"}, {"ひじ", "elbow"}, {"肘", "elbow"},  {"腕", "arm"},
    {"捩", "twist"},  {"肩", "shoulder"}, {"首", "neck"},    {"頭", "head"},    {"上半身", "spine"}, {"下半身", "pelvis"}, {"親指", "thumb"}, {"人指", "index"}, {"中指", "middle"}, {"薬指", "ring"}, {"小指", "pinky"},
    {"目", "eye"},    {"手", "hand"}};

std::string in_english(std::string_view name) {
  std::string out;
  while (!name.empty()) {
    const auto* word = std::find_if(std::begin(kJapanese), std::end(kJapanese), [&](const auto& w) { return name.starts_with(w.first); });
    const std::size_t taken = word == std::end(kJapanese) ? 1 : word->first.size();
    if (word == std::end(kJapanese)) out += name.front();
    else out += ' ', out += word->second, out += ' ';
    name.remove_prefix(taken);
  }
  return out;
}

// Runs of letters, divided at everything else and at changes of case: "LHipJoint" is L Hip Joint.
std::vector<std::string> runs_of(std::string_view written) {
  const bool ascii = std::all_of(written.begin(), written.end(), [](char c) { return static_cast<unsigned char>(c) < 0x80; });
  const std::string translated = ascii ? std::string() : in_english(written);
  std::string_view name = ascii ? written : std::string_view(translated);
  if (const auto at = name.find_last_of(":|"); at != std::string_view::npos && at + 1 < name.size()) name = name.substr(at + 1);
  std::vector<std::string> runs;
  for (std::size_t i = 0; i < name.size(); ++i) {
    if (!is_letter(name[i])) continue;
    const bool starts = i == 0 || !is_letter(name[i - 1]) || (is_upper(name[i]) && is_lower(name[i - 1])) ||
                        (is_upper(name[i]) && is_upper(name[i - 1]) && i + 1 < name.size() && is_lower(name[i + 1]));
    if (starts) runs.emplace_back();
    runs.back() += is_upper(name[i]) ? static_cast<char>(name[i] + 32) : name[i];
  }
  return runs;
}

JointName from_runs(const std::vector<std::string>& runs, std::string_view name) {
  JointName out;
  out.helper = name.starts_with("__");
  for (std::size_t i = 0; i < name.size(); ++i) {
    if (!is_digit(name[i])) continue;
    if (!out.numbers.empty() && !is_digit(name[i - 1])) out.numbers += '-';
    out.numbers += name[i];
  }
  for (const std::string& run : runs) {
    auto words = segment(run);
    // A word nobody knows: the name means something else. A letter that is all of a name is no side: "L5" is a vertebra.
    if (words.empty() || (runs.size() == 1 && run.size() == 1)) words = {run};
    for (auto& word : words) {
      if (word == "L" || word == "R") out.side = word == "L" ? Side::left : Side::right;
      else if (!word.empty()) out.words.push_back(std::move(word));
    }
  }
  std::sort(out.words.begin(), out.words.end());
  return out;
}

}  // namespace

JointName parse_joint_name(std::string_view name) { return from_runs(runs_of(name), name); }

std::vector<JointName> joint_names_of(const Skeleton& s) {
  std::vector<std::vector<std::string>> runs;
  for (const auto& name : s.joint_names) runs.push_back(runs_of(name));
  // "Character1_LeftLeg", "CC_Base_L_Thigh": words in front that the rig puts everywhere. The first must not name a part: a rig may be mostly head.
  bool prefixed = false;
  while (true) {
    std::map<std::string, std::size_t> first;
    for (const auto& r : runs)
      if (!r.empty()) ++first[r.front()];
    const auto most = std::max_element(first.begin(), first.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
    if (most == first.end() || runs.size() < 3 || 10 * most->second < 8 * runs.size()) break;
    const std::string prefix = most->first;
    const auto words = segment(prefix);
    const bool part = std::any_of(words.begin(), words.end(), [](const auto& w) { return !w.empty(); }), side = std::any_of(words.begin(), words.end(), [](const auto& w) { return w == "L" || w == "R"; });
    if (side || (part && !prefixed)) break;
    prefixed = true;
    for (auto& r : runs)
      if (!r.empty() && r.front() == prefix) r.erase(r.begin());
  }
  // "left_upLeg_joint": a word behind that says no more than that it is one.
  std::size_t behind = 0;
  for (const auto& r : runs) behind += r.size() > 1 && r.back() == "joint";
  if (runs.size() >= 3 && 10 * behind >= 8 * runs.size())
    for (auto& r : runs)
      if (r.size() > 1 && r.back() == "joint") r.pop_back();
  std::vector<JointName> out;
  for (std::size_t j = 0; j < runs.size(); ++j) out.push_back(from_runs(runs[j], s.joint_names[j]));
  return out;
}

}  // namespace mocap
