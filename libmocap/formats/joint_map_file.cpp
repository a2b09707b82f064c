#include "libmocap/formats/joint_map_file.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#define TOML_HEADER_ONLY 1
#include <toml++/toml.h>

#include <charconv>

#include "libmocap/base/error.hpp"
#include "libmocap/base/output_file.hpp"
#include "libmocap/base/utf8.hpp"
#include "libmocap/skeleton/canonical_body.hpp"

namespace mocap::formats {
namespace {

// toml++ 3.3 looks at a letter beyond ASCII outside of quotes by a table that some letters lead out of, and then anything may happen (found by libFuzzer). It never sees one: bytes from 0x80 on,
// and '~', are written as '~' and two hexadecimal digits, which bare words cannot hold, and read back in what was in quotes.
std::string in_ascii(const std::string& text, const std::string& path) {
  std::string out;
  long line = 1;
  std::size_t begin = 0;
  for (std::size_t i = 0; i <= text.size(); ++i) {
    if (i == text.size() || text[i] == '\n') {
      if (!is_utf8(std::string_view(text).substr(begin, i - begin))) refuse({path, line, {}}, "bytes that are no UTF-8, expected TOML");
      begin = i + 1;
      ++line;
      if (i == text.size()) break;
    }
    const auto c = static_cast<unsigned char>(text[i]);
    if (c >= 0x80 || c == '~') out += fmt::format("~{:02x}", c);
    else out += text[i];
  }
  return out;
}

std::string from_ascii(std::string_view text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    unsigned value = 0;
    const bool token = text[i] == '~' && i + 2 < text.size() && std::from_chars(text.data() + i + 1, text.data() + i + 3, value, 16).ptr == text.data() + i + 3;
    out += token ? static_cast<char>(value) : text[i];
    if (token) i += 2;
  }
  return out;
}

}  // namespace

JointMapFile read_joint_map(const std::string& path) {
  JointMapFile out;
  Digest digest{};
  std::string text = read_file(path, std::size_t{1} << 24, &digest);
  out.sha256 = to_hex(digest);
  if (text.starts_with("\xef\xbb\xbf")) text.erase(0, 3);
  text = in_ascii(text, path);
  toml::table document;
  try {
    document = toml::parse(text, path);
  } catch (const toml::parse_error& e) {
    if (e.description().find("saw '~'") != std::string_view::npos && text.find("~7e") == std::string::npos)
      refuse({path, static_cast<long>(e.source().begin.line), {}}, "a letter beyond ASCII outside of quotes, expected TOML");
    refuse({path, static_cast<long>(e.source().begin.line), {}}, fmt::format("{}, expected TOML", from_ascii(e.description())));
  }
  const auto line = [](const toml::node& node) { return static_cast<long>(node.source().begin.line); };
  for (const auto& [key, node] : document)
    if (key.str() != "joints" || !node.is_table()) refuse({path, line(node), {}}, fmt::format("'{}', expected one table [joints]", from_ascii(key.str())));
  const toml::table* joints = document["joints"].as_table();
  if (!joints) refuse({path, 0, {}}, "no table [joints], expected lines like left_hip = \"Bone.012\" in it");
  std::map<std::string, std::string> taken;
  for (const auto& [key, node] : *joints) {
    const std::string name = from_ascii(key.str());
    if (canonical_body()->find(name) < 0)
      refuse({path, line(node), {}}, fmt::format("'{}', expected a joint of the canonical body: {}", name, fmt::join(canonical_body()->joint_names, ", ")));
    const auto* value = node.as_string();
    if (!value) refuse({path, line(node), name}, "a value that is no text, expected the name of a joint in quotes");
    const std::string joint = from_ascii(value->get());
    const auto [other, fresh] = taken.emplace(joint, name);
    if (!joint.empty() && !fresh) refuse({path, line(node), name}, fmt::format("joint '{}' stands for {} already", joint, other->second));
    out.joints[name] = joint;
  }
  return out;
}

}  // namespace mocap::formats
