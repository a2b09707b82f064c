#include "libmodels/cae_vae/config.hpp"

#include <fmt/format.h>

#include "libmocap/base/error.hpp"
#include "libmocap/features/motegi.hpp"

namespace mocap::cae_vae {
namespace {

constexpr int kMost = 4096;

[[noreturn]] void refuse_config(const std::string& what) { refuse(Where{{}, 0, "/config"}, what); }

template <class Config, class F>
void for_each_size(Config& c, F f) {
  f("window", c.window, 2);
  f("kernel", c.kernel, 1);
  f("filters", c.filters, 1);
  f("root_filters", c.root_filters, 0);
  f("hidden", c.hidden, 1);
  f("latent", c.latent, 1);
}

}  // namespace

RootFilters parse_root_filters(const std::string& name) {
  if (name == "shared") return RootFilters::shared;
  if (name == "separate") return RootFilters::separate;
  refuse_usage(fmt::format("root filters '{}', expected shared or separate", name));
}

std::string text(RootFilters filters) { return filters == RootFilters::shared ? "shared" : "separate"; }

Upsampling parse_upsampling(const std::string& name) {
  if (name == "nearest") return Upsampling::nearest;
  if (name == "linear") return Upsampling::linear;
  refuse_usage(fmt::format("upsampling '{}', expected nearest or linear", name));
}

std::string text(Upsampling upsampling) { return upsampling == Upsampling::nearest ? "nearest" : "linear"; }

std::int64_t CaeVaeConfig::parameter_count() const {
  constexpr std::int64_t kColumns = features::kMotegiColumns, kRoot = features::kMotegiRootVelocities;
  const std::int64_t weights = root_filters == 0 ? std::int64_t{filters} * kColumns : std::int64_t{filters - root_filters} * (kColumns - kRoot) + std::int64_t{root_filters} * kRoot;
  const std::int64_t autoencoder = 2 * weights * kernel + filters + kColumns, scale = 2 * std::int64_t{filters}, h = hidden, y = features(), z = latent;
  return autoencoder + scale + (y + 1) * h + (h + 1) * 2 * z + (z + 1) * h + (h + 1) * 2 * y;
}

void CaeVaeConfig::validate() const {
  for_each_size(*this, [](const char* name, int value, int least) {
    if (value < least || value > kMost) refuse_config(fmt::format("{} is {}, expected a whole number in {}..{}", name, value, least, kMost));
  });
  if (window % 2 != 0) refuse_config(fmt::format("window is {}, expected an even number of frames", window));
  if (kernel % 2 == 0 || kernel > window) refuse_config(fmt::format("kernel is {}, expected an odd number of frames within the window", kernel));
  if (root_filters >= filters) refuse_config(fmt::format("root_filters is {}, expected fewer than the {} filters", root_filters, filters));
  constexpr std::int64_t kMostWeights = 1 << 24;
  if (const std::int64_t most = std::max<std::int64_t>(2 * std::int64_t{features()} * hidden, std::int64_t{filters} * kernel * features::kMotegiColumns); most > kMostWeights)
    refuse_config(fmt::format("a layer of {} weights, expected at most {}", most, kMostWeights));
}

nlohmann::json to_json(const CaeVaeConfig& config) {
  nlohmann::json json;
  for_each_size(config, [&](const char* name, int value, int) { json[name] = value; });
  json["upsampling"] = text(config.upsampling);
  return json;
}

CaeVaeConfig config_from_json(const nlohmann::json& json) {
  CaeVaeConfig config;
  for_each_size(config, [&](const char* name, int& value, int least) {
    if (!json.is_object() || !json.contains(name)) refuse_config(fmt::format("no {}, expected the sizes of a cae-vae network", name));
    const nlohmann::json& given = json.at(name);
    if (!given.is_number_integer() || given.get<double>() < least || given.get<double>() > kMost)
      refuse_config(fmt::format("{} is {}, expected a whole number in {}..{}", name, given.is_structured() ? given.type_name() : given.dump(), least, kMost));  // dump() recurses
    given.get_to(value);
  });
  if (!json.contains("upsampling") || (json["upsampling"] != "nearest" && json["upsampling"] != "linear")) refuse_config("upsampling is neither \"nearest\" nor \"linear\"");
  config.upsampling = parse_upsampling(json["upsampling"].get<std::string>());
  config.validate();
  return config;
}

}  // namespace mocap::cae_vae
