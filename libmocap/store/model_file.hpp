// The model container: named tensors, a configuration and what training needs to continue (contract/motion-archive.md).
#pragma once
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "libmocap/base/history.hpp"
#include "libmocap/base/output_file.hpp"
#include "libmocap/skeleton/skeleton.hpp"

namespace mocap::store {

struct Tensor {  // dense, C order
  std::vector<std::int64_t> shape;
  std::vector<float> values;
};

// Everything a model file holds, in memory (models are a few to a hundred megabytes).
struct ModelFile {
  std::string kind;      // "motion-cell", "quaternet", "erd", "lstm-gmm", "refiner", "denoiser", "classifier", "cae-vae"
  std::string config;    // JSON: every hyperparameter needed to rebuild the network
  History history;
  std::shared_ptr<const Skeleton> skeleton;
  std::map<std::string, Tensor> weights;                       // "/weights/<path>": a path may hold slashes
  std::vector<float> mean, deviation;                          // /normalization, may be empty
  std::vector<std::string> train_sources;                      // SHA-256 of the source files trained on, hexadecimal, sorted
  std::map<std::string, std::vector<std::string>> vocabulary;  // attribute -> class names in output order
  // /training/*: optimizer state by parameter name, and a JSON document with step, epoch, generator positions, schedules,
  // loss history. Absent in --weights-only files.
  bool has_training = false;
  std::map<std::string, Tensor> training_tensors;
  std::string training_state;  // JSON
};

// Atomic (OutputFile); equal content gives equal bytes. Every dataset carries a checksum.
void write_model(const std::string& path, Overwrite mode, const ModelFile& model);

// Error(data): not ours, unfinished, damaged (naming the tensor), or of a newer format version. Nothing is executed.
// "-" and pipes are spooled. `file_sha256`, where given, receives the digest of the file's bytes, for the history of what reads it.
ModelFile read_model(const std::string& path, std::string* file_sha256 = nullptr);

// Checks beyond reading; one line per defect.
std::vector<std::string> check_model(const std::string& path, bool full);

}  // namespace mocap::store
