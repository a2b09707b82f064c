#include "libmodels/generators/feature_model.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "libmocap/base/error.hpp"
#include "libmodels/train/tensors.hpp"

namespace mocap::generators {
namespace {

constexpr double kMostHz = 10000;
constexpr std::int64_t kMostFrames = 1000000;  // of the model's default

}  // namespace

FeatureGenerator::FeatureGenerator(const store::ModelFile& model, const std::string& file, const std::string& what, const std::function<NetworkSizes(const nlohmann::json&)>& read_network)
    : kind_(model.kind), vocabulary_(model.vocabulary), skeleton_(model.skeleton), mean_(model.mean), deviation_(model.deviation) {
  NetworkSizes network;
  std::vector<std::vector<std::size_t>> trained;  // combinations as class numbers
  try {
    const auto config = nlohmann::json::parse(model.config);
    representation_ = features::parse_representation(config.at("representation").get<std::string>());
    config.at("frame_rate_hz").get_to(rate_);
    config.at("contacts").get_to(contacts_);
    const auto& frames = config.at("default_frames");
    if (!frames.is_number_integer() || frames.get<double>() < 1 || frames.get<double>() > kMostFrames)
      refuse({}, fmt::format("default_frames is not a whole number in 1..{}", kMostFrames));
    frames.get_to(default_frames_);
    if (!(rate_ > 0 && rate_ <= kMostHz)) refuse({}, fmt::format("frame_rate_hz is {}, expected a number above 0, at most {}", rate_, kMostHz));
    if (contacts_.starts_with("preset:")) preset_ = &contact_preset(contacts_.substr(7));
    config.at("combinations").get_to(trained);
    network = read_network(config.at("network"));
  } catch (const nlohmann::json::exception& e) {
    refuse({file, 0, "config"}, "not the configuration of " + what + ": " + e.what());
  } catch (const Error& e) {  // also what would be the user's mistake on a command line
    refuse({file, 0, "config"}, e.message());
  }

  const auto columns = static_cast<std::int64_t>(network.joints) * network.rotation_values + network.root_values;
  if (!skeleton_ || skeleton_->joint_count() - 1 != network.joints) refuse({file, 0, "skeleton"}, "another number of joints than the network's");
  if (network.rotation_values != static_cast<int>(representation_) || network.root_values != features::kRootValues)
    refuse({file, 0, "config"}, "another number of values in a frame than the representation " + features::text(representation_) + " has");
  train::check_numbers(model, columns, network.parameters, file);
  if (vocabulary_.size() != network.attribute_classes.size()) refuse({file, 0, "vocabulary"}, "another number of attributes than the network's");
  std::size_t a = 0;
  for (const auto& [name, values] : vocabulary_)
    if (static_cast<int>(values.size()) != network.attribute_classes[a++]) refuse({file, 0, "vocabulary/" + name}, "another number of classes than the network's");
  for (const auto& classes : trained) {
    if (classes.size() != vocabulary_.size()) refuse({file, 0, "config"}, "a combination of " + std::to_string(classes.size()) + " classes, expected one for each attribute");
    Attributes combination;
    a = 0;
    for (const auto& [name, values] : vocabulary_) {
      if (classes[a] >= values.size()) refuse({file, 0, "config"}, "a combination with a class that attribute " + name + " does not have");
      combination[name] = values[classes[a++]];
    }
    combinations_.push_back(std::move(combination));
  }
}

std::vector<std::int64_t> FeatureGenerator::classes_of(const Attributes& attributes) const {
  std::vector<std::int64_t> classes;
  for (const auto& [name, values] : vocabulary_) {
    const auto it = attributes.find(name);
    const auto at = it == attributes.end() ? values.end() : std::find(values.begin(), values.end(), it->second);
    if (at == values.end()) throw Error(Exit::internal, {}, "attribute " + name + " is not set to a value the model knows");
    classes.push_back(at - values.begin());
  }
  return classes;
}

Clip FeatureGenerator::to_clip(const std::vector<float>& standardised, const ClipOrder& order) const {
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

}  // namespace mocap::generators
