#include "libmodels/motion_cell/config.hpp"

#include <fmt/format.h>

#include "libmocap/base/error.hpp"

namespace mocap::motion_cell {
namespace {

constexpr int kMost = 1 << 16;

[[noreturn]] void refuse_config(const std::string& what) { refuse(Where{{}, 0, "/config"}, what); }

// The one list of fields: written, read and checked from here.
template <class Config, class F>
void for_each_size(Config& c, F f) {
  f("joints", c.joints);
  f("rotation_values", c.rotation_values);
  f("root_values", c.root_values);
  f("word_length", c.word_length);
  f("hidden", c.hidden);
  f("width", c.width);
  f("word", c.word);
  f("latent", c.latent);
  f("control", c.control);
}

int checked_size(const nlohmann::json& value, const std::string& name) {
  if (!value.is_number_integer() || value.get<double>() < 1 || value.get<double>() > kMost)
    refuse_config(fmt::format("{} is {}, expected a whole number in 1..{}", name, value.is_structured() ? value.type_name() : value.dump(), kMost));  // dump() recurses
  return value.get<int>();
}

}  // namespace

int MotionCellConfig::attribute_total() const {
  int sum = 0;
  for (const int classes : attribute_classes) sum += classes;
  return sum;
}

std::int64_t MotionCellConfig::combination(std::span<const std::int64_t> classes) const {
  if (classes.size() != attribute_classes.size())
    throw Error(Exit::internal, {},
                fmt::format("motion cell: {} attributes, expected {}", classes.size(), attribute_classes.size()));
  std::int64_t index = 0;
  for (std::size_t i = 0; i < classes.size(); ++i) {
    if (classes[i] < 0 || classes[i] >= attribute_classes[i])
      throw Error(Exit::internal, {},
                  fmt::format("motion cell: class {} of attribute {}, expected 0..{}", classes[i], i,
                              attribute_classes[i] - 1));
    index = index * attribute_classes[i] + classes[i];
  }
  return index;
}

int MotionCellConfig::attribute_combinations() const {
  int product = 1;
  for (const int classes : attribute_classes) product *= classes;
  return product;
}

MotionCellConfig MotionCellConfig::preset(const std::string& name) {
  MotionCellConfig config;
  if (name == "small") {
    config.hidden = 256;
    config.overlap = 3;
  } else if (name != "paper")
    refuse_usage(fmt::format("preset '{}', expected paper or small", name));
  return config;
}

void MotionCellConfig::validate() const {
  const auto check = [](const char* name, int value) {
    if (value < 1 || value > kMost)
      refuse_config(fmt::format("{} is {}, expected a whole number in 1..{}", name, value, kMost));
  };
  for_each_size(*this, check);
  if (overlap < 0 || overlap > word_length || (single_layer && overlap > 0))
    refuse_config(fmt::format("overlap is {}, expected a whole number in 0..{}", overlap, single_layer ? 0 : word_length));
  if (single_layer && word_length != 1) refuse_config(fmt::format("word_length is {} with single_layer, expected 1", word_length));
  if (attribute_classes.empty()) refuse_config("attribute_classes is empty, expected at least one attribute");
  long combinations = 1;
  for (const int classes : attribute_classes) {
    check("attribute_classes", classes);
    combinations *= classes;
    if (combinations > kMost)
      refuse_config(fmt::format("{} combinations of attributes or more, expected at most {}", combinations, kMost));
  }
}

nlohmann::json to_json(const MotionCellConfig& config) {
  nlohmann::json json;
  for_each_size(config, [&](const char* name, int value) { json[name] = value; });
  json["single_layer"] = config.single_layer;
  json["overlap"] = config.overlap;
  json["attribute_classes"] = config.attribute_classes;
  return json;
}

MotionCellConfig config_from_json(const nlohmann::json& json) {
  MotionCellConfig config;
  const auto field = [&](const char* name) -> const nlohmann::json& {
    if (!json.is_object() || !json.contains(name))
      refuse_config(fmt::format("no {}, expected the sizes of a motion cell", name));
    return json.at(name);
  };
  for_each_size(config, [&](const char* name, int& value) { value = checked_size(field(name), name); });
  if (json.contains("single_layer")) {  // models from before there was one lack it
    if (!json.at("single_layer").is_boolean()) refuse_config("single_layer is neither true nor false");
    json.at("single_layer").get_to(config.single_layer);
  }
  if (json.contains("overlap")) {
    if (!json.at("overlap").is_number_integer()) refuse_config("overlap is no whole number");
    const auto frames = json.at("overlap").get<std::int64_t>();
    config.overlap = frames < 0 || frames > kMost ? -1 : static_cast<int>(frames);
  }
  const nlohmann::json& classes = field("attribute_classes");
  if (!classes.is_array())
    refuse_config(fmt::format("attribute_classes is {}, expected a list of sizes", classes.type_name()));
  config.attribute_classes.clear();
  for (const auto& item : classes) config.attribute_classes.push_back(checked_size(item, "attribute_classes"));
  config.validate();
  return config;
}

}  // namespace mocap::motion_cell
