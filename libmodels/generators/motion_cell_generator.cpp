#include "libmodels/generators/motion_cell_generator.hpp"

#include "libmocap/base/error.hpp"
#include "libmocap/base/parallel.hpp"
#include "libmodels/generators/feature_model.hpp"
#include "libmodels/motion_cell/sampler.hpp"
#include "libmodels/nn/mlp.hpp"
#include "libmodels/train/tensors.hpp"

namespace mocap::generators {
namespace {

class MotionCellGenerator final : public FeatureGenerator {
 public:
  // `network` is read from the file while the base checks it.
  MotionCellGenerator(const store::ModelFile& model, const std::string& file, motion_cell::MotionCellConfig network = {})
      : FeatureGenerator(model, file, "a Motion Cell", [&network](const nlohmann::json& json) {
          network = motion_cell::config_from_json(json);
          return NetworkSizes{network.joints, network.rotation_values, network.root_values, network.attribute_classes, motion_cell::MotionCell::parameter_count(network)};
        }) {
    motion_cell::MotionCell cell(network, 0);
    train::load_weights(nn::parameters_by_path(cell), model.weights, file);
    sampler_ = std::make_unique<motion_cell::Sampler>(cell);
  }

  std::int64_t schedule_step() const override { return sampler_->config().word_length; }

  std::vector<Clip> sample(const std::vector<ClipOrder>& orders, const SampleSettings& settings) const override {
    std::vector<motion_cell::ClipRequest> requests;
    for (const auto& order : orders) {
      motion_cell::ClipRequest r;
      r.seed = settings.seed;
      r.stream = order.stream;
      r.frames = order.frames;
      r.schedule.push_back({0, classes_of(order.attributes)});
      for (const auto& change : order.schedule) {
        if (change.frame % schedule_step() != 0 || change.frame / schedule_step() <= r.schedule.back().word)
          throw Error(Exit::internal, {}, "attributes change at frames that are no ascending multiples of a word");
        r.schedule.push_back({change.frame / schedule_step(), classes_of(change.attributes)});
      }
      requests.push_back(std::move(r));
    }
    motion_cell::SampleOptions options;
    options.threads = settings.threads;
    options.sigma_scale = settings.noise_scale;
    const auto frames = motion_cell::sample_clips(*sampler_, requests, options);
    std::vector<Clip> clips(orders.size());
    parallel_for(orders.size(), settings.threads, [&](std::size_t i) { clips[i] = to_clip(frames[i], orders[i]); });
    return clips;
  }

 private:
  std::unique_ptr<motion_cell::Sampler> sampler_;
};

}  // namespace

std::unique_ptr<Generator> make_motion_cell_generator(const store::ModelFile& model, const std::string& file) { return std::make_unique<MotionCellGenerator>(model, file); }

}  // namespace mocap::generators
