// The one training loop: data-parallel shards, the optimiser, gradient clipping, two checkpoints, bit-exact resume, log, signals.
#pragma once
#include <functional>
#include <string>

#include "libmocap/base/history.hpp"
#include "libmocap/base/output_file.hpp"
#include "libmodels/train/trainable.hpp"

namespace mocap::train {

struct LoopOptions {
  std::string output;                 // model file; OUTPUT.ckpt-1, OUTPUT.ckpt-2 and OUTPUT.log.tsv stand beside it
  Overwrite overwrite = Overwrite::refuse;
  bool resume = false;
  bool weights_only = false;          // leave the optimizer's state out of the finished model
  int threads = 1;
  double checkpoint_minutes = 5;
  std::int64_t checkpoint_epochs = 0;  // also every so many epochs; 0: by time alone
  std::int64_t validate_epochs = 1;    // epochs between validations
  History history;                     // of the finished model
};

struct Progress {
  std::int64_t step, steps;
  double loss, steps_per_second;
};

struct LoopResult {
  bool finished = false;  // false: stopped on a signal with a checkpoint
  std::int64_t step = 0;
};

// Runs until model.steps() or a stop signal. The weights after step n are the same bits for any number of threads, and
// whether or not the training was stopped, killed and resumed in between.
//   With `resume`: continues from the newest readable checkpoint (a damaged one is reported and the other taken), starts
//   afresh where there is none, returns at once where the output is finished. The log is cut back to the step resumed from.
//   Without: Error(io) where the output or a checkpoint of it exists, unless overwrite allows to start over.
// Throws Error(usage) where a checkpoint has another identity (the first differing key is named); Error(data) where loss
// or gradient stop being finite (step, term and last checkpoint are named); Error(io) where a checkpoint cannot be written.
LoopResult train(Trainable& model, const LoopOptions& options, const std::function<void(const Progress&)>& on_progress);

}  // namespace mocap::train
