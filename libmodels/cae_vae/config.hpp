// Sizes of the autoencoder and variational autoencoder of Motegi, Hijioka, Murakami 2018, as kept in a model file's /config.
#pragma once
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

namespace mocap::cae_vae {

// Which filters see the three root velocities: those that see the pose, or some of their own (section VI: "we should use different filters for different measurements").
enum class RootFilters { shared, separate };
RootFilters parse_root_filters(const std::string& name);  // Error(usage)
std::string text(RootFilters filters);

// Between the pooled frames: each twice, or on the straight line between its neighbours, which lie half and one and a half frames away.
enum class Upsampling { nearest, linear };
Upsampling parse_upsampling(const std::string& name);  // Error(usage)
std::string text(Upsampling upsampling);

struct CaeVaeConfig {
  int window = 120;       // frames; even, since pairs of frames are pooled
  int kernel = 15;        // frames that a filter sees; odd
  int filters = 32;       // of the autoencoder
  int root_filters = 0;   // of them, those that see nothing but root velocities; 0: all see everything
  int hidden = 256;       // units of the hidden layer of encoder and decoder
  int latent = 32;        // dimensions of z
  Upsampling upsampling = Upsampling::linear;

  int features() const { return filters * (window / 2); }  // values between the stages, 1,920 in the paper
  std::int64_t parameter_count() const;
  void validate() const;  // Error(data) naming the field: sizes in 1..4096, window even, kernel odd and no longer than the window, root_filters below filters, at most 2^24 weights in a layer
  bool operator==(const CaeVaeConfig&) const = default;
};

// Keys are the field names. Reading refuses (Error(data)) missing keys and wrong types, and ignores others; validates.
nlohmann::json to_json(const CaeVaeConfig& config);
CaeVaeConfig config_from_json(const nlohmann::json& json);

}  // namespace mocap::cae_vae
