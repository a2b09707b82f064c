// Sizes of the two deterministic baselines of Ghorbani et al. 2020 (section 5.1), as kept in a model file's /config.
#pragma once
#include <cstdint>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

namespace mocap::baselines {

// Pavllo et al. 2019 (IJCV), QuaterNet; Fragkiadaki et al. 2015 (ICCV), Encoder-Recurrent-Decoder.
enum class Arch { quaternet, erd };
std::string text(Arch arch);  // "quaternet", "erd": also the model file's kind

struct BaselineConfig {
  Arch arch = Arch::quaternet;
  int joints = 21;          // rotations per frame, quaternions
  int rotation_values = 4;  // the only representation these two know
  int root_values = 6;
  int hidden = 1000;  // of each of the two recurrent layers
  int width = 500;    // erd: hidden units of both encoder layers and of the decoder's first
  int narrow = 100;   // erd: of the decoder's second
  std::vector<int> attribute_classes = {4, 2};  // classes of each attribute, in vocabulary order

  int features() const { return joints * rotation_values + root_values; }
  int attribute_total() const;  // length of the concatenated one-hots
  int input() const { return features() + attribute_total(); }
  int state() const { return (arch == Arch::erd ? 4 : 2) * hidden; }  // h of both layers, then c of both
  int attribute_combinations() const;
  // The row of one class per attribute: mixed radix, the last attribute fastest. Error(internal) where out of range.
  std::int64_t combination(std::span<const std::int64_t> classes) const;

  // "paper": the two papers' own sizes (Pavllo: two GRUs of 1,000; Fragkiadaki: 500-500, two LSTMs of 1,000, 500-100);
  // "small": recurrent layers of 256, the others of 128 and 100, as the Motion Cell's preset. Error(usage) for another name.
  static BaselineConfig preset(Arch arch, const std::string& name);
  // Error(data) unless every size is in [1, 2^16], rotations are quaternions, at most 2^16 combinations of attributes.
  void validate() const;
  bool operator==(const BaselineConfig&) const = default;
};

// Keys are the field names but `arch`, which the model's kind says. Reading refuses (Error(data)) missing keys and wrong
// types, and ignores others; validates.
nlohmann::json to_json(const BaselineConfig& config);
BaselineConfig config_from_json(Arch arch, const nlohmann::json& json);

}  // namespace mocap::baselines
