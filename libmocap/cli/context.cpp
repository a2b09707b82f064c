#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>

#include "libmocap/base/log.hpp"
#include "libmocap/base/version.hpp"
#include "libmocap/cli/progress.hpp"
#include "libmocap/cli/report.hpp"
#include "libmocap/cli/tool.hpp"

namespace mocap::cli {
namespace {

// A field of a TSV row: a file name may hold a tab or a line break.
std::string field(const std::string& text) {
  std::string s;
  for (const char c : text) s += c == '\t' ? "\\t" : c == '\n' ? "\\n" : c == '\r' ? "\\r" : c == '\\' ? "\\\\" : std::string(1, c);
  return s;
}

}  // namespace

struct Context::State {
  State(Tool& t, CLI::App& a, Common c) : tool(t), app(a), common(std::move(c)), line(Progress::mode(common.progress, common.quiet)) {}

  Tool& tool;
  CLI::App& app;
  Common common;
  std::vector<InputFile> inputs, all;
  bool lone = false;
  Progress line;
  std::string rejects = "file\tline\tstatus\treason\n";
  std::size_t rejected = 0;
  Exit worst = Exit::ok;
};

Context::Context(Tool& tool, CLI::App& app, Common common) : state_(std::make_unique<State>(tool, app, std::move(common))) {
  State& s = *state_;
  const auto& typed = s.common.inputs;
  if (tool.traits().inputs == Inputs::many) {
    s.inputs = expand_inputs(typed, [&](const std::string& path) { return tool.accepts(path); }, s.common.output);
  } else {
    for (const auto& path : typed) {
      const std::string label = path == "-" ? path : std::filesystem::path(path).filename().string();
      s.inputs.push_back({path, label, path == "-" ? "stdin" : std::filesystem::path(label).stem().string(), {}});
    }
  }
  s.lone = typed.size() == 1 && s.inputs.size() == 1 && (s.inputs[0].path == typed[0] || typed[0] == "-");
  if (s.lone && s.inputs[0].failure) throw Error(*s.inputs[0].failure);
  if (s.lone && typed[0] != "-" && ::access(typed[0].c_str(), R_OK) != 0)
    refuse({typed[0], 0, {}}, std::string("cannot be opened: ") + std::strerror(errno));
  s.all = s.inputs;
  if (!s.common.shard.empty()) s.inputs = take_shard(std::move(s.inputs), s.common.shard);
  if (tool.traits().by_label) std::sort(s.inputs.begin(), s.inputs.end(), [](const InputFile& a, const InputFile& b) { return a.label < b.label; });
}

Context::~Context() = default;

const Common& Context::common() const { return state_->common; }
Overwrite Context::overwrite() const { return common().force || common().skip_existing ? Overwrite::allow : Overwrite::refuse; }
int Context::threads() const { return common().threads; }
std::uint64_t Context::seed() const { return common().seed; }
const std::vector<InputFile>& Context::inputs() const { return state_->inputs; }
const std::vector<InputFile>& Context::all_inputs() const { return state_->all; }
bool Context::lone_input() const { return state_->lone; }

HistoryEntry Context::history_entry(std::vector<HistoryInput> inputs) const {
  HistoryEntry entry;
  entry.tool = state_->tool.name();
  entry.version = version();
  entry.commit = commit();
  entry.argv = normalised_argv(state_->app, state_->tool, common());
  if (state_->tool.traits().random) entry.seed = seed();
  entry.inputs = std::move(inputs);
  return entry;
}

bool Context::up_to_date(const std::string& path, const HistoryEntry& now, const std::function<History(const std::string&)>& read) const {
  if (!common().skip_existing || path == "-" || ::access(path.c_str(), F_OK) != 0) return false;
  History existing;
  try {
    existing = read(path);
  } catch (const Error&) {
    // A damaged or foreign file: judged below like one without a history.
  }
  if (same_work(existing, now)) return true;
  if (!common().force && (existing.empty() || existing.back().tool != now.tool))
    throw Error(Exit::io, {path, 0, {}}, "exists already and was not made by " + now.tool, "use -f to replace it");
  return false;
}

void Context::progress(std::size_t done, std::size_t total, const std::string& unit) { state_->line.update(done, total, unit); }

void Context::print(const std::string& text) {
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size())
    throw Error(Exit::io, {"<stdout>", 0, {}}, std::string("write failed: ") + std::strerror(errno));
}

bool Context::reject(const InputFile& input, const Error& error) {
  State& s = *state_;
  s.line.clear();
  const Error named = error.where().file.empty() ? error.in_file(input.path == "-" ? "<stdin>" : input.path) : error;
  report(s.tool.name(), named, s.common.verbose);
  const auto& where = named.where();
  s.rejects += fmt::format("{}\t{}\t{}\t{}\n", field(input.path), where.line > 0 ? std::to_string(where.line) : "",
                           static_cast<int>(named.status()),
                           field((where.object.empty() ? "" : where.object + ": ") + named.message()));
  ++s.rejected;
  s.worst = std::max(s.worst, named.status());
  return s.common.fail_fast;
}

std::size_t Context::rejected() const { return state_->rejected; }

Exit Context::batch_status() const {
  if (state_->rejected == 0) return Exit::ok;
  return state_->lone ? state_->worst : Exit::some_failed;
}

void Context::finish() {
  State& s = *state_;
  s.line.clear();
  if (s.rejected > 0 && !s.lone) log::warn("{} of {} inputs failed", s.rejected, s.inputs.size());
  if (!s.common.rejects.empty()) write_file(s.common.rejects, s.rejects, overwrite());
}

}  // namespace mocap::cli
