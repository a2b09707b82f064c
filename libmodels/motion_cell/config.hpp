// Sizes of the Motion Cell (Ghorbani et al. 2020, sections 3.1-3.3 and Table 1), as kept in a model file's /config.
#pragma once
#include <cstdint>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

namespace mocap::motion_cell {

struct MotionCellConfig {
  int joints = 21;          // rotations per frame
  int rotation_values = 4;  // k: 3 axis-angle, 4 quaternion, 9 matrix
  int root_values = 6;
  int word_length = 3;                          // l, frames per motion word
  int overlap = 0;                              // o, frames of the next word that a word's decoder writes too (network.hpp), at most l; 0 as in the paper
  int hidden = 512;                             // of each of the two GRU cells: D_h = 2 hidden
  int width = 128;                              // hidden units of every MLP
  int word = 96;                                // D_w (unless single_layer), also the size of f_w(w) and f_z(z)
  int latent = 96;                              // D_z
  int control = 8;                              // D_a
  bool single_layer = false;                    // no f_enc_w, f_dec_w: words are frames (word_length 1), f_w reads and f_dec writes them
  std::vector<int> attribute_classes = {4, 2};  // classes of each attribute, in vocabulary order

  int features() const { return joints * rotation_values + root_values; }  // D_p
  int word_features() const { return word_length * features(); }
  int written() const { return (word_length + overlap) * features(); }  // values that f_dec_w makes of a word
  int decoded() const { return single_layer ? features() : word; }  // values of a word as f_w reads and f_dec writes it
  int attribute_total() const;         // length of the concatenated one-hots
  int attribute_combinations() const;  // rows of the learned initial state
  // The row of one class per attribute: mixed radix, the last attribute fastest. Error(internal) where out of range.
  std::int64_t combination(std::span<const std::int64_t> classes) const;

  // "paper" (Table 1) or "small" (GRU cells of 256, words that overlap by 3 frames); Error(usage) for another name.
  static MotionCellConfig preset(const std::string& name);
  // Error(data) unless every size is in [1, 2^16], at least one attribute, at most 2^16 combinations, words of one frame and no overlap with single_layer.
  void validate() const;
  bool operator==(const MotionCellConfig&) const = default;
};

// Keys are the field names. Reading refuses (Error(data)) missing keys (but single_layer: false, overlap: 0) and wrong types, and ignores others; validates.
nlohmann::json to_json(const MotionCellConfig& config);
MotionCellConfig config_from_json(const nlohmann::json& json);

}  // namespace mocap::motion_cell
