// Motion of a few joints for the tests of the objective.
#pragma once
#include <fmt/core.h>
#include <torch/torch.h>

#include <cmath>
#include <memory>

#include "libmocap/store/model_file.hpp"
#include "libmodels/classifier/network.hpp"
#include "libmodels/nn/mlp.hpp"
#include "libmodels/train/dataset.hpp"
#include "libmodels/train/tensors.hpp"
#include "tests/store/sample_clips.hpp"

namespace mocap::testing {

// All joints swing about axes of their own, a shoulder through more than a half turn where `wide`.
inline Clip waving(const std::string& name, std::size_t frames, double phase, bool wide = false) {
  Clip clip;
  clip.name = name;
  clip.skeleton = canonical_body();
  const auto joints = static_cast<std::size_t>(clip.joints());
  for (std::size_t t = 0; t < frames; ++t) {
    const double p = 0.2 * static_cast<double>(t) + phase;
    for (std::size_t j = 0; j < joints; ++j) {
      const double s = std::sin(p + static_cast<double>(j));
      clip.rotations.push_back(exp_map(Vector3(j == 0 ? 0.1 * s : 0.3 * s, j % 2 ? 0.4 * s : 0.1, wide && j == 9 ? 2.2 + 1.5 * s : 0.2)));
    }
    clip.root_position.emplace_back(0.02 * static_cast<double>(t), 0.01 * std::sin(p), 0.9 + 0.02 * std::sin(2 * p));
  }
  make_sign_continuous(clip);
  clip.attributes = {{"action", phase > 1 ? "run" : "walk"}};
  clip.source.path = name + ".bvh";
  return clip;
}

inline std::vector<Clip> waves(bool wide = false) { return {waving("a", 40, 0, wide), waving("b", 25, 2, wide), waving("c", 31, 0.5, wide), waving("d", 12, 1.5, wide)}; }

// A classifier of `classes` with random weights, all multiplied by `scale`, standardising by the clips given.
inline void write_classifier(const std::string& path, const std::vector<Clip>& clips, const std::string& attribute, const std::vector<std::string>& classes, std::uint64_t seed, double scale = 1,
                             double rate = 30) {
  classifier::NetworkConfig config;
  config.joints = clips.at(0).joints() - 1;
  config.classes = static_cast<int>(classes.size());
  Random random(seed, 0);
  const classifier::Network network(config, random);
  if (scale != 1) {
    const torch::NoGradGuard no_grad;
    for (torch::Tensor p : network.parameters()) p.mul_(scale);
  }
  classifier::Statistics statistics(config.joints);
  for (const Clip& clip : clips) statistics.add(classifier::encode(clip));
  store::ModelFile file;
  file.kind = "classifier";
  file.config = nlohmann::json{{"network", classifier::to_json(config)}, {"frame_rate_hz", rate}}.dump();
  file.skeleton = clips[0].skeleton;
  file.mean = statistics.mean();
  file.deviation = statistics.deviation();
  file.vocabulary = {{attribute, classes}};
  file.weights = train::to_stored(nn::parameters_by_path(network));
  store::write_model(path, Overwrite::allow, file);
}

}  // namespace mocap::testing
