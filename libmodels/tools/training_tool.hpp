// What every train-* tool shares: one archive in, one model out, the loop's options, history, stop signals, progress, exit status.
#pragma once
#include <string>
#include <vector>

#include "libmocap/cli/tool.hpp"
#include "libmodels/tools/history_input.hpp"
#include "libmodels/train/loop.hpp"

namespace mocap::tools {

class TrainingTool : public cli::Tool {
 public:
  cli::Traits traits() const override;  // one input, -o FILE, --seed, --device
  std::vector<std::string> version_lines() const override;
  bool check_output_first() const override { return !resume_; }  // a finished model is what --resume may find
  std::vector<std::string> non_content_options() const override { return {"--resume", "--checkpoint-minutes", "--checkpoint-epochs", "--weights-only", "--val-epochs"}; }

 protected:
  // --shards, --resume, --weights-only, --checkpoint-minutes, --checkpoint-epochs, --val-epochs.
  void add_loop_options(CLI::App& app);
  int shards() const { return shards_; }
  // Puts LibTorch's and BLAS' threads in their place; Error(usage) where the output is the input or one of the other files read ("": none). Returns the input's path.
  std::string begin(cli::Context& context, const std::vector<std::string>& read = {}) const;
  // Trains to the end or to a stop signal, which is said. `history` is that of the input, `inputs` what was read.
  // Exit::ok or Exit::interrupted.
  Exit train(cli::Context& context, train::Trainable& training, History history, std::vector<HistoryInput> inputs) const;

 private:
  int shards_ = 2;
  bool resume_ = false, weights_only_ = false;
  double checkpoint_minutes_ = 5;
  std::int64_t checkpoint_epochs_ = 0, val_epochs_ = 10;
};

}  // namespace mocap::tools
