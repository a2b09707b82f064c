// What follow-path, steer and denoise --method map share: the models, the sizes of the search and the sigmas of the terms they have in common.
#pragma once
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "libmocap/cli/tool.hpp"
#include "libmodels/control/planner.hpp"

namespace mocap::tools {

class ControlOptions {
 public:
  // -m, --refiner.
  void add_models(CLI::App& app, bool generator_required = true, const std::string& model_help = "generator (train-lstm)", const std::string& refiner_help = "refiner (train-refiner) through which the motion is seen while it is looked for");
  // --window --overlap --particles --rounds --iterations --rereads, --noise-sigma --contact-sigma --height-sigma; without --particles and --rounds where no swarm finds the start.
  void add_search(CLI::App& app, bool swarm = true);

  const std::string& generator() const { return generator_; }
  const std::string& refiner() const { return refiner_; }
  control::PlanOptions& plan() { return plan_; }
  // Other defaults, before add_search.
  void set_sigmas(double noise, double contact, double height) { noise_sigma_ = noise, contact_sigma_ = contact, height_sigma_ = height; }
  const control::PlanOptions& plan() const { return plan_; }
  // Prior, noise and contacts: what every problem has. `model` gives the height that feet rest at.
  control::Terms terms(const control::MotionModel& model) const;

  struct Models {
    lstm_gmm::Model generator;
    std::optional<refiner::Model> refiner;
    std::unique_ptr<lstm_gmm::Sampler> sampler;
    std::vector<HistoryInput> inputs;
    History history;
    const refiner::Model* refines() const { return refiner ? &*refiner : nullptr; }
  };
  // Error(data) for models of other kinds, naming the file.
  Models load() const;
  // Joint `name` of the model's body, -1 for its root. Error(usage) naming the joints.
  static int joint(const Skeleton& skeleton, const std::string& name);

 private:
  std::string generator_, refiner_;
  double noise_sigma_ = 0.05, contact_sigma_ = 0.005, height_sigma_ = 0.01;
  control::PlanOptions plan_;
};

}  // namespace mocap::tools
