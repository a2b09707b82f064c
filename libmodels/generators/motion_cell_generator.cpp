#include "libmodels/generators/motion_cell_generator.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "libmocap/base/error.hpp"
#include "libmocap/base/parallel.hpp"
#include "libmocap/base/random.hpp"
#include "libmocap/clip/ground.hpp"
#include "libmocap/features/motion_cell.hpp"
#include "libmodels/motion_cell/sampler.hpp"
#include "libmodels/nn/mlp.hpp"
#include "libmodels/train/tensors.hpp"

namespace mocap::generators {
namespace {

constexpr double kMostHz = 10000;
constexpr std::int64_t kMostFrames = 1000000;  // of the model's default

class MotionCellGenerator final : public Generator {
 public:
  MotionCellGenerator(const store::ModelFile& model, const std::string& file) : vocabulary_(model.vocabulary), skeleton_(model.skeleton), mean_(model.mean), deviation_(model.deviation) {
    const motion_cell::MotionCellConfig network = read_config(model.config, file);
    const auto columns = static_cast<std::int64_t>(network.joints) * network.rotation_values + network.root_values;
    if (!skeleton_ || skeleton_->joint_count() - 1 != network.joints) refuse({file, 0, "skeleton"}, "another number of joints than the network's");
    if (network.rotation_values != static_cast<int>(representation_) || network.root_values != features::kRootValues)
      refuse({file, 0, "config"}, "another number of values in a frame than the representation " + features::text(representation_) + " has");
    if (static_cast<std::int64_t>(mean_.size()) != columns || static_cast<std::int64_t>(deviation_.size()) != columns)
      refuse({file, 0, "normalization"}, std::to_string(mean_.size()) + " means, expected " + std::to_string(columns));
    const auto finite = [](float v) { return std::isfinite(v); };
    if (!std::all_of(mean_.begin(), mean_.end(), finite) || !std::all_of(deviation_.begin(), deviation_.end(), [&](float v) { return finite(v) && v > 0; }))
      refuse({file, 0, "normalization"}, "a mean that is not finite or a deviation that is not above 0");
    if (vocabulary_.size() != network.attribute_classes.size()) refuse({file, 0, "vocabulary"}, "another number of attributes than the network's");
    std::size_t a = 0;
    for (const auto& [name, values] : vocabulary_)
      if (static_cast<int>(values.size()) != network.attribute_classes[a++]) refuse({file, 0, "vocabulary/" + name}, "another number of classes than the network's");
    for (const auto& classes : trained_) {
      if (classes.size() != vocabulary_.size()) refuse({file, 0, "config"}, "a combination of " + std::to_string(classes.size()) + " classes, expected one for each attribute");
      Attributes combination;
      a = 0;
      for (const auto& [name, values] : vocabulary_) {
        if (classes[a] >= values.size()) refuse({file, 0, "config"}, "a combination with a class that attribute " + name + " does not have");
        combination[name] = values[classes[a++]];
      }
      combinations_.push_back(std::move(combination));
    }
    std::int64_t stored = 0;
    for (const auto& [name, tensor] : model.weights) {
      stored += static_cast<std::int64_t>(tensor.values.size());
      if (!std::all_of(tensor.values.begin(), tensor.values.end(), finite)) refuse({file, 0, "weights/" + name}, "a value that is not finite");
    }
    // Before a network of these sizes is built: a few numbers in a small file must not ask for all memory.
    if (stored != motion_cell::MotionCell::parameter_count(network))
      refuse({file, 0, "weights"}, std::to_string(stored) + " values, expected the " + std::to_string(motion_cell::MotionCell::parameter_count(network)) + " of the network in config");
    motion_cell::MotionCell cell(network, 0);
    train::load_weights(nn::parameters_by_path(cell), model.weights, file);
    sampler_ = std::make_unique<motion_cell::Sampler>(cell);
  }

  std::string kind() const override { return "motion-cell"; }
  const std::map<std::string, std::vector<std::string>>& vocabulary() const override { return vocabulary_; }
  const std::vector<Attributes>& combinations() const override { return combinations_; }
  std::shared_ptr<const Skeleton> skeleton() const override { return skeleton_; }
  double frame_rate_hz() const override { return rate_; }
  std::string contacts_rule() const override { return contacts_; }
  std::int64_t default_frames() const override { return default_frames_; }
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
  motion_cell::MotionCellConfig read_config(const std::string& text, const std::string& file) {
    try {
      const auto config = nlohmann::json::parse(text);
      representation_ = features::parse_representation(config.at("representation").get<std::string>());
      config.at("frame_rate_hz").get_to(rate_);
      config.at("contacts").get_to(contacts_);
      const auto& frames = config.at("default_frames");
      if (!frames.is_number_integer() || frames.get<double>() < 1 || frames.get<double>() > kMostFrames)
        refuse({}, fmt::format("default_frames is not a whole number in 1..{}", kMostFrames));
      frames.get_to(default_frames_);
      if (!(rate_ > 0 && rate_ <= kMostHz)) refuse({}, fmt::format("frame_rate_hz is {}, expected a number above 0, at most {}", rate_, kMostHz));
      if (contacts_.starts_with("preset:")) preset_ = &contact_preset(contacts_.substr(7));
      config.at("combinations").get_to(trained_);
      return motion_cell::config_from_json(config.at("network"));
    } catch (const nlohmann::json::exception& e) {
      refuse({file, 0, "config"}, std::string("not the configuration of a Motion Cell: ") + e.what());
    } catch (const Error& e) {  // also what would be the user's mistake on a command line
      refuse({file, 0, "config"}, e.message());
    }
  }

  std::vector<std::int64_t> classes_of(const Attributes& attributes) const {
    std::vector<std::int64_t> classes;
    for (const auto& [name, values] : vocabulary_) {
      const auto it = attributes.find(name);
      const auto at = it == attributes.end() ? values.end() : std::find(values.begin(), values.end(), it->second);
      if (at == values.end()) throw Error(Exit::internal, {}, "attribute " + name + " is not set to a value the model knows");
      classes.push_back(at - values.begin());
    }
    return classes;
  }

  Clip to_clip(const std::vector<float>& standardised, const ClipOrder& order) const {
    const auto columns = static_cast<Eigen::Index>(mean_.size());
    features::FeatureMatrix x(static_cast<Eigen::Index>(order.frames), columns);
    for (Eigen::Index t = 0; t < x.rows(); ++t)
      for (Eigen::Index c = 0; c < columns; ++c) {
        const auto k = static_cast<std::size_t>(c);
        x(t, c) = static_cast<double>(standardised[static_cast<std::size_t>(t * columns + c)]) * deviation_[k] + mean_[k];
      }
    Clip clip = features::decode_motion_cell(x, skeleton_, rate_, representation_);
    clip.name = order.name;
    label_as_ordered(clip, order);
    if (preset_) clip.contacts = label_contacts(clip, *preset_);
    return clip;
  }

  std::map<std::string, std::vector<std::string>> vocabulary_;
  std::vector<std::vector<std::size_t>> trained_;  // combinations as class numbers
  std::vector<Attributes> combinations_;
  std::shared_ptr<const Skeleton> skeleton_;
  std::vector<float> mean_, deviation_;
  features::RotationRepresentation representation_{};
  double rate_ = 30;
  std::string contacts_;
  const ContactPreset* preset_ = nullptr;
  std::int64_t default_frames_ = 0;
  std::unique_ptr<motion_cell::Sampler> sampler_;
};

}  // namespace

std::unique_ptr<Generator> make_motion_cell_generator(const store::ModelFile& model, const std::string& file) { return std::make_unique<MotionCellGenerator>(model, file); }

}  // namespace mocap::generators
