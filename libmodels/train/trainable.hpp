// What the training loop asks of a model. A new model implements this and nothing else of the loop.
#pragma once
#include <torch/torch.h>

#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "libmocap/store/model_file.hpp"
#include "libmodels/train/optimizer.hpp"

namespace mocap::train {

using LossTerms = std::vector<std::pair<std::string, double>>;  // name, value; the same names in the same order every time

// All randomness of a step comes from (seed, step) through counter-based generators, so there is no generator state to
// save: a resumed training draws what the uninterrupted one would have drawn.
class Trainable {
 public:
  virtual ~Trainable() = default;

  // Everything a model file holds but weights and training state.
  virtual store::ModelFile describe() const = 0;
  // What must be equal for a checkpoint to be continued: one JSON object (configuration, data digest, seed, steps).
  virtual std::string identity() const = 0;

  virtual NamedTensors parameters() = 0;  // fixed order; names are the paths under /weights
  virtual std::int64_t steps() const = 0;
  virtual std::int64_t steps_per_epoch() const = 0;
  virtual double learning_rate(std::int64_t step) const = 0;
  virtual double gradient_limit() const { return std::numeric_limits<double>::infinity(); }  // of the joint norm
  virtual double entry_limit() const { return std::numeric_limits<double>::infinity(); }     // of each derivative, before the norm is taken
  virtual std::unique_ptr<Optimizer> optimizer();  // of all parameters; Adam unless a model says otherwise
  virtual int shards() const = 0;

  // Draws the batch of a step and cuts it into shards. Called on one thread before the shards run.
  virtual void prepare(std::int64_t step) = 0;
  // The loss of one shard; the sum over shards is the loss of the batch. Called on worker threads, one shard each. Appends
  // the shard's part of every term worth logging; parts add up as well.
  virtual torch::Tensor shard_loss(int shard, LossTerms& terms) = 0;

  // A model of several networks trains them in turns: which parameters [first, first + count) the prepared step updates.
  virtual std::pair<std::size_t, std::size_t> trained() { return {0, parameters().size()}; }
  // After the update of a prepared step, on one thread.
  virtual void updated(const LossTerms& /*terms*/) {}
  // What else the next step depends on (a history, a count): kept in checkpoints under these names and restored in place.
  virtual NamedTensors memory() { return {}; }

  // Loss on held-out data, with fixed noise; nullopt without any.
  virtual std::optional<double> validation_loss() { return std::nullopt; }
};

}  // namespace mocap::train
