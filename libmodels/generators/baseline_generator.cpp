#include "libmodels/generators/baseline_generator.hpp"

#include "libmocap/base/error.hpp"
#include "libmocap/base/parallel.hpp"
#include "libmodels/baselines/sampler.hpp"
#include "libmodels/generators/feature_model.hpp"
#include "libmodels/nn/mlp.hpp"
#include "libmodels/train/tensors.hpp"

namespace mocap::generators {
namespace {

baselines::Arch arch_of(const std::string& kind) { return kind == baselines::text(baselines::Arch::erd) ? baselines::Arch::erd : baselines::Arch::quaternet; }

class BaselineGenerator final : public FeatureGenerator {
 public:
  // `network` is read from the file while the base checks it.
  BaselineGenerator(const store::ModelFile& model, const std::string& file, baselines::BaselineConfig network = {})
      : FeatureGenerator(model, file, "a " + model.kind + " network", [&](const nlohmann::json& json) {
          network = baselines::config_from_json(arch_of(model.kind), json);
          return NetworkSizes{network.joints, network.rotation_values, network.root_values, network.attribute_classes, baselines::Network::parameter_count(network)};
        }) {
    baselines::Network net(network, mean(), deviation(), 0);
    train::load_weights(nn::parameters_by_path(net), model.weights, file);
    sampler_ = std::make_unique<baselines::Sampler>(net);
  }

  std::vector<Clip> sample(const std::vector<ClipOrder>& orders, const SampleSettings& settings) const override {
    std::vector<baselines::ClipRequest> requests;
    for (const auto& order : orders) {
      requests.push_back({settings.seed, order.stream, order.frames, {{0, classes_of(order.attributes)}}});
      for (const auto& change : order.schedule) {
        if (change.frame <= requests.back().schedule.back().frame) throw Error(Exit::internal, {}, "attributes change at frames that do not ascend");
        requests.back().schedule.push_back({change.frame, classes_of(change.attributes)});
      }
    }
    baselines::SampleOptions options;
    options.threads = settings.threads;
    options.sigma_scale = settings.noise_scale;
    const auto frames = sampler_->sample(requests, options);
    std::vector<Clip> clips(orders.size());
    parallel_for(orders.size(), settings.threads, [&](std::size_t i) { clips[i] = to_clip(frames[i], orders[i]); });
    return clips;
  }

 private:
  std::unique_ptr<baselines::Sampler> sampler_;
};

}  // namespace

std::unique_ptr<Generator> make_baseline_generator(const store::ModelFile& model, const std::string& file) { return std::make_unique<BaselineGenerator>(model, file); }

}  // namespace mocap::generators
