#define PCRE2_CODE_UNIT_WIDTH 8
#include "libmocap/formats/path_attributes.hpp"

#include <fmt/core.h>
#include <pcre2.h>

#include <filesystem>
#include <vector>

#include "libmocap/base/error.hpp"

namespace mocap::formats {
namespace {

std::string pcre_message(int code) {
  PCRE2_UCHAR text[256];
  pcre2_get_error_message(code, text, sizeof text);
  return reinterpret_cast<const char*>(text);
}

PCRE2_SPTR units(const std::string& text) { return reinterpret_cast<PCRE2_SPTR>(text.c_str()); }

// Folder names above the file, outermost first, without "." and "..".
std::vector<std::string> folders_of(const std::string& path) {
  std::vector<std::string> out;
  for (const auto& part : std::filesystem::path(path).lexically_normal().parent_path())
    if (part != "." && part != ".." && part != "/" && !part.empty()) out.push_back(part.string());
  return out;
}

}  // namespace

struct PathAttributes::Compiled {
  std::string text;
  std::unique_ptr<pcre2_code, void (*)(pcre2_code*)> code{nullptr, pcre2_code_free};
  std::unique_ptr<pcre2_match_context, void (*)(pcre2_match_context*)> limits{nullptr, pcre2_match_context_free};
  std::vector<std::pair<std::string, std::uint32_t>> groups;  // name and number
};

PathAttributes::PathAttributes(const std::string& regex) {
  const auto made = std::make_shared<Compiled>();
  made->text = regex;
  int error = 0;
  PCRE2_SIZE at = 0;
  // Paths are bytes: one that is not UTF-8 must not end the run.
  made->code.reset(pcre2_compile(units(regex), regex.size(), PCRE2_UTF | PCRE2_MATCH_INVALID_UTF | PCRE2_NEVER_BACKSLASH_C, &error, &at, nullptr));
  if (!made->code) refuse_usage(fmt::format("--attr-from-path: '{}': {} at character {}, expected a regular expression", regex, pcre_message(error), at + 1));
  std::uint32_t count = 0, size = 0;
  PCRE2_SPTR table = nullptr;
  pcre2_pattern_info(made->code.get(), PCRE2_INFO_NAMECOUNT, &count);
  pcre2_pattern_info(made->code.get(), PCRE2_INFO_NAMEENTRYSIZE, &size);
  pcre2_pattern_info(made->code.get(), PCRE2_INFO_NAMETABLE, &table);
  if (count == 0) refuse_usage(fmt::format("--attr-from-path: '{}' has no named group, expected (?<name>...) for each attribute", regex));
  for (std::uint32_t i = 0; i < count; ++i, table += size)
    made->groups.emplace_back(reinterpret_cast<const char*>(table + 2), static_cast<std::uint32_t>(table[0]) << 8 | table[1]);
  made->limits.reset(pcre2_match_context_create(nullptr));
  pcre2_set_match_limit(made->limits.get(), 1'000'000);
  compiled_ = made;
}

bool PathAttributes::apply(Attributes& attributes, const std::string& path, const std::string& label) const {
  const std::unique_ptr<pcre2_match_data, void (*)(pcre2_match_data*)> data(pcre2_match_data_create_from_pattern(compiled_->code.get(), nullptr), pcre2_match_data_free);
  for (const std::string* subject : {&label, &path}) {
    const int found = pcre2_match(compiled_->code.get(), units(*subject), subject->size(), 0, 0, data.get(), compiled_->limits.get());
    if (found == PCRE2_ERROR_NOMATCH) continue;
    if (found < 0) refuse_usage(fmt::format("--attr-from-path: '{}' on '{}': {}, expected a simpler expression", compiled_->text, *subject, pcre_message(found)));
    const PCRE2_SIZE* range = pcre2_get_ovector_pointer(data.get());
    for (const auto& [name, group] : compiled_->groups) {
      const PCRE2_SIZE begin = range[2 * group], end = range[2 * group + 1];
      if (begin != PCRE2_UNSET && end > begin) attributes[name] = subject->substr(begin, end - begin);
    }
    return true;
  }
  return false;
}

void amass_attributes(Attributes& attributes, const std::string& path, const std::string& label) {
  std::string name = std::filesystem::path(label).filename().string();
  if (name.ends_with(".gz")) name.resize(name.size() - 3);
  if (!name.ends_with("_poses.npz") && !name.ends_with("_stageii.npz")) return;
  auto folders = folders_of(label);
  if (folders.size() < 2) {
    auto typed = folders_of(path);
    if (typed.size() > folders.size()) folders = std::move(typed);
  }
  if (!folders.empty()) attributes.try_emplace("subject", folders.back());
  if (folders.size() > 1) attributes.try_emplace("dataset", folders[folders.size() - 2]);
}

}  // namespace mocap::formats
