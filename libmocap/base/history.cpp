#include "libmocap/base/history.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <sstream>
#include <tuple>

#include "libmocap/base/error.hpp"

namespace mocap {
namespace {

using Json = nlohmann::ordered_json;

std::string quoted(const std::string& word) {
  if (!word.empty() && word.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-+=./:,@%") == std::string::npos) return word;
  std::string s = "'";
  for (const char c : word) s += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return s + "'";
}

// A comment that a name with a line break cannot leave.
std::string comment(std::string s) {
  for (char& c : s)
    if (c == '\n' || c == '\r') c = ' ';
  return s;
}

}  // namespace

std::string to_json_lines(const History& history) {
  std::string text;
  for (const auto& e : history) {
    Json j;
    j["tool"] = e.tool;
    j["version"] = e.version;
    j["commit"] = e.commit;
    j["argv"] = e.argv;
    if (e.seed) j["seed"] = *e.seed;
    Json inputs = Json::array();
    for (const auto& i : e.inputs) inputs.push_back(Json{{"path", i.path}, {"sha256", i.sha256}});
    j["inputs"] = inputs;
    // Paths need not be UTF-8; the archive's history must be.
    text += j.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
  }
  return text;
}

History parse_history(const std::string& text, const std::string& file) {
  History history;
  std::istringstream lines(text);
  std::string line;
  for (long n = 1; std::getline(lines, line); ++n) {
    if (line.empty()) continue;
    try {
      const Json j = Json::parse(line);
      HistoryEntry e;
      e.tool = j.at("tool").get<std::string>();
      e.version = j.at("version").get<std::string>();
      e.commit = j.value("commit", std::string());
      e.argv = j.at("argv").get<std::vector<std::string>>();
      if (j.contains("seed")) {
        if (!j.at("seed").is_number_unsigned()) refuse({file, 0, "history line " + std::to_string(n)}, "a seed that is no whole number from 0");
        e.seed = j.at("seed").get<std::uint64_t>();
      }
      for (const auto& i : j.value("inputs", Json::array())) e.inputs.push_back({i.at("path").get<std::string>(), i.at("sha256").get<std::string>()});
      history.push_back(std::move(e));
    } catch (const Json::exception&) {
      refuse({file, 0, "history line " + std::to_string(n)}, "is not a JSON object with tool, version and argv");
    }
  }
  return history;
}

void merge_into(History& history, const History& other) {
  for (const auto& e : other) {
    const auto same = [&](const HistoryEntry& o) { return o.tool == e.tool && o.version == e.version && o.commit == e.commit && o.argv == e.argv && o.seed == e.seed; };
    const auto it = std::find_if(history.begin(), history.end(), same);
    if (it == history.end()) {
      history.push_back(e);
      continue;
    }
    std::set<std::pair<std::string, std::string>> known;
    for (const auto& i : it->inputs) known.emplace(i.path, i.sha256);
    for (const auto& i : e.inputs)
      if (known.emplace(i.path, i.sha256).second) it->inputs.push_back(i);
  }
}

void HistoryUnion::add(const History& history) {
  std::map<std::string, int> occurrences;
  std::string before;
  for (const auto& e : history) {
    HistoryEntry bare = e;
    bare.inputs.clear();
    std::string key = to_json_lines({bare});
    key += std::to_string(++occurrences[key]);
    Node& node = nodes_[key];
    node.entry = std::move(bare);
    for (const auto& i : e.inputs) node.inputs.emplace(i.path, i.sha256);
    if (!before.empty()) node.after.insert(before);
    before = std::move(key);
  }
}

History HistoryUnion::merged() const {
  History history;
  std::set<std::string> placed;
  while (placed.size() < nodes_.size()) {
    const auto waiting = [&](const auto& node) { return !placed.contains(node.first); };
    const auto ready = [&](const auto& node) {
      return waiting(node) && std::all_of(node.second.after.begin(), node.second.after.end(), [&](const std::string& key) { return placed.contains(key); });
    };
    auto next = std::find_if(nodes_.begin(), nodes_.end(), ready);
    if (next == nodes_.end()) next = std::find_if(nodes_.begin(), nodes_.end(), waiting);
    placed.insert(next->first);
    history.push_back(next->second.entry);
    for (const auto& [path, sha256] : next->second.inputs) history.back().inputs.push_back({path, sha256});
  }
  return history;
}

void sort_inputs(std::vector<HistoryInput>& inputs) {
  std::sort(inputs.begin(), inputs.end(), [](const HistoryInput& a, const HistoryInput& b) { return std::tie(a.path, a.sha256) < std::tie(b.path, b.sha256); });
}

std::string to_shell(const History& history) {
  std::string text = "#!/bin/sh\nset -eu\n";
  for (const auto& e : history) {
    text += "\n# " + comment(e.tool + " " + e.version + " (" + e.commit + ")") + "\n";
    for (const auto& i : e.inputs) text += "# input " + comment(i.sha256 + "  " + i.path) + "\n";
    for (std::size_t k = 0; k < e.argv.size(); ++k) text += (k ? " " : "") + quoted(e.argv[k]);
    text += "\n";
  }
  return text;
}

}  // namespace mocap
