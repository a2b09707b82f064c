#include "libmocap/io/asf.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <unordered_map>
#include <utility>

#include "libmocap/base/error.hpp"
#include "libmocap/base/utf8.hpp"
#include "libmocap/io/text_cursor.hpp"

namespace mocap::io {
namespace {

constexpr std::size_t kRoot = 0;

struct Bone {
  std::string name;
  long line = 0;  // of its `begin`
  std::optional<Vector3> direction;
  std::optional<double> length;
  Vector3 axis = Vector3::Zero();  // as written
  std::array<std::uint8_t, 3> axis_order{0, 1, 2};
  bool axis_seen = false;
  std::array<std::uint8_t, 6> dofs{};
  std::uint8_t dof_count = 0;
  bool dof_seen = false;
  int parent = -1;
  std::vector<std::size_t> children;
};

class Parser {
 public:
  explicit Parser(std::string_view text) : text_(text) {
    bones_.emplace_back();
    bones_[kRoot].name = "root";
    by_name_.emplace("root", kRoot);
  }
  Asf run();

 private:
  [[noreturn]] void fail(const std::string& what) const { refuse({{}, text_.line, object_}, what); }
  bool at_value_end() const { return text_.at_line_end() || *text_.p == '#'; }
  // Over blanks, lines and comments to the next word; false at the end of the file or of the section.
  bool more();
  std::string_view word();
  double number(const char* of);
  Vector3 three_numbers(const std::string& of);
  std::array<std::uint8_t, 3> axis_letters(const std::string& of);
  void dofs(Bone& bone, const std::string& of);
  void once(bool seen, const std::string& property) const {
    if (seen) fail("a second " + property + ", expected one");
  }
  void skip_section();
  void skip_limits();
  void units();
  void root();
  void bone();
  void bone_data();
  void hierarchy();
  void hierarchy_line(std::string_view parent);
  std::size_t known(std::string_view name, const char* as) const;
  Asf assemble();
  void leave_out(Asf& asf, const std::vector<char>& placed) const;
  Quaternion turn(const Bone& bone) const;

  TextCursor text_;
  std::string object_;
  std::vector<Bone> bones_;  // the root first
  std::unordered_map<std::string, std::size_t> by_name_;
  Vector3 position_ = Vector3::Zero();
  double length_unit_ = 0;
  bool radians_ = false, order_seen_ = false, position_seen_ = false, orientation_seen_ = false, bone_data_seen_ = false;
  std::optional<TextCursor> tree_;  // where :hierarchy starts: its turn comes when all bones are known
  std::vector<std::string> notes_;
};

bool Parser::more() {
  for (text_.skip_space(); !text_.done() && *text_.p == '#'; text_.skip_space()) text_.skip_to_line_end();
  return !text_.done() && *text_.p != ':';
}

std::string_view Parser::word() {
  const char* const first = text_.p;
  while (text_.p != text_.end && !is_separator(*text_.p)) ++text_.p;
  return {first, static_cast<std::size_t>(text_.p - first)};
}

double Parser::number(const char* of) {
  text_.skip_blanks();
  if (at_value_end()) fail(std::string(of) + " without a value, expected a number");
  double v = 0;
  const char* const next = read_number(text_.p, text_.end, v);
  if (!next) fail(std::string(of) + " " + text_.shown() + ", expected a finite number");
  text_.p = next;
  return v;
}

Vector3 Parser::three_numbers(const std::string& of) {
  Vector3 v;
  for (int k = 0; k < 3; ++k) {
    text_.skip_blanks();
    if (at_value_end()) fail(of + " followed by " + std::to_string(k) + " numbers, expected 3");
    const char* const next = read_number(text_.p, text_.end, v[k]);
    if (!next) fail(of + " with " + text_.shown() + ", expected 3 finite numbers");
    text_.p = next;
  }
  return v;
}

std::array<std::uint8_t, 3> Parser::axis_letters(const std::string& of) {
  text_.skip_blanks();
  if (at_value_end()) return {0, 1, 2};
  const std::string shown = text_.shown();
  const auto letters = word();
  std::array<std::uint8_t, 3> order{};
  int seen = 0;
  for (std::size_t i = 0; i < 3 && letters.size() == 3; ++i) {
    const char c = static_cast<char>(letters[i] | 0x20);
    if (c < 'x' || c > 'z') break;
    order[i] = static_cast<std::uint8_t>(c - 'x');
    seen |= 1 << order[i];
  }
  if (seen != 7) fail(of + " order " + shown + ", expected X, Y and Z in some order");
  return order;
}

// The words up to the end of the line.
void Parser::dofs(Bone& bone, const std::string& of) {
  static constexpr const char* kNames[] = {"tx", "ty", "tz", "rx", "ry", "rz"};
  int seen = 0;
  for (text_.skip_blanks(); !at_value_end(); text_.skip_blanks()) {
    const std::string shown = text_.shown();
    const auto w = word();
    int kind = 0;
    while (kind < 6 && !same_ignoring_case(w, kNames[kind])) ++kind;
    if (kind == 6 && same_ignoring_case(w, "l"))
      fail(of + " 'l', a bone that stretches, expected tx, ty, tz, rx, ry or rz");
    if (kind == 6) fail(of + " " + shown + ", expected tx, ty, tz, rx, ry or rz");
    if (seen & (1 << kind)) fail(of + " " + shown + " twice, expected each at most once");
    seen |= 1 << kind;
    bone.dofs[bone.dof_count++] = static_cast<std::uint8_t>(kind);
  }
}

void Parser::skip_section() {
  for (text_.skip_space(); !text_.done() && *text_.p != ':'; text_.skip_space()) text_.skip_to_line_end();
}

void Parser::units() {
  while (more()) {
    const auto key = word();
    if (same_ignoring_case(key, "length")) {
      once(length_unit_ != 0, "length");
      length_unit_ = number("length");
      if (!(length_unit_ > 0) || !std::isfinite(1 / length_unit_)) fail(fmt::format("length {}, expected a number above 0", length_unit_));
    } else if (same_ignoring_case(key, "angle")) {
      text_.skip_blanks();
      const std::string shown = text_.shown();
      const auto unit = word();
      const auto is = [&](std::string_view name) { return same_ignoring_case(unit, name); };
      radians_ = is("rad") || is("radians");
      if (!radians_ && !is("deg") && !is("degrees")) fail("angle " + shown + ", expected deg or rad");
    } else if (same_ignoring_case(key, "mass")) {
      number("mass");
    } else {
      text_.skip_to_line_end();
    }
  }
}

void Parser::root() {
  object_ = "root";
  Bone& root = bones_[kRoot];
  while (more()) {
    const std::string shown = text_.shown();
    const auto key = word();
    const auto is = [&](const char* name) { return same_ignoring_case(key, name); };
    if (is("order")) {
      once(order_seen_, "order");
      order_seen_ = true;
      dofs(root, "order");
    } else if (is("axis")) {
      once(root.axis_seen, "axis");
      root.axis_seen = true;
      root.axis_order = axis_letters("axis");
    } else if (is("position")) {
      once(position_seen_, "position");
      position_seen_ = true;
      position_ = three_numbers("position");
    } else if (is("orientation")) {
      once(orientation_seen_, "orientation");
      orientation_seen_ = true;
      root.axis = three_numbers("orientation");
    } else {
      fail(shown + " in :root, expected order, axis, position or orientation");
    }
  }
  object_.clear();
}

// Pairs in parentheses over any number of lines; "-inf" and commas are theirs.
void Parser::skip_limits() {
  const auto is_limit = [&] {
    const std::string_view ahead(text_.p, std::min<std::size_t>(3, static_cast<std::size_t>(text_.end - text_.p)));
    return std::string_view("(),+-.0123456789").find(ahead[0]) != std::string_view::npos || same_ignoring_case(ahead, "inf");
  };
  while (more() && is_limit()) word();
}

void Parser::bone() {
  Bone b;
  b.line = text_.line;
  object_ = "bone " + std::to_string(bones_.size());
  while (true) {
    if (!more()) fail((text_.done() ? "the file ends inside a bone" : text_.shown() + " inside a bone") + ", expected 'end'");
    const std::string shown = text_.shown();
    const auto key = word();
    const auto is = [&](const char* name) { return same_ignoring_case(key, name); };
    if (is("end")) {
      break;
    } else if (is("name")) {
      once(!b.name.empty(), "name");
      text_.skip_blanks();
      if (at_value_end()) fail("name without a value, expected a word");
      b.name = word();
      object_ = "bone " + (is_utf8(b.name) ? b.name : latin1_to_utf8(b.name));
      if (std::all_of(b.name.begin(), b.name.end(), [](char c) { return c >= '0' && c <= '9'; }))
        fail("a name of digits only, expected a word: an AMC could not tell it from the number of a frame");
    } else if (is("direction")) {
      once(b.direction.has_value(), "direction");
      b.direction = three_numbers("direction");
    } else if (is("length")) {
      once(b.length.has_value(), "length");
      b.length = number("length");
      if (*b.length < 0) fail(fmt::format("length {}, expected a number of at least 0", *b.length));
    } else if (is("axis")) {
      once(b.axis_seen, "axis");
      b.axis_seen = true;
      b.axis = three_numbers("axis");
      b.axis_order = axis_letters("axis");
    } else if (is("dof")) {
      once(b.dof_seen, "dof");
      b.dof_seen = true;
      dofs(b, "dof");
    } else if (is("limits")) {
      skip_limits();
    } else if (is("id") || is("bodymass") || is("cofmass")) {
      text_.skip_to_line_end();
    } else {
      fail(shown + " in a bone, expected id, name, direction, length, axis, dof, limits, bodymass, cofmass or 'end'");
    }
  }
  if (b.name.empty()) fail("'end' before a name, expected one");
  if (!b.direction) fail("'end' before a direction, expected one");
  if (!b.length) fail("'end' before a length, expected one");
  if (const double norm = b.direction->norm(); *b.length > 0 && std::abs(norm - 1) > 0.01)
    notes_.push_back(fmt::format("bone {}: a direction of length {:.6g} where 1 is usual", object_.substr(5), norm));
  if (!by_name_.emplace(b.name, bones_.size()).second) fail("another bone of this name, expected unique names");
  bones_.push_back(std::move(b));
  object_.clear();
}

void Parser::bone_data() {
  bone_data_seen_ = true;
  while (more()) {
    const std::string shown = text_.shown();
    if (!same_ignoring_case(word(), "begin")) fail(shown + " in :bonedata, expected 'begin'");
    bone();
  }
}

std::size_t Parser::known(std::string_view name, const char* as) const {
  const auto it = by_name_.find(std::string(name));
  if (it == by_name_.end()) fail(std::string(as) + " '" + std::string(name.substr(0, 40)) + "' is no bone of :bonedata");
  return it->second;
}

void Parser::hierarchy_line(std::string_view parent_name) {
  const std::size_t parent = known(parent_name, "parent");
  for (text_.skip_blanks(); !at_value_end(); text_.skip_blanks()) {
    const std::size_t child = known(word(), "child");
    if (child == kRoot) fail("the root below " + bones_[parent].name + ", expected it on top");
    if (bones_[child].parent >= 0)
      fail(fmt::format("bone {} below {} and {}, expected one parent", bones_[child].name, bones_[parent].name,
                       bones_[static_cast<std::size_t>(bones_[child].parent)].name));
    bones_[child].parent = static_cast<int>(parent);
    bones_[parent].children.push_back(child);
  }
}

void Parser::hierarchy() {
  bool open = false;
  while (more()) {
    const auto w = word();
    if (same_ignoring_case(w, "begin")) {
      open = true;
    } else if (same_ignoring_case(w, "end")) {
      open = false;
    } else {
      hierarchy_line(w);
    }
  }
  if (open) fail("the file ends inside :hierarchy, expected 'end'");
}

Quaternion Parser::turn(const Bone& bone) const {
  Quaternion q = Quaternion::Identity();
  for (std::size_t k = 0; k < 3; ++k) {
    const double degrees = bone.axis[static_cast<int>(k)];
    const double angle = radians_ ? degrees : std::remainder(degrees, 360.0) * (std::numbers::pi / 180);
    q = Quaternion(Eigen::AngleAxisd(angle, Vector3::Unit(bone.axis_order[k]))) * q;
  }
  return q.normalized();
}

// Bones that the walk from the root did not meet: outside of the hierarchy, or in a loop of it.
void Parser::leave_out(Asf& asf, const std::vector<char>& placed) const {
  std::vector<char> state(bones_.size(), 0);
  std::string names;
  std::size_t count = 0;
  for (std::size_t i = 1; i < bones_.size(); ++i) {
    if (placed[i]) continue;
    std::vector<std::size_t> path;
    for (std::size_t at = i; state[at] != 2; at = static_cast<std::size_t>(bones_[at].parent)) {
      if (state[at] == 1)
        refuse({{}, bones_[at].line, "bone " + bones_[at].name}, "the hierarchy makes it its own ancestor, expected a tree");
      state[at] = 1;
      path.push_back(at);
      if (bones_[at].parent < 0) break;
    }
    for (const std::size_t at : path) state[at] = 2;
    if (++count <= 8) names += (count > 1 ? ", " : "") + bones_[i].name;
    asf.outside.push_back({bones_[i].name, bones_[i].dofs, bones_[i].dof_count, Quaternion::Identity()});
  }
  if (count > 8) names += fmt::format(" and {} more", count - 8);
  if (count > 0) asf.notes.push_back("bones outside of the hierarchy are left out: " + names);
}

Asf Parser::assemble() {
  Asf asf;
  asf.metres_per_unit = length_unit_ > 0 ? 0.0254 / length_unit_ : 0;
  asf.radians = radians_;
  asf.notes = std::move(notes_);
  Skeleton s;
  std::vector<char> placed(bones_.size(), 0);
  std::vector<std::pair<std::size_t, int>> open{{kRoot, -1}};  // bone, parent joint
  std::vector<std::size_t> bone_of;                            // [J]
  while (!open.empty()) {
    const auto [i, parent] = open.back();
    open.pop_back();
    const Bone& b = bones_[i];
    placed[i] = 1;
    const int joint = s.joint_count();
    std::string name = b.name;
    if (!is_utf8(name)) {
      name = latin1_to_utf8(name);
      asf.notes.push_back("line " + std::to_string(b.line) + ": bone name '" + name + "' is not UTF-8, read as Latin-1");
    }
    s.joint_names.push_back(std::move(name));
    s.parents.push_back(parent);
    const auto tip = [&](const Bone& of) -> Vector3 { return *of.length * *of.direction; };
    const Vector3 base = parent <= 0 ? Vector3::Zero().eval() : tip(bones_[bone_of[static_cast<std::size_t>(parent)]]);
    s.rest_offsets.push_back(parent < 0 ? position_ : base);
    if (b.children.empty() && i != kRoot) s.end_sites.push_back({joint, tip(b)});
    asf.joints.push_back({b.name, b.dofs, b.dof_count, turn(b)});
    bone_of.push_back(i);
    for (auto child = b.children.rbegin(); child != b.children.rend(); ++child) open.emplace_back(*child, joint);
  }
  leave_out(asf, placed);
  if (s.joint_count() == 1) fail("a :hierarchy without a bone below root, expected a skeleton");
  if (!asf.joints[0].axis.isApprox(Quaternion::Identity()) || position_ != Vector3::Zero())
    asf.notes.push_back("the root's position and orientation are not 0: its motion is taken as relative to them");
  s.validate();
  asf.skeleton = std::make_shared<const Skeleton>(std::move(s));
  return asf;
}

Asf Parser::run() {
  while (more() || !text_.done()) {
    const std::string shown = text_.shown();
    const auto section = word();
    const auto is = [&](const char* name) { return same_ignoring_case(section, name); };
    if (is(":units")) {
      units();
    } else if (is(":root")) {
      root();
    } else if (is(":bonedata")) {
      bone_data();
    } else if (is(":hierarchy")) {
      once(tree_.has_value(), ":hierarchy");
      tree_ = text_;
      skip_section();
    } else if (is(":version") || is(":name")) {
      text_.skip_to_line_end();
    } else if (section.starts_with(':')) {
      if (!is(":documentation") && !is(":skin"))
        notes_.push_back("line " + std::to_string(text_.line) + ": section " + shown + " is not known and skipped");
      text_.skip_to_line_end();
      skip_section();
    } else {
      fail(shown + ", expected a section such as :units, :root, :bonedata or :hierarchy");
    }
  }
  if (!bone_data_seen_) fail("no :bonedata, expected a skeleton");
  if (bones_.size() == 1) fail(":bonedata without a bone, expected at least one");
  if (!tree_) fail("no :hierarchy, expected one");
  if (!order_seen_) {
    notes_.push_back("no order of the root's values: TX TY TZ RX RY RZ assumed");
    bones_[kRoot].dofs = {0, 1, 2, 3, 4, 5};
    bones_[kRoot].dof_count = 6;
  }
  if (length_unit_ == 0) notes_.push_back("no length in :units: the unit goes by the length of the legs");
  text_ = *tree_;
  hierarchy();
  return assemble();
}

}  // namespace

Asf parse_asf(std::string_view text) { return Parser(text).run(); }

}  // namespace mocap::io
