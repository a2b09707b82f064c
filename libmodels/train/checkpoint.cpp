#include "libmodels/train/checkpoint.hpp"

#include <fmt/core.h>
#include <unistd.h>

#include <set>

#include "libmocap/base/error.hpp"
#include "libmocap/base/log.hpp"
#include "libmodels/train/tensors.hpp"

namespace mocap::train {
namespace {

using Json = nlohmann::json;

bool exists(const std::string& path) { return ::access(path.c_str(), F_OK) == 0; }

}  // namespace

std::string Checkpoints::path(int which) const { return fmt::format("{}.ckpt-{}", output_, which); }

bool Checkpoints::exist() const { return exists(path(1)) || exists(path(2)); }

void Checkpoints::remove() const {
  for (const int which : {1, 2}) ::unlink(path(which).c_str());
}

store::ModelFile assemble(Trainable& model, const Optimizer* optimizer, const Json& state) {
  store::ModelFile file = model.describe();
  for (auto& [name, tensor] : to_stored(model.parameters())) file.weights[name] = std::move(tensor);  // beside constants that belong to the model
  if (optimizer) {
    file.has_training = true;
    for (const auto& [name, tensor] : optimizer->state()) file.training_tensors[name] = to_stored(tensor);
    for (const auto& [name, tensor] : model.memory()) file.training_tensors[name] = to_stored(tensor);
    file.training_state = state.dump();
  }
  return file;
}

void Checkpoints::write(Trainable& model, const Optimizer& optimizer, Json state) {
  const std::string target = last_ == path(1) ? path(2) : path(1);
  state["identity"] = Json::parse(model.identity());
  store::write_model(target, Overwrite::allow, assemble(model, &optimizer, state));
  last_ = target;
}

Json training_state_of(const store::ModelFile& model, const std::string& file) {
  if (!model.has_training) refuse({file, 0, "training"}, "absent, expected a checkpoint's state");
  // Comparing and printing JSON recurses: nothing of a training's state is nested deeply.
  Json state = Json::parse(model.training_state, [](int depth, Json::parse_event_t, Json&) { return depth < 32; }, false);
  const auto whole = [&](const char* key) { return state.contains(key) && state[key].is_number_integer() && state[key].get<double>() >= 0; };
  if (!state.is_object() || !whole("step") || !state.contains("identity") || !state["identity"].is_object())
    refuse({file, 0, "training/state"}, "not the state of a training, expected a step and an identity");
  return state;
}

void require_same_identity(const std::string& now, const std::string& before, const std::string& file) {
  const Json a = Json::parse(now).flatten(), b = Json::parse(before).flatten();
  std::set<std::string> keys;
  for (const Json* j : {&a, &b})
    for (const auto& [key, value] : j->items()) keys.insert(key);
  const auto said = [](const Json& j, const std::string& key) { return j.contains(key) ? j.at(key).dump() : std::string("nothing"); };
  for (const auto& key : keys)
    if (said(a, key) != said(b, key))
      throw Error(Exit::usage, {file, 0, {}}, fmt::format("was trained with {} = {}, this command says {}", key.substr(1), said(b, key), said(a, key)),
                  "train under another output name, or with -f instead of --resume to start over");
}

std::optional<Checkpoints::Restored> Checkpoints::restore(Trainable& model, Optimizer& optimizer) {
  std::optional<store::ModelFile> newest;
  Restored restored;
  std::optional<Error> damage;
  for (const int which : {1, 2}) {
    if (!exists(path(which))) continue;
    try {
      store::ModelFile file = store::read_model(path(which));
      Json state = training_state_of(file, path(which));
      if (newest && restored.state["step"] >= state["step"]) continue;
      newest = std::move(file);
      restored = {path(which), std::move(state)};
    } catch (const Error& e) {
      if (e.status() != Exit::data) throw;
      log::warn("{}; the other checkpoint is used where there is one", e.what());
      damage = e;
    }
  }
  if (!newest) {
    if (damage) throw Error(*damage);
    return std::nullopt;
  }
  require_same_identity(model.identity(), restored.state["identity"].dump(), restored.path);
  for (const auto& [name, constant] : model.describe().weights) newest->weights.erase(name);
  load_weights(model.parameters(), newest->weights, restored.path);
  std::map<std::string, torch::Tensor> state;
  for (const auto& [name, tensor] : newest->training_tensors) state[name] = from_stored(tensor);
  try {
    optimizer.set_state(state, restored.state["step"].get<std::int64_t>());
    for (auto& [name, tensor] : model.memory()) train::restore(state, name, tensor);
  } catch (const Error& e) {
    throw e.in_file(restored.path);
  }
  last_ = restored.path;
  return restored;
}

}  // namespace mocap::train
