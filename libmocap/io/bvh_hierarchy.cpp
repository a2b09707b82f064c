#include "libmocap/io/bvh_hierarchy.hpp"

#include <charconv>
#include <set>
#include <unordered_map>
#include <utility>

#include "libmocap/base/error.hpp"
#include "libmocap/base/utf8.hpp"

namespace mocap::io {
namespace {

constexpr int kEndSite = -2;  // on the stack of open blocks, among joint numbers

class Parser {
 public:
  explicit Parser(TextCursor& text) : text_(text) {}
  BvhHierarchy run();

 private:
  [[noreturn]] void fail(const std::string& what) const { refuse({{}, text_.line, object()}, what); }
  std::string object() const {
    if (open_.empty()) return {};
    if (open_.back() != kEndSite) return "joint " + out_.skeleton.joint_names[static_cast<std::size_t>(open_.back())];
    return "End Site of " + out_.skeleton.joint_names[static_cast<std::size_t>(out_.skeleton.end_sites.back().parent)];
  }
  void open_brace(const std::string& of);
  void close();
  void root();
  void joint();
  void end_site();
  void offset();
  void channels();
  void add_joint(std::string_view written, int parent);

  TextCursor& text_;
  BvhHierarchy out_;
  std::vector<int> open_;  // blocks not yet closed
  std::vector<char> offset_seen_, channels_seen_;
  bool end_offset_seen_ = false;
  std::set<std::string, std::less<>> names_;
  std::unordered_map<std::string, int> repeats_;
};

void Parser::open_brace(const std::string& of) {
  text_.skip_space();
  if (text_.done() || *text_.p != '{') fail(of + " followed by " + text_.shown() + ", expected '{'");
  ++text_.p;
}

void Parser::add_joint(std::string_view written, int parent) {
  if (written.empty()) fail("a joint without a name");
  Skeleton& s = out_.skeleton;
  std::string name(written);
  if (!is_utf8(name)) {
    name = latin1_to_utf8(name);
    out_.notes.push_back("line " + std::to_string(text_.line) + ": joint name '" + name +
                         "' is not UTF-8, read as Latin-1");
  }
  if (!names_.insert(name).second) {
    int& n = repeats_.try_emplace(name, 1).first->second;
    std::string other;
    do other = name + "#" + std::to_string(++n);
    while (!names_.insert(other).second);
    out_.notes.push_back("line " + std::to_string(text_.line) + ": another joint '" + name + "', renamed to '" + other +
                         "'");
    name = other;
  }
  s.joint_names.push_back(std::move(name));
  s.parents.push_back(parent);
  s.rest_offsets.push_back(Vector3::Zero());
  out_.channels.emplace_back();
  offset_seen_.push_back(0);
  channels_seen_.push_back(0);
}

void Parser::root() {
  const auto name = text_.rest();
  if (!out_.skeleton.parents.empty())
    fail("a second ROOT '" + std::string(name.substr(0, 40)) + "', expected one skeleton in a file");
  add_joint(name, -1);
  open_brace("ROOT " + out_.skeleton.joint_names.back());
  open_.push_back(0);
}

void Parser::joint() {
  if (open_.empty()) fail("a JOINT outside of ROOT { }");
  if (open_.back() == kEndSite) fail("a JOINT inside an End Site, expected '}'");
  add_joint(text_.rest(), open_.back());
  open_brace("JOINT " + out_.skeleton.joint_names.back());
  open_.push_back(out_.skeleton.joint_count() - 1);
}

void Parser::end_site() {
  if (open_.empty() || open_.back() == kEndSite) fail("an End Site outside of a joint");
  text_.rest();  // "Site", "site", nothing, or a name some writers give it
  out_.skeleton.end_sites.push_back({open_.back(), Vector3::Zero()});
  open_brace("End Site");
  open_.push_back(kEndSite);
  end_offset_seen_ = false;
}

void Parser::offset() {
  if (open_.empty()) fail("an OFFSET outside of a joint");
  const bool tip = open_.back() == kEndSite;
  const auto j = static_cast<std::size_t>(tip ? 0 : open_.back());
  if (tip ? end_offset_seen_ : offset_seen_[j]) fail("a second OFFSET, expected one");
  Vector3& v = tip ? out_.skeleton.end_sites.back().offset : out_.skeleton.rest_offsets[j];
  for (int k = 0; k < 3; ++k) {
    text_.skip_blanks();
    if (text_.at_line_end() || *text_.p == '}')
      fail("OFFSET followed by " + std::to_string(k) + " numbers, expected 3");
    const char* const next = read_number(text_.p, text_.end, v[k]);
    if (!next) fail("OFFSET with " + text_.shown() + ", expected 3 finite numbers");
    text_.p = next;
  }
  if (tip)
    end_offset_seen_ = true;
  else
    offset_seen_[j] = 1;
}

void Parser::channels() {
  if (open_.empty() || open_.back() == kEndSite) fail("CHANNELS outside of a joint");
  const auto j = static_cast<std::size_t>(open_.back());
  if (channels_seen_[j]) fail("a second CHANNELS, expected one");
  channels_seen_[j] = 1;
  text_.skip_blanks();
  const std::string shown = text_.shown();
  const auto digits = text_.word();
  int count = -1;
  const auto r = std::from_chars(digits.data(), digits.data() + digits.size(), count);
  if (r.ec != std::errc{} || r.ptr != digits.data() + digits.size() || count < 0 || count > 6)
    fail("CHANNELS " + shown + ", expected a whole number from 0 to 6");
  BvhChannels& c = out_.channels[j];
  const auto is_statement = [](std::string_view w) {
    for (const char* k : {"JOINT", "End", "EndSite", "OFFSET", "CHANNELS", "MOTION", ""})
      if (same_ignoring_case(w, k)) return true;
    return false;
  };
  int found = 0, seen = 0;
  for (;; ++found) {
    text_.skip_blanks();
    const TextCursor before = text_;
    const auto word = text_.word();
    if (is_statement(word)) {  // the next statement on the same line, a brace, or the end of the line
      text_ = before;
      break;
    }
    if (found >= count) continue;
    static constexpr const char* kNames[] = {"Xposition", "Yposition", "Zposition",
                                             "Xrotation", "Yrotation", "Zrotation"};
    int kind = 0;
    while (kind < 6 && !same_ignoring_case(word, kNames[kind])) ++kind;
    if (kind == 6)
      fail("channel " + before.shown() +
           ", expected Xposition, Yposition, Zposition, Xrotation, Yrotation or Zrotation");
    if (seen & (1 << kind)) fail(std::string("channel ") + kNames[kind] + " twice, expected each at most once");
    seen |= 1 << kind;
    c.kinds[static_cast<std::size_t>(found)] = static_cast<std::uint8_t>(kind);
  }
  if (found != count)
    fail("CHANNELS " + std::to_string(count) + " followed by " + std::to_string(found) + " names, expected " +
         std::to_string(count));
  c.count = static_cast<std::uint8_t>(found);
  out_.channel_count += static_cast<std::size_t>(found);
}

void Parser::close() {
  if (open_.empty()) fail("'}' that closes nothing");
  const bool tip = open_.back() == kEndSite;
  if (!(tip ? end_offset_seen_ : offset_seen_[static_cast<std::size_t>(open_.back())] != 0))
    fail("'}' before an OFFSET, expected one");
  open_.pop_back();
}

BvhHierarchy Parser::run() {
  text_.skip_space();
  if (text_.done()) fail("an empty file, expected HIERARCHY");
  if (const std::string shown = text_.shown(); !same_ignoring_case(text_.word(), "HIERARCHY"))
    fail("starts with " + shown + ", expected HIERARCHY");
  while (true) {
    text_.skip_space();
    if (text_.done()) fail("the file ends inside HIERARCHY, expected " + std::string(open_.empty() ? "MOTION" : "'}'"));
    if (*text_.p == '}') {
      ++text_.p;
      close();
      continue;
    }
    const std::string shown = text_.shown();
    const auto word = text_.word();
    const auto is = [&](const char* keyword) { return same_ignoring_case(word, keyword); };
    if (is("JOINT")) {
      joint();
    } else if (is("OFFSET")) {
      offset();
    } else if (is("CHANNELS")) {
      channels();
    } else if (is("End") || is("EndSite")) {
      end_site();
    } else if (is("ROOT")) {
      root();
    } else if (is("MOTION")) {
      break;
    } else {
      fail(shown +
           (open_.empty() ? ", expected ROOT or MOTION" : ", expected OFFSET, CHANNELS, JOINT, End Site or '}'"));
    }
  }
  if (!open_.empty()) fail("MOTION before the joint is closed, expected '}'");
  if (out_.skeleton.parents.empty()) fail("MOTION without a ROOT before it, expected a skeleton");
  if (out_.channel_count == 0) fail("a skeleton without channels, expected at least one");
  return std::move(out_);
}

}  // namespace

BvhHierarchy read_hierarchy(TextCursor& text) { return Parser(text).run(); }

}  // namespace mocap::io
