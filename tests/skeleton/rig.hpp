// Rigs written down briefly: "Hips(*UpLeg(*Leg),Spine=12)". A name may have its bone's length after '=' (10 without). A branch whose first
// name holds a mark stands twice, for the left and the right: * Left Right, @ left right, # LEFT RIGHT, % L R, ^ l r.
#pragma once
#include <algorithm>
#include <stdexcept>
#include <string>
#include <string_view>

#include "libmocap/skeleton/skeleton.hpp"

namespace mocap::test {

inline std::string on_side(std::string_view text, bool left) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '*': out += left ? "Left" : "Right"; break;
      case '@': out += left ? "left" : "right"; break;
      case '#': out += left ? "LEFT" : "RIGHT"; break;
      case '%': out += left ? 'L' : 'R'; break;
      case '^': out += left ? 'l' : 'r'; break;
      default: out += c;
    }
  }
  return out;
}

inline void add_branch(Skeleton& s, int parent, std::string_view text) {
  while (!text.empty()) {
    // One branch, up to the comma on this level.
    std::size_t end = 0;
    for (int depth = 0; end < text.size() && (depth > 0 || text[end] != ','); ++end) depth += text[end] == '(' ? 1 : text[end] == ')' ? -1 : 0;
    const std::string_view branch = text.substr(0, end);
    text.remove_prefix(std::min(text.size(), end + 1));
    const std::size_t open = branch.find('(');
    if (open != std::string_view::npos && branch.back() != ')') throw std::invalid_argument("parentheses: " + std::string(branch));
    const std::string_view name = branch.substr(0, open);
    if (name.find_first_of("*@#%^") != std::string_view::npos) {
      for (const bool left : {true, false}) add_branch(s, parent, on_side(branch, left));
      continue;
    }
    const std::size_t equals = name.find('=');
    s.joint_names.emplace_back(name.substr(0, equals));
    s.parents.push_back(parent);
    s.rest_offsets.emplace_back(equals == std::string_view::npos ? 10 : std::stod(std::string(name.substr(equals + 1))), 0, 0);
    if (open != std::string_view::npos) add_branch(s, s.joint_count() - 1, branch.substr(open + 1, branch.size() - open - 2));
  }
}

inline Skeleton rig(std::string_view text) {
  Skeleton s;
  add_branch(s, -1, text);
  s.validate("rig");
  return s;
}

}  // namespace mocap::test
