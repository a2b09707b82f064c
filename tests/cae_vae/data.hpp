#pragma once
#include <fmt/core.h>

#include <memory>
#include <vector>

#include "libmodels/cae_vae/training.hpp"
#include "libmodels/nn/blas.hpp"
#include "libmodels/nn/sharded.hpp"
#include "libmodels/train/tensors.hpp"
#include "tests/store/sample_clips.hpp"

namespace mocap::cae_vae {

// Three bodies that wave everything; windows of 20 frames, 10 of overlap, and one clip that is too short.
struct SampleData {
  mocap::testing::TemporaryFolder folder;
  std::vector<Clip> clips;
  std::unique_ptr<WindowDataset> set;
  SampleData() {
    for (std::uint64_t i = 0; i < 3; ++i) clips.push_back(mocap::testing::sample_clip(fmt::format("clip{}", i), 75, 5 + i));
    clips.push_back(mocap::testing::sample_clip("short", 19, 9));
    mocap::testing::write_archive(folder / "train.h5", clips);
    set = std::make_unique<WindowDataset>(folder / "train.h5", 20, 10);
  }
};
inline const SampleData& sample_data() {
  static const SampleData d;
  return d;
}

inline CaeVaeConfig tiny(int root_filters = 0) {
  CaeVaeConfig c;
  c.window = 20;
  c.kernel = 5;
  c.filters = 8;
  c.root_filters = root_filters;
  c.hidden = 16;
  c.latent = 4;
  return c;
}

inline TrainingConfig short_training() {
  TrainingConfig c;
  c.epochs = c.vae_epochs = 60;
  c.batch = 6;
  c.overlap = 10;
  return c;
}

// Updates from step `first` on, as the loop makes them.
inline void train_steps(CaeVaeTraining& training, train::Optimizer& optimizer, std::int64_t first, std::int64_t last) {
  nn::ShardedGradient sharded(training.shards(), 1);
  const auto named = training.parameters();
  for (std::int64_t step = first; step < last; ++step) {
    training.prepare(step);
    const auto [begin, count] = training.trained();
    std::vector<torch::Tensor> trained;
    for (std::size_t i = begin; i < begin + count; ++i) trained.push_back(named[i].second);
    auto result = sharded.compute(trained, [&](int shard) {
      train::LossTerms terms;
      return nn::ShardedGradient::Share{training.shard_loss(shard, terms), {}};
    });
    optimizer.step(result.gradients, training.learning_rate(step), begin);
  }
}

inline store::ModelFile model_file(CaeVaeTraining& training) {
  store::ModelFile file = training.describe();
  for (auto& [name, tensor] : train::to_stored(training.parameters())) file.weights[name] = std::move(tensor);
  const int latent = training.network().config().latent;  // as if it had come to its end
  file.weights.merge(stored(LatentPrior{Eigen::VectorXd::Ones(1), Eigen::MatrixXd::Zero(latent, 1), {Eigen::MatrixXd::Identity(latent, latent)}}));
  return file;
}

}  // namespace mocap::cae_vae
