#include "libmodels/refiner/network.hpp"

#include <fmt/format.h>

#include "libmocap/base/error.hpp"
#include "libmocap/base/random.hpp"
#include "libmocap/features/state.hpp"

namespace mocap::refiner {
namespace {

using torch::Tensor;

constexpr int kMost = 1 << 16;

[[noreturn]] void refuse_config(const std::string& what) { refuse(Where{{}, 0, "/config"}, what); }

template <class Config, class F>
void for_each_size(Config& c, F f) {
  f("features", c.features);
  f("effectors", c.effectors);
  f("hidden", c.hidden);
  f("width", c.width);
}

Tensor flat(const Tensor& rows) { return rows.reshape({-1, rows.size(-1)}).contiguous(); }

}  // namespace

std::int64_t RefinerConfig::refiner_parameters() const {
  const std::int64_t h = hidden, w = width;
  return (refiner_input() + 1) * w + 4 * h * (w + 2 * h + 1) + (h + 1) * refiner_output();
}

std::int64_t RefinerConfig::discriminator_parameters() const {
  const std::int64_t h = hidden, w = width;
  return (discriminator_input() + 1) * w + 2 * 4 * h * (w + 2 * h + 1) + 2 * h + 1;
}

RefinerConfig RefinerConfig::preset(const std::string& name) {
  RefinerConfig c;
  if (name == "small")
    c.hidden = c.width = 128;
  else if (name != "paper")
    refuse_usage(fmt::format("preset '{}', expected paper or small", name));
  return c;
}

void RefinerConfig::validate() const {
  for_each_size(*this, [](const char* name, int value) {
    if (value < 1 || value > kMost) refuse_config(fmt::format("{} is {}, expected a whole number in 1..{}", name, value, kMost));
  });
}

nlohmann::json to_json(const RefinerConfig& config) {
  nlohmann::json json;
  for_each_size(config, [&](const char* name, int value) { json[name] = value; });
  json["contacts"] = config.contacts;
  return json;
}

RefinerConfig config_from_json(const nlohmann::json& json) {
  RefinerConfig config;
  const auto field = [&](const char* name) -> const nlohmann::json& {
    if (!json.is_object() || !json.contains(name)) refuse_config(fmt::format("no {}, expected the sizes of a refiner", name));
    return json.at(name);
  };
  for_each_size(config, [&](const char* name, int& value) {
    const nlohmann::json& given = field(name);
    if (!given.is_number_integer() || given.get<double>() < 1 || given.get<double>() > kMost)
      refuse_config(fmt::format("{} is {}, expected a whole number in 1..{}", name, given.is_structured() ? given.type_name() : given.dump(), kMost));  // dump() recurses
    given.get_to(value);
  });
  if (!field("contacts").is_boolean()) refuse_config("contacts is neither true nor false");
  field("contacts").get_to(config.contacts);
  config.validate();
  return config;
}

EndEffectors::EndEffectors(const train::Reference& reference) : EndEffectors(reference, std::vector<int>{}) {
  std::vector<std::int64_t> points;
  for (const char* role : {"left_foot", "right_foot", "left_ankle", "right_ankle", "left_hand", "right_hand", "head"}) {
    const int joint = reference.skeleton->find_role(role);
    if (joint > 0) {  // BodyPositions leaves the root out
      points.push_back(joint - 1);
      names_.emplace_back(role);
    } else if (std::string(role).ends_with("_foot")) {
      refuse({{}, 0, "skeleton/roles"}, std::string("no ") + role + ", expected feet: they are what is refined");
    }
  }
  points_ = torch::tensor(points, torch::kLong);
}

EndEffectors::EndEffectors(const train::Reference& reference, const std::vector<int>& joints)
    : body_(*reference.skeleton), mean_(torch::tensor(reference.mean)), deviation_(torch::tensor(reference.deviation)), joints_(reference.skeleton->joint_count()), rate_(reference.frame_rate_hz) {
  std::vector<std::int64_t> points;
  for (const int joint : joints) {
    points.push_back(joint - 1);
    names_.push_back(reference.skeleton->joint_names[static_cast<std::size_t>(joint)]);
  }
  points_ = torch::tensor(points, torch::kLong);
}

Tensor EndEffectors::operator()(const Tensor& rows, const Tensor& before) const {
  const std::int64_t t = rows.size(0), b = rows.size(1), e = count(), d = mean_.size(0);
  const Tensor x = rows.narrow(2, 0, d) * deviation_.to(rows.scalar_type()) + mean_.to(rows.scalar_type());
  const Tensor tilt = torch::cat({x.narrow(2, 4, 2), torch::zeros({t, b, 1}, x.options())}, 2);
  const Tensor vectors = torch::cat({tilt, x.narrow(2, features::kStateRootValues, 3 * (joints_ - 1))}, 2).reshape({t * b, joints_, 3});
  const Tensor local = body_(nn::quaternions_of_vectors(vectors)).index_select(1, points_).view({t, b, e, 3});
  const Tensor px = local.select(3, 0), py = local.select(3, 1), pz = local.select(3, 2) + x.narrow(2, 3, 1);
  const Tensor p = torch::stack({px, py, pz}, 3);
  // In the ground frame of the frame before.
  const Tensor c = x.narrow(2, 2, 1).cos(), s = x.narrow(2, 2, 1).sin();
  const Tensor seen = torch::stack({c * px - s * py + x.narrow(2, 0, 1), s * px + c * py + x.narrow(2, 1, 1), pz}, 3);
  const Tensor first = before.defined() ? (seen.narrow(0, 0, 1) - before.view({1, b, e, 3})) : torch::zeros({1, b, e, 3}, x.options());
  const Tensor v = rate_ * torch::cat({first, seen.narrow(0, 1, t - 1) - p.narrow(0, 0, t - 1)}, 0);
  return torch::cat({p.reshape({t, b, 3 * e}), v.reshape({t, b, 3 * e})}, 2);
}

Tensor root_path(const Tensor& rows, const train::Reference& reference) {
  const std::int64_t t = rows.size(0);
  const Tensor mean = torch::tensor(std::vector<float>(reference.mean.begin(), reference.mean.begin() + 4)).to(rows.scalar_type()),
               deviation = torch::tensor(std::vector<float>(reference.deviation.begin(), reference.deviation.begin() + 4)).to(rows.scalar_type());
  const Tensor x = rows.narrow(2, 0, 4) * deviation + mean;
  const Tensor later = x.narrow(0, 1, t - 1), turns = later.select(2, 2).cumsum(0);
  const Tensor heading = turns - later.select(2, 2);  // before each step
  const Tensor c = heading.cos(), s = heading.sin(), dx = later.select(2, 0), dy = later.select(2, 1), zero = torch::zeros_like(x.narrow(0, 0, 1).select(2, 0));
  const Tensor px = torch::cat({zero, (c * dx - s * dy).cumsum(0)}, 0), py = torch::cat({zero, (s * dx + c * dy).cumsum(0)}, 0);
  return torch::stack({px, py, x.select(2, 3)}, 2);
}

RefinerNetwork::RefinerNetwork(const RefinerConfig& config, std::uint64_t seed) : config_(config) {
  config.validate();
  Random random_1(seed, stream_of(1, 0)), random_2(seed, stream_of(2, 0)), random_3(seed, stream_of(3, 0));
  input = register_module("input", std::make_shared<nn::Mlp>(std::vector<int>{config.refiner_input(), config.width}, false, random_1));
  lstm = register_module("lstm", std::make_shared<nn::LstmCell>(config.width, config.hidden, random_2, true));
  output = register_module("output", std::make_shared<nn::Mlp>(std::vector<int>{config.hidden, config.refiner_output()}, false, random_3));
  // The change starts small: a refiner that knows nothing yet leaves the motion nearly as it is.
  const torch::NoGradGuard no_grad;
  output->weight(0).mul_(0.02);
}

RefinerNetwork::Output RefinerNetwork::forward(const Tensor& rows, const Tensor& effectors, const Tensor& state, std::shared_ptr<const nn::PackedLstmCell> packed) const {
  const std::int64_t t = rows.size(0), b = rows.size(1), h = config_.hidden, out = config_.refiner_output();
  const Tensor seen = torch::cat({rows.narrow(2, 0, out), effectors}, 2);
  const Tensor states = nn::lstm_sequence(*lstm, torch::relu(input->forward(flat(seen))), state, std::move(packed));
  const Tensor change = output->forward(states.narrow(1, 0, h).contiguous()).view({t, b, out});
  Tensor refined = rows.narrow(2, 0, out) + change;
  if (out < rows.size(2)) refined = torch::cat({refined, rows.narrow(2, out, rows.size(2) - out)}, 2);
  return {refined, states.narrow(0, t * b - b, b)};
}

Discriminator::Discriminator(const RefinerConfig& config, std::uint64_t seed) : config_(config) {
  config.validate();
  Random random_1(seed, stream_of(11, 0)), random_2(seed, stream_of(12, 0)), random_3(seed, stream_of(13, 0)), random_4(seed, stream_of(14, 0));
  input = register_module("input", std::make_shared<nn::Mlp>(std::vector<int>{config.discriminator_input(), config.width}, false, random_1));
  forwards = register_module("forwards", std::make_shared<nn::LstmCell>(config.width, config.hidden, random_2, true));
  backwards = register_module("backwards", std::make_shared<nn::LstmCell>(config.width, config.hidden, random_3, true));
  output = register_module("output", std::make_shared<nn::Mlp>(std::vector<int>{2 * config.hidden, 1}, false, random_4));
}

Discriminator::Packed::Packed(const Discriminator& d) : forwards(std::make_shared<nn::PackedLstmCell>(*d.forwards)), backwards(std::make_shared<nn::PackedLstmCell>(*d.backwards)) {}

Tensor Discriminator::forward(const Tensor& contacts, const Tensor& effectors, const Packed* packed) const {
  const std::int64_t t = effectors.size(0), b = effectors.size(1), h = config_.hidden;
  const Tensor seen = config_.contacts ? torch::cat({contacts, effectors}, 2) : effectors;
  const Tensor x = torch::relu(input->forward(flat(seen)));
  const Tensor zero = torch::zeros({b, 2 * h}, x.options());
  const Tensor ahead = nn::lstm_sequence(*forwards, x, zero, packed ? packed->forwards : nullptr).narrow(1, 0, h);
  const Tensor reversed = x.view({t, b, -1}).flip({0}).reshape({t * b, -1});
  const Tensor back = nn::lstm_sequence(*backwards, reversed, zero, packed ? packed->backwards : nullptr).narrow(1, 0, h).reshape({t, b, h}).flip({0}).reshape({t * b, h});
  return output->forward(torch::cat({ahead, back}, 1)).view({t, b});
}

}  // namespace mocap::refiner
