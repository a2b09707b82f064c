#include "libmocap/formats/joint_map_file.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#define TOML_HEADER_ONLY 1
#include <toml++/toml.h>

#include "libmocap/base/error.hpp"
#include "libmocap/base/output_file.hpp"
#include "libmocap/skeleton/canonical_body.hpp"

namespace mocap::formats {
namespace {

// TOML has letters beyond ASCII in quotes and comments alone. toml++ 3.3 takes others for something it calls unreachable, and then anything may happen (found by libFuzzer).
void refuse_bare_letters(const std::string& text, const std::string& path) {
  long line = 1;
  for (std::size_t i = text.starts_with("\xef\xbb\xbf") ? 3 : 0; i < text.size(); ++i) {
    const char c = text[i];
    if (c == '\n') ++line;
    if (c == '#') {
      while (i + 1 < text.size() && text[i + 1] != '\n') ++i;
    } else if (c == '"' || c == '\'') {
      const bool several_lines = text.compare(i, 3, std::string(3, c)) == 0;
      const std::string end(several_lines ? 3 : 1, c);
      for (i += end.size(); i < text.size() && text.compare(i, end.size(), end) != 0; ++i) {
        if (text[i] == '\n') ++line;
        if (text[i] == '\n' && !several_lines) break;
        if (text[i] == '\\' && c == '"') ++i;
      }
      if (several_lines) i += 2;
    } else if (static_cast<unsigned char>(c) >= 0x80) {
      refuse({path, line, {}}, "a letter beyond ASCII outside of quotes, expected TOML");
    }
  }
}

}  // namespace

JointMapFile read_joint_map(const std::string& path) {
  JointMapFile out;
  Digest digest{};
  const std::string text = read_file(path, std::size_t{1} << 24, &digest);
  out.sha256 = to_hex(digest);
  refuse_bare_letters(text, path);
  toml::table document;
  try {
    document = toml::parse(text, path);
  } catch (const toml::parse_error& e) {
    refuse({path, static_cast<long>(e.source().begin.line), {}}, fmt::format("{}, expected TOML", e.description()));
  }
  const auto line = [](const toml::node& node) { return static_cast<long>(node.source().begin.line); };
  for (const auto& [key, node] : document)
    if (key.str() != "joints" || !node.is_table()) refuse({path, line(node), {}}, fmt::format("'{}', expected one table [joints]", key.str()));
  const toml::table* joints = document["joints"].as_table();
  if (!joints) refuse({path, 0, {}}, "no table [joints], expected lines like left_hip = \"Bone.012\" in it");
  std::map<std::string, std::string> taken;
  for (const auto& [key, node] : *joints) {
    const std::string name(key.str());
    if (canonical_body()->find(name) < 0)
      refuse({path, line(node), {}}, fmt::format("'{}', expected a joint of the canonical body: {}", name, fmt::join(canonical_body()->joint_names, ", ")));
    const auto* value = node.as_string();
    if (!value) refuse({path, line(node), name}, "a value that is no text, expected the name of a joint in quotes");
    const auto [other, fresh] = taken.emplace(value->get(), name);
    if (!value->get().empty() && !fresh) refuse({path, line(node), name}, fmt::format("joint '{}' stands for {} already", value->get(), other->second));
    out.joints[name] = value->get();
  }
  return out;
}

}  // namespace mocap::formats
