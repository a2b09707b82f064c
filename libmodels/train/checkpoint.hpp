// The two checkpoints OUTPUT.ckpt-1 and OUTPUT.ckpt-2, written in turns.
#pragma once
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "libmodels/train/optimizer.hpp"
#include "libmodels/train/trainable.hpp"

namespace mocap::train {

class Checkpoints {
 public:
  explicit Checkpoints(std::string output) : output_(std::move(output)) {}

  struct Restored {
    std::string path;
    nlohmann::json state;  // "step", "identity"
  };

  bool exist() const;
  void remove() const;
  std::string path(int which) const;  // 1 or 2

  // Over the older of the two; atomic, so that at any moment one complete checkpoint exists once one was written.
  void write(Trainable& model, const Optimizer& optimizer, nlohmann::json state);
  // Weights, optimizer and the model's memory from the newest readable one; nullopt where there is none. Error(data) where files exist but
  // none can be read; Error(usage) where the identity differs.
  std::optional<Restored> restore(Trainable& model, Optimizer& optimizer);
  const std::string& last() const { return last_; }  // path of the newest, "" before the first

 private:
  std::string output_, last_;
};

// Model with weights, and the training state where `optimizer` is given.
store::ModelFile assemble(Trainable& model, const Optimizer* optimizer, const nlohmann::json& state);

// The JSON state of a model that holds one; Error(data) for what is none.
nlohmann::json training_state_of(const store::ModelFile& model, const std::string& file);

// Error(usage) naming the first key in which two identities differ.
void require_same_identity(const std::string& now, const std::string& before, const std::string& file);

}  // namespace mocap::train
