// The refiner and its discriminator (Wang, Chai, Xia 2018, section 4.2, Fig. 4 and 5).
//
//   in_r = (x, c, p_end(x), v_end(x))                                                   eq. 11
//   R(x) = w_r2 lstm(relu(w_r1 in_r + b_r1)) + b_r2 + (x, c)                             a change added to the motion it was given
//   in_d = (p_end(x), v_end(x), c)                                                       eq. 12: the discriminator sees end effectors alone (and contacts, 4.3)
//   D(x) = w_d2 bilstm(relu(w_d1 in_d + b_d1)) + b_d2                                    a logit for every frame, each in view of the whole motion
//
// x are standardised state features (features/state.hpp), c the contact bits. Positions of the end effectors are metres in the ground frame of their frame (origin below the root,
// turned by the heading), velocities m/s from frame t-1 to t in the ground frame of t-1, 0 at a motion's first frame; both standardised. The paper does not name its end effectors: here head, wrists,
// ankles and toe bases (roles head, *_hand, *_ankle, *_foot), as far as the body has them; without feet there is nothing to refine.
// Contacts come out of R as numbers, a half and above being down. LSTM cells are those of its Appendix A.
#pragma once
#include <torch/torch.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "libmocap/skeleton/skeleton.hpp"
#include "libmodels/nn/lstm_sequence.hpp"
#include "libmodels/nn/mlp.hpp"
#include "libmodels/nn/rotations.hpp"
#include "libmodels/train/state_dataset.hpp"

namespace mocap::refiner {

struct RefinerConfig {
  int features = 69;        // D
  int effectors = 7;        // E
  bool contacts = true;     // whether contact bits go in and out (4.3); without them they pass through unseen
  int hidden = 512;         // of the LSTM layers
  int width = 512;          // of FC1

  int columns() const { return features + train::kContactBits; }
  int refiner_input() const { return features + (contacts ? train::kContactBits : 0) + 6 * effectors; }
  int refiner_output() const { return features + (contacts ? train::kContactBits : 0); }
  int discriminator_input() const { return (contacts ? train::kContactBits : 0) + 6 * effectors; }
  std::int64_t refiner_parameters() const;
  std::int64_t discriminator_parameters() const;

  static RefinerConfig preset(const std::string& name);  // "paper" (512) or "small" (128); Error(usage)
  void validate() const;                                 // Error(data)
  bool operator==(const RefinerConfig&) const = default;
};
nlohmann::json to_json(const RefinerConfig& config);
RefinerConfig config_from_json(const nlohmann::json& json);  // Error(data)

// Where the end effectors of a body are and how fast they move, as functions of standardised states.
class EndEffectors {
 public:
  // Error(data) for a skeleton without feet.
  explicit EndEffectors(const train::Reference& reference);
  EndEffectors(const train::Reference& reference, const std::vector<int>& joints);  // of any joints but the root
  int count() const { return static_cast<int>(points_.size(0)); }
  const std::vector<std::string>& names() const { return names_; }

  // rows (T, B, >= D) -> (T, B, 6 E): positions, then velocities. `before` (B, 3 E): positions one frame before the first; undefined: its velocities are 0.
  // Differentiable once; float or double.
  torch::Tensor operator()(const torch::Tensor& rows, const torch::Tensor& before = {}) const;

 private:
  nn::BodyPositions body_;
  torch::Tensor points_, mean_, deviation_;
  std::vector<std::string> names_;
  std::int64_t joints_;
  double rate_;
};

// (T, B, 3): the root over the motion in metres, from the origin with heading 0 at its first frame, whose own step is not taken. Differentiable.
torch::Tensor root_path(const torch::Tensor& rows, const train::Reference& reference);

class RefinerNetwork : public torch::nn::Module {
 public:
  RefinerNetwork(const RefinerConfig& config, std::uint64_t seed);
  const RefinerConfig& config() const { return config_; }

  struct Output {
    torch::Tensor rows;   // (T, B, D + 2)
    torch::Tensor state;  // (B, 2 hidden)
  };
  // rows (T, B, D + 2), effectors (T, B, 6 E) standardised, state (B, 2 hidden).
  Output forward(const torch::Tensor& rows, const torch::Tensor& effectors, const torch::Tensor& state, std::shared_ptr<const nn::PackedLstmCell> packed = nullptr) const;

  std::shared_ptr<nn::Mlp> input, output;  // w_r1, w_r2
  std::shared_ptr<nn::LstmCell> lstm;

 private:
  RefinerConfig config_;
};

class Discriminator : public torch::nn::Module {
 public:
  Discriminator(const RefinerConfig& config, std::uint64_t seed);

  struct Packed {
    explicit Packed(const Discriminator& d);
    std::shared_ptr<const nn::PackedLstmCell> forwards, backwards;
  };
  // contacts (T, B, 2), effectors (T, B, 6 E) standardised -> (T, B) logits of being real.
  torch::Tensor forward(const torch::Tensor& contacts, const torch::Tensor& effectors, const Packed* packed = nullptr) const;

  std::shared_ptr<nn::Mlp> input, output;  // w_d1, w_d2
  std::shared_ptr<nn::LstmCell> forwards, backwards;

 private:
  RefinerConfig config_;
};

}  // namespace mocap::refiner
