#include "libmodels/baselines/config.hpp"

#include <fmt/format.h>

#include <numeric>

#include "libmocap/base/error.hpp"

namespace mocap::baselines {
namespace {

constexpr int kMost = 1 << 16;

[[noreturn]] void refuse_config(const std::string& what) { refuse(Where{{}, 0, "/config"}, what); }

template <class Config, class F>
void for_each_size(Config& c, F f) {
  f("joints", c.joints);
  f("rotation_values", c.rotation_values);
  f("root_values", c.root_values);
  f("hidden", c.hidden);
  f("width", c.width);
  f("narrow", c.narrow);
}

int checked_size(const nlohmann::json& value, const std::string& name) {
  if (!value.is_number_integer() || value.get<double>() < 1 || value.get<double>() > kMost)
    refuse_config(fmt::format("{} is {}, expected a whole number in 1..{}", name, value.is_structured() ? value.type_name() : value.dump(), kMost));  // dump() recurses
  return value.get<int>();
}

}  // namespace

std::string text(Arch arch) { return arch == Arch::erd ? "erd" : "quaternet"; }

int BaselineConfig::attribute_total() const { return std::accumulate(attribute_classes.begin(), attribute_classes.end(), 0); }

int BaselineConfig::attribute_combinations() const { return std::accumulate(attribute_classes.begin(), attribute_classes.end(), 1, std::multiplies<>()); }

std::int64_t BaselineConfig::combination(std::span<const std::int64_t> classes) const {
  if (classes.size() != attribute_classes.size()) throw Error(Exit::internal, {}, fmt::format("{}: {} attributes, expected {}", text(arch), classes.size(), attribute_classes.size()));
  std::int64_t index = 0;
  for (std::size_t i = 0; i < classes.size(); ++i) {
    if (classes[i] < 0 || classes[i] >= attribute_classes[i])
      throw Error(Exit::internal, {}, fmt::format("{}: class {} of attribute {}, expected 0..{}", text(arch), classes[i], i, attribute_classes[i] - 1));
    index = index * attribute_classes[i] + classes[i];
  }
  return index;
}

BaselineConfig BaselineConfig::preset(Arch arch, const std::string& name) {
  BaselineConfig config;
  config.arch = arch;
  if (name == "small") {
    config.hidden = 256;
    config.width = 128;
  } else if (name != "paper") {
    refuse_usage(fmt::format("preset '{}', expected paper or small", name));
  }
  return config;
}

void BaselineConfig::validate() const {
  const auto check = [](const char* name, int value) {
    if (value < 1 || value > kMost) refuse_config(fmt::format("{} is {}, expected a whole number in 1..{}", name, value, kMost));
  };
  for_each_size(*this, check);
  if (rotation_values != 4) refuse_config(fmt::format("rotation_values is {}, expected 4: {} predicts quaternions", rotation_values, text(arch)));
  if (attribute_classes.empty()) refuse_config("attribute_classes is empty, expected at least one attribute");
  long combinations = 1;
  for (const int classes : attribute_classes) {
    check("attribute_classes", classes);
    combinations *= classes;
    if (combinations > kMost) refuse_config(fmt::format("{} combinations of attributes or more, expected at most {}", combinations, kMost));
  }
}

nlohmann::json to_json(const BaselineConfig& config) {
  nlohmann::json json;
  for_each_size(config, [&](const char* name, int value) { json[name] = value; });
  json["attribute_classes"] = config.attribute_classes;
  return json;
}

BaselineConfig config_from_json(Arch arch, const nlohmann::json& json) {
  BaselineConfig config;
  config.arch = arch;
  const auto field = [&](const char* name) -> const nlohmann::json& {
    if (!json.is_object() || !json.contains(name)) refuse_config(fmt::format("no {}, expected the sizes of a {} network", name, text(arch)));
    return json.at(name);
  };
  for_each_size(config, [&](const char* name, int& value) { value = checked_size(field(name), name); });
  const nlohmann::json& classes = field("attribute_classes");
  if (!classes.is_array()) refuse_config(fmt::format("attribute_classes is {}, expected a list of sizes", classes.type_name()));
  config.attribute_classes.clear();
  for (const auto& item : classes) config.attribute_classes.push_back(checked_size(item, "attribute_classes"));
  config.validate();
  return config;
}

}  // namespace mocap::baselines
