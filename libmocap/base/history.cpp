#include "libmocap/base/history.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string_view>
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

// Takes an entry from the parser's events: an archive of 20,000 files has as many inputs, and a tree of them would take
// longer to build than all the rest of its index to read. A function that returns false ends the parsing.
class EntryReader : public nlohmann::json_sax<Json> {
 public:
  HistoryEntry entry;
  bool bad_seed = false;
  bool whole() const { return found_.contains("tool") && found_.contains("version") && found_.contains("argv"); }

  bool string(std::string& value) override {
    std::string* place = nullptr;
    if (depth_ == 1) place = key_ == "tool" ? &entry.tool : key_ == "version" ? &entry.version : key_ == "commit" ? &entry.commit : nullptr;
    else if (depth_ == 2 && key_ == "argv") place = &entry.argv.emplace_back();
    else if (depth_ == 3 && key_ == "inputs" && (inner_key_ == "path" || inner_key_ == "sha256")) place = take(inner_key_ == "path" ? path_ : sha256_);
    if (!place) return other();
    *place = std::move(value);
    if (depth_ == 1) found_.insert(key_);
    return true;
  }
  bool key(std::string& name) override {
    if (depth_ == 1) key_ = std::move(name);
    else if (depth_ == 3) inner_key_ = std::move(name);
    return true;
  }
  bool number_unsigned(std::uint64_t value) override {
    if (depth_ != 1 || key_ != "seed") return other();
    entry.seed = value;
    return true;
  }
  bool start_array(std::size_t) override {
    const bool list = depth_ == 1 && (key_ == "argv" || key_ == "inputs");
    if (!list && !other()) return false;
    if (list) found_.insert(key_);
    ++depth_;
    return true;
  }
  bool start_object(std::size_t) override {
    const bool input = depth_ == 2 && key_ == "inputs";
    if (depth_ > 0 && !input && !other()) return false;
    if (input) entry.inputs.emplace_back(), path_ = sha256_ = false;
    ++depth_;
    return true;
  }
  bool end_array() override { return --depth_, true; }
  bool end_object() override { return --depth_, depth_ != 2 || key_ != "inputs" || (path_ && sha256_); }
  bool null() override { return other(); }
  bool boolean(bool) override { return other(); }
  bool number_integer(std::int64_t) override { return other(); }
  bool number_float(double, const std::string&) override { return other(); }
  bool binary(Json::binary_t&) override { return other(); }
  bool parse_error(std::size_t, const std::string&, const nlohmann::detail::exception&) override { return false; }

 private:
  std::string* take(bool& flag) {
    flag = true;
    return inner_key_ == "path" ? &entry.inputs.back().path : &entry.inputs.back().sha256;
  }
  // A value that no field takes: fine below keys that are not known.
  bool other() {
    if (depth_ == 0) return false;
    bad_seed = depth_ == 1 && key_ == "seed";
    const bool field = key_ == "tool" || key_ == "version" || key_ == "commit" || key_ == "argv" || key_ == "seed" || key_ == "inputs";
    if (depth_ == 3 && key_ == "inputs") return inner_key_ != "path" && inner_key_ != "sha256";
    return !field || depth_ > 3;
  }

  std::string key_, inner_key_;
  std::set<std::string> found_;
  int depth_ = 0;
  bool path_ = false, sha256_ = false;
};

// The inputs that to_json_lines wrote at the end of `line`, and the line without them; nothing where a character of them
// is not plain ASCII or the text differs in any other way. A JSON parser takes three times as long.
std::optional<std::pair<std::string, std::vector<HistoryInput>>> split_plain_inputs(std::string_view line) {
  constexpr std::string_view kKey = ",\"inputs\":[";
  const auto key = line.find(kKey);
  if (key == std::string_view::npos) return std::nullopt;
  std::string_view rest = line.substr(key + kKey.size());
  const auto skip = [&](std::string_view text) {
    const bool here = rest.starts_with(text);
    if (here) rest.remove_prefix(text.size());
    return here;
  };
  const auto plain = [&](std::string& out) {
    std::size_t n = 0;
    while (n < rest.size() && rest[n] >= 0x20 && rest[n] < 0x7f && rest[n] != '"' && rest[n] != '\\') ++n;
    out = rest.substr(0, n);
    rest.remove_prefix(n);
  };
  std::vector<HistoryInput> inputs;
  while (skip(inputs.empty() ? "{\"path\":\"" : ",{\"path\":\"")) {
    HistoryInput& input = inputs.emplace_back();
    plain(input.path);
    if (!skip("\",\"sha256\":\"")) return std::nullopt;
    plain(input.sha256);
    if (!skip("\"}")) return std::nullopt;
  }
  if (inputs.empty() || rest != "]}") return std::nullopt;
  return std::pair{std::string(line.substr(0, key)) + "}", std::move(inputs)};
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
  long n = 1;
  for (std::size_t at = 0; at < text.size(); ++n) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    const Where where{file, 0, "history line " + std::to_string(n)};
    std::string_view line = std::string_view(text).substr(at, end - at);
    at = end + 1;
    if (line.empty()) continue;
    auto split = split_plain_inputs(line);
    if (split) line = split->first;
    EntryReader reader;
    const bool parsed = Json::sax_parse(line.begin(), line.end(), &reader);
    if (reader.bad_seed) refuse(where, "a seed that is no whole number from 0");
    if (!parsed || !reader.whole()) refuse(where, "is not a JSON object with tool, version and argv");
    if (split) reader.entry.inputs = std::move(split->second);
    history.push_back(std::move(reader.entry));
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
