#include "libmodels/lstm_gmm/config.hpp"

#include <fmt/format.h>

#include "libmocap/base/error.hpp"

namespace mocap::lstm_gmm {
namespace {

constexpr int kMost = 1 << 16;

[[noreturn]] void refuse_config(const std::string& what) { refuse(Where{{}, 0, "/config"}, what); }

template <class Config, class F>
void for_each_size(Config& c, F f) {
  f("features", c.features);
  f("contacts", c.contacts);
  f("hidden", c.hidden);
  f("width", c.width);
  f("mixtures", c.mixtures);
}

}  // namespace

Cell parse_cell(const std::string& name) {
  if (name == "paper") return Cell::paper;
  if (name == "standard") return Cell::standard;
  refuse_usage(fmt::format("cell '{}', expected paper or standard", name));
}

std::string text(Cell cell) { return cell == Cell::paper ? "paper" : "standard"; }

std::int64_t LstmGmmConfig::parameter_count() const {
  const std::int64_t h = hidden, w = width, seen = cell == Cell::paper ? 2 * h : h;
  return (std::int64_t{input()} + 1) * w + 4 * h * (w + seen + 1) + 4 * h * (h + seen + 1) + (h + 1) * w + (w + 1) * outputs();
}

LstmGmmConfig LstmGmmConfig::preset(const std::string& name) {
  LstmGmmConfig c;
  if (name == "small")
    c.hidden = c.width = 256;
  else if (name != "paper")
    refuse_usage(fmt::format("preset '{}', expected paper or small", name));
  return c;
}

void LstmGmmConfig::validate() const {
  for_each_size(*this, [](const char* name, int value) {
    if (value < 1 || value > kMost) refuse_config(fmt::format("{} is {}, expected a whole number in 1..{}", name, value, kMost));
  });
  if (!(carry >= 0 && carry <= 1)) refuse_config(fmt::format("carry is {}, expected a share", carry));
  constexpr std::int64_t kMostOutputs = 1 << 24;
  if (const std::int64_t all = std::int64_t{mixtures} * (2 * std::int64_t{features} + 1) + contacts; all > kMostOutputs) refuse_config(fmt::format("{} outputs, expected at most {}", all, kMostOutputs));
}

nlohmann::json to_json(const LstmGmmConfig& config) {
  nlohmann::json json;
  for_each_size(config, [&](const char* name, int value) { json[name] = value; });
  json["cell"] = text(config.cell);
  json["carry"] = config.carry;
  return json;
}

LstmGmmConfig config_from_json(const nlohmann::json& json) {
  LstmGmmConfig config;
  const auto field = [&](const char* name) -> const nlohmann::json& {
    if (!json.is_object() || !json.contains(name)) refuse_config(fmt::format("no {}, expected the sizes of an lstm-gmm network", name));
    return json.at(name);
  };
  for_each_size(config, [&](const char* name, int& value) {
    const nlohmann::json& given = field(name);
    if (!given.is_number_integer() || given.get<double>() < 1 || given.get<double>() > kMost)
      refuse_config(fmt::format("{} is {}, expected a whole number in 1..{}", name, given.is_structured() ? given.type_name() : given.dump(), kMost));  // dump() recurses
    given.get_to(value);
  });
  const nlohmann::json& cell = field("cell");
  if (!cell.is_string() || (cell != "paper" && cell != "standard")) refuse_config("cell is neither \"paper\" nor \"standard\"");
  config.cell = parse_cell(cell.get<std::string>());
  if (!field("carry").is_number()) refuse_config("carry is no number");
  field("carry").get_to(config.carry);
  config.validate();
  return config;
}

}  // namespace mocap::lstm_gmm
