#include "libmocap/draw/selection.hpp"

#include <algorithm>
#include <charconv>
#include <map>
#include <set>

#include "libmocap/base/error.hpp"

namespace mocap::draw {
namespace {

std::set<std::string> labelled(const std::vector<Attributes>& clips) {
  std::set<std::string> names;
  for (const Attributes& a : clips)
    for (const auto& [name, value] : a)
      if (!value.empty()) names.insert(name);
  return names;
}

// Combination -> first clip that has it, whole.
std::map<std::vector<std::string>, std::size_t> first_of_each(const std::vector<Attributes>& clips, const std::vector<std::string>& names) {
  std::map<std::vector<std::string>, std::size_t> out;
  for (std::size_t i = 0; i < clips.size(); ++i) {
    std::vector<std::string> key;
    for (const auto& n : names) {
      const auto it = clips[i].find(n);
      if (it == clips[i].end() || it->second.empty()) break;
      key.push_back(it->second);
    }
    if (key.size() == names.size()) out.emplace(key, i);
  }
  return out;
}

}  // namespace

std::vector<std::size_t> evenly_chosen(std::size_t n, std::size_t count) {
  std::vector<std::size_t> out;
  const std::size_t m = std::min(n, count);
  for (std::size_t k = 0; k < m; ++k) out.push_back(k * n / m);
  return out;
}

std::vector<std::size_t> clips_named(const std::vector<std::string>& names, const std::vector<std::string>& wanted) {
  std::vector<std::size_t> out;
  for (const auto& w : wanted) {
    if (const auto it = std::find(names.begin(), names.end(), w); it != names.end()) {
      out.push_back(static_cast<std::size_t>(it - names.begin()));
      continue;
    }
    std::size_t number = 0;
    const auto [end, error] = std::from_chars(w.data(), w.data() + w.size(), number);
    if (error != std::errc() || end != w.data() + w.size() || number < 1 || number > names.size())
      refuse_usage("--clip " + w + ": no clip of that name, expected a name or a number from 1 to " + std::to_string(names.size()));
    out.push_back(number - 1);
  }
  return out;
}

std::vector<Pair> pair_by_attributes(const std::vector<Attributes>& first, const std::vector<Attributes>& second) {
  std::vector<std::string> common;
  const auto a = labelled(first), b = labelled(second);
  std::set_intersection(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(common));
  std::vector<Pair> pairs;
  if (common.empty()) {
    for (std::size_t i = 0; i < std::min(first.size(), second.size()); ++i) pairs.push_back({i, i});
    return pairs;
  }
  const auto others = first_of_each(second, common);
  for (const auto& [key, i] : first_of_each(first, common))
    if (const auto it = others.find(key); it != others.end()) pairs.push_back({i, it->second});
  return pairs;
}

}  // namespace mocap::draw
