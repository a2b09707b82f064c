// The command as history records it.
#include <algorithm>
#include <filesystem>
#include <set>

#include "libmocap/base/version.hpp"
#include "libmocap/cli/option_values.hpp"
#include "libmocap/cli/tool.hpp"

namespace mocap::cli {

std::vector<std::string> normalised_argv(const CLI::App& app, const Tool& tool, const Common& common) {
  std::set<std::string> left_out{"output", "force",   "threads",       "verbose",  "quiet",     "log-level", "progress",
                                 "shard",  "rejects", "skip-existing", "fail-fast", "json"};
  for (std::string name : tool.non_content_options()) {
    name.erase(0, name.find_first_not_of('-'));
    left_out.insert(name);
  }
  std::vector<std::pair<std::string, std::vector<std::string>>> options;
  for (const CLI::Option* option : app.get_options()) {
    if (!option->get_configurable()) continue;  // --help, --config, the inputs: they act, they do not set
    const std::string name = option->get_lnames().empty() ? option->get_single_name() : option->get_lnames().front();
    if (left_out.contains(name)) continue;
    std::vector<std::string> words;
    if (is_flag(*option)) {
      const std::string value = flag_value(*option);
      if (value == "true") words.push_back("--" + name);
      else if (value != option->get_default_str() && (value != "false" || option->count() > 0)) words.push_back("--" + name + "=" + value);
    } else {
      const bool is_file = placeholder(*option).starts_with("FILE");
      for (const auto& v : effective_values(*option)) {
        // Where a file lies is no part of what was done; its digest belongs to the inputs.
        const std::string value = name == "device" ? common.device : is_file && v != "-" ? std::filesystem::path(v).filename().string() : v;
        words.push_back("--" + name + "=" + value);
      }
    }
    if (!words.empty()) options.emplace_back(name, std::move(words));
  }
  std::sort(options.begin(), options.end());
  std::vector<std::string> argv{tool.name()};
  for (auto& [name, words] : options) argv.insert(argv.end(), words.begin(), words.end());
  return argv;
}

bool same_work(const History& existing, const HistoryEntry& now) {
  if (existing.empty()) return false;
  const HistoryEntry& last = existing.back();
  const auto same_input = [](const HistoryInput& a, const HistoryInput& b) { return a.path == b.path && a.sha256 == b.sha256; };
  return last.tool == now.tool && last.argv == now.argv && last.seed == now.seed &&
         std::equal(last.inputs.begin(), last.inputs.end(), now.inputs.begin(), now.inputs.end(), same_input);
}

}  // namespace mocap::cli
