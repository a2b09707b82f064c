// OUTPUT.log.tsv: one row a step, read by people and plotting scripts while the training runs.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "libmodels/train/trainable.hpp"

namespace mocap::train {

// Columns: step, epoch, learning_rate, gradient_norm, loss, the terms, validation_loss ("" where none was computed).
// Equal trainings give equal logs. Error(io) where a row cannot be written.
class LogFile {
 public:
  // Keeps the rows of an existing file up to `keep_steps` (0: starts anew).
  LogFile(const std::string& path, std::int64_t keep_steps);
  ~LogFile();
  LogFile(const LogFile&) = delete;
  LogFile& operator=(const LogFile&) = delete;
  struct Row {
    std::int64_t step, epoch;
    double learning_rate, gradient_norm, loss;
    LossTerms terms;
    std::optional<double> validation;
  };
  void write(const Row& row);
  void flush();
  void close();  // after the last row: some file systems say only now that rows were lost

 private:
  std::string path_;
  int fd_ = -1;
  std::string pending_;
  bool header_ = false;
};

}  // namespace mocap::train
