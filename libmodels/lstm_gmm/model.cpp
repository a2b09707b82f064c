#include "libmodels/lstm_gmm/model.hpp"

#include <fmt/core.h>

#include <cmath>

#include "libmocap/base/error.hpp"
#include "libmocap/features/state.hpp"
#include "libmodels/nn/mlp.hpp"
#include "libmodels/train/tensors.hpp"

namespace mocap::lstm_gmm {
namespace {

constexpr double kMostHz = 10000;
constexpr std::int64_t kMostFrames = 1000000, kMostStarts = 4096;

}  // namespace

Model read(const store::ModelFile& file, const std::string& name) {
  if (file.kind != "lstm-gmm") refuse({name, 0, {}}, "a model of kind '" + file.kind + "', expected lstm-gmm (train-lstm makes one)");
  Model model;
  LstmGmmConfig sizes;
  double rate = 0;
  try {
    const auto config = nlohmann::json::parse(file.config);
    if (config.at("features") != "state") refuse({}, "features are not \"state\"");
    config.at("frame_rate_hz").get_to(rate);
    const auto& frames = config.at("default_frames");
    if (!frames.is_number_integer() || frames.get<double>() < 1 || frames.get<double>() > kMostFrames) refuse({}, fmt::format("default_frames is not a whole number in 1..{}", kMostFrames));
    frames.get_to(model.default_frames);
    if (!(rate > 0 && rate <= kMostHz)) refuse({}, fmt::format("frame_rate_hz is {}, expected a number above 0, at most {}", rate, kMostHz));
    sizes = config_from_json(config.at("network"));
  } catch (const nlohmann::json::exception& e) {
    refuse({name, 0, "config"}, std::string("not the configuration of a mixture generator: ") + e.what());
  } catch (const Error& e) {
    refuse({name, 0, "config"}, e.message());
  }
  if (!file.skeleton || features::state_columns(*file.skeleton) != sizes.features) refuse({name, 0, "skeleton"}, "another number of joints than the network's");
  if (sizes.contacts != train::kContactBits) refuse({name, 0, "config"}, fmt::format("{} contacts, expected {}", sizes.contacts, train::kContactBits));
  // The starts stand beside the weights and are no part of the network.
  store::ModelFile weights = file;
  const auto starts = weights.weights.find("start");
  const auto& shape = starts == weights.weights.end() ? std::vector<std::int64_t>() : starts->second.shape;
  if (shape.size() != 3 || shape[0] < 1 || shape[0] > kMostStarts || shape[1] != 2 || shape[2] != sizes.input())
    refuse({name, 0, "weights/start"}, fmt::format("absent or of another shape, expected pairs of frames of {} values", sizes.input()));
  for (const float v : starts->second.values)
    if (!std::isfinite(v)) refuse({name, 0, "weights/start"}, "a value that is not finite");
  model.starts = train::from_stored(starts->second);
  weights.weights.erase(starts);
  train::check_numbers(weights, sizes.features, sizes.parameter_count(), name);
  model.network = std::make_unique<Network>(sizes, 0);
  train::load_weights(nn::parameters_by_path(*model.network), weights.weights, name);
  model.reference = {file.skeleton, rate, file.mean, file.deviation};
  return model;
}

}  // namespace mocap::lstm_gmm
