#include "libmodels/refiner/model.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "libmocap/base/error.hpp"
#include "libmocap/clip/ground.hpp"
#include "libmodels/nn/mlp.hpp"
#include "libmodels/train/tensors.hpp"

namespace mocap::refiner {
namespace {

constexpr double kMostHz = 10000;

torch::Tensor effector_values(const store::ModelFile& file, const std::string& part, std::int64_t count, const std::string& name) {
  const auto found = file.weights.find("effectors/" + part);
  if (found == file.weights.end() || found->second.shape != std::vector<std::int64_t>{count}) refuse({name, 0, "weights/effectors/" + part}, fmt::format("absent or of another shape, expected {} values", count));
  for (const float v : found->second.values)
    if (!std::isfinite(v) || (part == "deviation" && !(v > 0))) refuse({name, 0, "weights/effectors/" + part}, "a value that is not finite, or no deviation");
  return train::from_stored(found->second);
}

}  // namespace

Model read(const store::ModelFile& file, const std::string& name) {
  if (file.kind != "refiner") refuse({name, 0, {}}, "a model of kind '" + file.kind + "', expected refiner (train-refiner makes one)");
  Model model;
  RefinerConfig sizes;
  double rate = 0;
  try {
    const auto config = nlohmann::json::parse(file.config);
    if (config.at("features") != "state") refuse({}, "features are not \"state\"");
    config.at("frame_rate_hz").get_to(rate);
    config.at("contacts").get_to(model.contacts_rule);
    if (model.contacts_rule.starts_with("preset:")) (void)contact_preset(model.contacts_rule.substr(7));
    if (!(rate > 0 && rate <= kMostHz)) refuse({}, fmt::format("frame_rate_hz is {}, expected a number above 0, at most {}", rate, kMostHz));
    sizes = config_from_json(config.at("network"));
  } catch (const nlohmann::json::exception& e) {
    refuse({name, 0, "config"}, std::string("not the configuration of a refiner: ") + e.what());
  } catch (const Error& e) {
    refuse({name, 0, "config"}, e.message());
  }
  if (!file.skeleton || features::state_columns(*file.skeleton) != sizes.features) refuse({name, 0, "skeleton"}, "another number of joints than the network's");
  if (file.mean.size() != static_cast<std::size_t>(sizes.features) || file.deviation.size() != file.mean.size()) refuse({name, 0, "normalization"}, fmt::format("{} means, expected {}", file.mean.size(), sizes.features));
  model.reference = {file.skeleton, rate, file.mean, file.deviation};
  int effectors = 0;
  try {
    effectors = EndEffectors(model.reference).count();
  } catch (const Error& e) {
    throw e.in_file(name);
  }
  if (effectors != sizes.effectors) refuse({name, 0, "skeleton/roles"}, fmt::format("{} end effectors, expected the network's {}", effectors, sizes.effectors));
  model.effector_mean = effector_values(file, "mean", 6 * sizes.effectors, name);
  model.effector_deviation = effector_values(file, "deviation", 6 * sizes.effectors, name);
  store::ModelFile weights = file;  // the refiner's alone: the discriminator is kept for a training that goes on
  std::erase_if(weights.weights, [](const auto& item) { return !item.first.starts_with("refiner/"); });
  train::check_numbers(weights, sizes.features, sizes.refiner_parameters(), name);
  model.network = std::make_unique<RefinerNetwork>(sizes, 0);
  train::NamedTensors parameters;
  for (auto& [path, tensor] : nn::parameters_by_path(*model.network)) parameters.emplace_back("refiner/" + path, tensor);
  train::load_weights(parameters, weights.weights, name);
  return model;
}

Refining::Refining(const Model& model)
    : model_(model), end_effectors_(model.reference), cell_(std::make_shared<nn::PackedLstmCell>(*model.network->lstm, false)), state_(torch::zeros({1, 2 * model.network->config().hidden})) {}

Clip Refining::operator()(const Clip& piece) {
  const torch::NoGradGuard no_grad;
  train::check_alike(*piece.skeleton, piece.frame_rate_hz, model_.reference, {{}, 0, "clip " + piece.name}, "the refiner");
  if (piece.contacts.size() != piece.frames()) throw Error(Exit::internal, {}, "refining: a piece without contacts");
  if (!decode_) decode_ = std::make_unique<features::StateDecoder>(model_.reference.skeleton, model_.reference.frame_rate_hz, features::placement_of(piece));
  const features::FeatureMatrix x = encode_(piece);
  const torch::Tensor rows = train::standardised(x, piece.contacts, model_.reference).unsqueeze(1);
  const torch::Tensor effectors = end_effectors_(rows, before_);
  before_ = effectors[x.rows() - 1].narrow(1, 0, 3 * end_effectors_.count()).clone();
  auto [out, state] = model_.network->forward(rows, (effectors - model_.effector_mean) / model_.effector_deviation, state_, cell_);
  state_ = state.clone();
  const torch::Tensor values = out.contiguous();
  auto [y, contacts] = train::raw_states(values.data_ptr<float>(), x.rows(), model_.reference);
  Clip clip = (*decode_)(y);
  clip.contacts = std::move(contacts);
  return clip;
}

Clip refine(const Model& model, const Clip& clip, std::size_t piece) {
  Refining refining(model);
  Clip out = without_frames(clip);
  out.segments = clip.segments;  // no frame is added or lost
  for (std::size_t first = 0; first < clip.frames();) {
    const std::size_t count = std::min(std::max<std::size_t>(2, piece), clip.frames() - first);  // two at least: frame 0 takes the step of frame 1
    const Clip part = refining(cut(clip, first, count));
    out.rotations.insert(out.rotations.end(), part.rotations.begin(), part.rotations.end());
    out.root_position.insert(out.root_position.end(), part.root_position.begin(), part.root_position.end());
    out.contacts.insert(out.contacts.end(), part.contacts.begin(), part.contacts.end());
    first += count;
  }
  return out;
}

}  // namespace mocap::refiner
