// Sizes of the mixture generator (Wang, Chai, Xia 2018, Fig. 3), as kept in a model file's /config.
#pragma once
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

namespace mocap::lstm_gmm {

// Which memory the gates see: `paper` eq. 27, C(t-1) and h(t-1); `standard` h(t-1) alone.
enum class Cell { paper, standard };
Cell parse_cell(const std::string& name);  // Error(usage)
std::string text(Cell cell);


// The figure that gives the widths is lost in the paper's text. With 512 everywhere, generator and refiner together hold 40.8 MB of weights;
// section 6 says 41 MB (with standard cells it would be 28 MB).
struct LstmGmmConfig {
  int features = 69;  // D, state features of a frame (features/state.hpp)
  int contacts = 2;   // bits beside them
  int hidden = 512;   // of each of the two LSTM layers
  int width = 512;    // of the fully connected layers FC1 and FC2
  int mixtures = 5;   // M
  Cell cell = Cell::paper;
  // Share of the standardised frame that the network saw which FC3's means are added to. Eq. 7 has 0: the next frame itself has to come out of the memory, which takes long to learn.
  // With 1 it is their change, which is learnt at once, but nothing draws an untrained network's errors back and the figure sinks into the ground. In between they die away by themselves.
  double carry = 0.9;

  int input() const { return features + contacts; }
  int outputs() const { return mixtures * (2 * features + 1) + contacts; }  // FC3: weights, means, deviations, contacts
  int state() const { return 4 * hidden; }                                  // h and C of LSTM1, then of LSTM2
  std::int64_t parameter_count() const;

  static LstmGmmConfig preset(const std::string& name);  // "paper" (512) or "small" (256); Error(usage) for another name
  void validate() const;                                 // Error(data) unless every size is in [1, 2^16] and outputs() at most 2^24
  bool operator==(const LstmGmmConfig&) const = default;
};

// Keys are the field names. Reading refuses (Error(data)) missing keys and wrong types, and ignores others; validates.
nlohmann::json to_json(const LstmGmmConfig& config);
LstmGmmConfig config_from_json(const nlohmann::json& json);

}  // namespace mocap::lstm_gmm
