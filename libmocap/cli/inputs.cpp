// What the command line names -> the files of a batch.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>
#include <system_error>

#include "libmocap/base/log.hpp"
#include "libmocap/base/text_lines.hpp"
#include "libmocap/cli/tool.hpp"
#include "libmocap/cli/validators.hpp"

namespace mocap::cli {
namespace {

namespace fs = std::filesystem;

// Without "./" in front and "//" inside: what makes two spellings of a path the same.
std::string normal(const std::string& path) { return fs::path(path).lexically_normal().string(); }

bool same_file(const std::string& a, const std::string& b) {
  std::error_code error;
  return !b.empty() && fs::equivalent(a, b, error) && !error;
}

std::vector<std::string> read_list(const std::string& path) {
  std::vector<std::string> lines;
  for (auto& line : read_lines(path)) lines.push_back(std::move(line.text));
  if (lines.empty()) refuse({path, 0, {}}, "an empty list, expected one path a line");
  return lines;
}

// Files under `folder` that the tool reads, relative to it, sorted bytewise.
std::vector<std::string> search(const std::string& folder, const std::function<bool(const std::string&)>& accepts, const std::string& exclude) {
  std::vector<std::string> found;
  std::error_code error;
  fs::recursive_directory_iterator at(folder, error), end;
  for (; !error && at != end; at.increment(error)) {
    const std::string name = at->path().filename().string();
    std::error_code unreadable;
    const bool is_folder = at->is_directory(unreadable) && !at->is_symlink(unreadable);
    if (name.front() == '.' || name.find(".part-") != std::string::npos || same_file(at->path().string(), exclude)) {
      if (is_folder) at.disable_recursion_pending();
      continue;
    }
    if (!is_folder && at->is_regular_file(unreadable) && accepts(at->path().string()))
      found.push_back(at->path().lexically_relative(folder).string());
  }
  if (error) refuse({folder, 0, {}}, "cannot be searched: " + error.message());
  std::sort(found.begin(), found.end());
  return found;
}

// A relative path below the output folder, whatever the label is.
std::string below(const std::string& label) {
  fs::path out;
  for (const auto& part : fs::path(label))
    if (part != ".." && part != "." && part != "/" && !part.empty()) out /= part;
  return out.empty() ? "input" : out.string();
}

std::string without_extension(const std::string& label) {
  fs::path path(label);
  if (path.extension() == ".gz") path.replace_extension();
  return path.replace_extension().string();
}

// Sets `field` of all files that share a value of it to `fallback`, until all are unique or fell back.
template <class Get, class Fallback>
void make_unique(std::vector<InputFile>& files, Get field, Fallback fallback) {
  std::vector<bool> fell(files.size(), false);
  for (bool changed = true; changed;) {
    changed = false;
    std::map<std::string, int> count;
    for (auto& f : files) ++count[field(f)];
    for (std::size_t i = 0; i < files.size(); ++i) {
      if (fell[i] || count[field(files[i])] < 2) continue;
      field(files[i]) = fallback(files[i]);
      fell[i] = changed = true;
    }
  }
}

}  // namespace

std::vector<InputFile> expand_inputs(const std::vector<std::string>& typed, const std::function<bool(const std::string&)>& accepts,
                                     const std::string& exclude) {
  std::vector<std::string> names;
  for (const auto& name : typed) {
    if (name.size() > 1 && name.front() == '@') {
      for (auto& line : read_list(name.substr(1))) names.push_back(std::move(line));
    } else {
      names.push_back(name);
    }
  }
  if (std::count(names.begin(), names.end(), "-") > 1) refuse_usage("'-' given twice, standard input can be read once");

  std::vector<InputFile> files;
  std::set<std::string> seen;
  const auto add = [&](const std::string& path, const std::string& label) {
    if (seen.insert(normal(path)).second) files.push_back({path, label, {}, {}});
    else log::warn("{}: given twice, read once", path);
  };
  for (const auto& name : names) {
    std::error_code error;
    if (name == "-" || !fs::is_directory(name, error)) {
      add(name, name == "-" ? name : fs::path(name).filename().string());
      continue;
    }
    try {
      const auto found = search(name, accepts, exclude);
      if (found.empty()) refuse({name, 0, {}}, "a folder without any file that can be read, expected at least one");
      for (const auto& relative : found) add((fs::path(name) / relative).string(), relative);
    } catch (const Error& e) {
      files.push_back({name, fs::path(name).filename().string(), {}, e});
    }
  }
  make_unique(files, [](InputFile& f) -> std::string& { return f.label; }, [](const InputFile& f) { return normal(f.path); });
  for (auto& f : files) f.stem = f.label == "-" ? "stdin" : below(without_extension(f.label));
  make_unique(files, [](InputFile& f) -> std::string& { return f.stem; }, [](const InputFile& f) { return below(f.label); });
  std::set<std::string> taken;  // "w.bvh" and "../w.bvh" are still one name below the output
  for (auto& f : files) {
    const std::string stem = f.stem;
    for (int n = 2; !taken.insert(f.stem).second; ++n) f.stem = fmt::format("{}-{}", stem, n);
  }
  return files;
}

std::vector<InputFile> take_shard(std::vector<InputFile> files, const std::string& shard) {
  const auto slash = shard.find('/');
  const std::int64_t index = parse_whole(std::string_view(shard).substr(0, slash)).value_or(0);
  const std::int64_t count = slash == std::string::npos ? 0 : parse_whole(std::string_view(shard).substr(slash + 1)).value_or(0);
  if (index < 1 || count < index) refuse_usage(fmt::format("--shard: '{}', expected I/N with 1 <= I <= N", shard));
  for (const auto& f : files)
    if (f.path == "-") refuse_usage("--shard: standard input cannot be shared out, expected files");
  // Tasks of one job may be given the same files in different order (find, xargs): the cut goes by the path.
  std::sort(files.begin(), files.end(), [](const InputFile& a, const InputFile& b) { return a.path < b.path; });
  std::vector<InputFile> mine;
  for (std::size_t i = static_cast<std::size_t>(index) - 1; i < files.size(); i += static_cast<std::size_t>(count))
    mine.push_back(std::move(files[i]));
  return mine;
}

}  // namespace mocap::cli
