#include "libmodels/cae_vae/model.hpp"

#include <fmt/core.h>

#include <cmath>

#include "libmocap/base/error.hpp"
#include "libmocap/clip/ground.hpp"
#include "libmocap/clip/position_fit.hpp"
#include "libmodels/nn/mlp.hpp"
#include "libmodels/train/tensors.hpp"

namespace mocap::cae_vae {
namespace {

constexpr double kMostHz = 10000, kMostFloor = 100;

std::vector<Quaternion> take_natural(std::map<std::string, store::Tensor>& weights, int joints, const std::string& name) {
  const auto found = weights.find("natural");
  if (found == weights.end() || found->second.shape != std::vector<std::int64_t>{joints, 4}) refuse({name, 0, "weights/natural"}, fmt::format("absent or of another shape, expected {} rotations", joints));
  std::vector<Quaternion> rotations;
  for (std::size_t i = 0; i < found->second.values.size(); i += 4) {
    const float* q = found->second.values.data() + i;
    rotations.emplace_back(q[0], q[1], q[2], q[3]);
    if (!(std::abs(rotations.back().norm() - 1) < 1e-3)) refuse({name, 0, "weights/natural"}, "a quaternion that is not unit");
  }
  weights.erase(found);
  return rotations;
}

}  // namespace

Model read(const store::ModelFile& file, const std::string& name) {
  if (file.kind != "cae-vae") refuse({name, 0, {}}, "a model of kind '" + file.kind + "', expected cae-vae (train-vae makes one)");
  Model model;
  CaeVaeConfig sizes;
  double rate = 0;
  try {
    const auto config = nlohmann::json::parse(file.config);
    if (config.at("features") != "motegi") refuse({}, "features are not \"motegi\"");
    config.at("frame_rate_hz").get_to(rate);
    config.at("floor_m").get_to(model.floor_m);
    config.at("contacts").get_to(model.contacts_rule);
    if (!(rate > 0 && rate <= kMostHz)) refuse({}, fmt::format("frame_rate_hz is {}, expected a number above 0, at most {}", rate, kMostHz));
    if (!(std::abs(model.floor_m) <= kMostFloor)) refuse({}, fmt::format("floor_m is {}, expected a number within {} m of 0", model.floor_m, kMostFloor));
    if (!model.contacts_rule.starts_with("preset:")) refuse({}, "contacts is not \"preset:NAME\"");
    contact_preset(model.contacts_rule.substr(7));
    sizes = config_from_json(config.at("network"));
  } catch (const nlohmann::json::exception& e) {
    refuse({name, 0, "config"}, std::string("not the configuration of a cae-vae: ") + e.what());
  } catch (const Error& e) {  // also what would be the user's mistake on a command line
    refuse({name, 0, "config"}, e.message());
  }
  if (!file.skeleton) refuse({name, 0, "skeleton"}, "absent, expected the training data's");
  try {
    PositionFitter(file.skeleton, features::motegi_joints(*file.skeleton));
  } catch (const Error& e) {
    throw e.in_file(name);
  }
  store::ModelFile weights = file;  // the prior stands beside the network
  model.prior = take_latent_prior(weights.weights, sizes.latent, name);
  model.natural = take_natural(weights.weights, file.skeleton->joint_count(), name);
  train::check_numbers(weights, features::kMotegiColumns, sizes.parameter_count(), name);
  model.network = std::make_unique<Network>(sizes, 0);
  train::load_weights(nn::parameters_by_path(*model.network), weights.weights, name);
  if (!(model.network->scale_deviation > 0).all().item<bool>()) refuse({name, 0, "weights/scale_deviation"}, "a deviation of 0 or less, expected numbers above 0");
  model.reference = {file.skeleton, rate, file.mean, file.deviation};
  return model;
}

}  // namespace mocap::cae_vae
