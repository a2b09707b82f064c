#include "libmodels/control/motion_model.hpp"

#include <fmt/format.h>

#include "libmocap/base/error.hpp"

namespace mocap::control {

using torch::Tensor;

namespace {

constexpr std::int64_t kFeet = train::kContactBits;

// The same weights in a network of one's own, with another number type and without gradients.
template <class N>
std::shared_ptr<N> copied(const N& network, torch::Dtype number) {
  auto copy = std::make_shared<N>(network.config(), 0);
  copy->to(number);
  const torch::NoGradGuard no_grad;
  const auto from = network.parameters(), to = copy->parameters();
  for (std::size_t i = 0; i < from.size(); ++i) {
    to[i].copy_(from[i]);
    to[i].set_requires_grad(false);
  }
  return copy;
}

std::vector<int> followed(const Skeleton& skeleton, int point) {
  std::vector<int> joints;
  for (const char* role : {"left_foot", "right_foot"}) {
    const int joint = skeleton.find_role(role);
    if (joint <= 0) refuse({{}, 0, "skeleton/roles"}, std::string("no ") + role + ", expected feet: they are held on the ground");
    joints.push_back(joint);
  }
  if (point > 0) joints.push_back(point);
  return joints;
}

// (T, B, n, 3) in the ground frame of each frame -> (T, B, n, 2) on the ground of the world.
Tensor in_world(const Tensor& local, const Tensor& root, const Tensor& heading) {
  const Tensor c = heading.cos().unsqueeze(2), s = heading.sin().unsqueeze(2), x = local.select(3, 0), y = local.select(3, 1);
  return torch::stack({c * x - s * y, s * x + c * y}, 3) + root.unsqueeze(2);
}

}  // namespace

struct MotionModel::Run {
  Tensor input;              // (T B, D + 2) what the network was given
  lstm_gmm::Mixture mixture;
  Tensor state;              // (B, state) after the last input
};

MotionModel::MotionModel(const lstm_gmm::Model& generator, const refiner::Model* refiner, int point, torch::Dtype number)
    : generator_(generator), refiner_(refiner), number_(number), followed_(generator.reference, followed(*generator.reference.skeleton, point)), follows_joint_(point > 0) {
  network_ = copied(*generator.network, number);
  packed_ = std::make_unique<lstm_gmm::PackedNetwork>(*network_);
  mean_ = of(torch::tensor(generator.reference.mean));
  deviation_ = of(torch::tensor(generator.reference.deviation));
  {
    const torch::NoGradGuard no_grad;
    const Tensor starts = generator.starts.flatten(0, 1).unsqueeze(0);  // (1, 2 K, D + 2)
    const Tensor heights = followed_(starts).narrow(2, 0, 3 * followed_.count()).view({starts.size(1), -1, 3}).narrow(1, 0, kFeet).select(2, 2), down = starts[0].narrow(1, columns(), kFeet);
    if (const double count = down.sum().item<double>(); count > 0) rest_height_ = (heights * down).sum().item<double>() / count;
  }
  if (!refiner) return;
  train::check_alike(*refiner->reference.skeleton, refiner->reference.frame_rate_hz, generator.reference, {{}, 0, {}}, "the generator");
  // A fine-tuned generator is standardised by the data it began with, the refiner by its own; contact bits are neither's.
  const Tensor their_mean = of(torch::tensor(refiner->reference.mean)), their_deviation = of(torch::tensor(refiner->reference.deviation)), bits = torch::ones({kFeet}, mean_.options());
  to_refiner_scale_ = torch::cat({deviation_ / their_deviation, bits});
  to_refiner_shift_ = torch::cat({(mean_ - their_mean) / their_deviation, bits * 0});
  refining_ = copied(*refiner->network, number);
  packed_refiner_ = std::make_shared<nn::PackedLstmCell>(*refining_->lstm);
  refiner_effectors_.emplace(refiner->reference);
  effector_mean_ = of(refiner->effector_mean);
  effector_deviation_ = of(refiner->effector_deviation);
}

Carried MotionModel::start(const Tensor& pair) const { return starts(pair.unsqueeze(0))[0]; }

std::vector<Carried> MotionModel::starts(const Tensor& pairs) const {
  const torch::NoGradGuard no_grad;
  const Tensor two = pairs.to(torch::kFloat);
  const Tensor states = of(lstm_gmm::initial_state(*generator_.network, two.select(1, 0).contiguous(), two.select(1, 1).contiguous()));
  std::vector<Carried> all;
  for (std::int64_t i = 0; i < two.size(0); ++i) {
    Carried c = behind(of(two[i][0]), states[i]);
    const Tensor step = of(two[i][1]).narrow(0, 0, 2) * deviation_.narrow(0, 0, 2) + mean_.narrow(0, 0, 2);
    c.speed = step.norm().item<double>() * generator_.reference.frame_rate_hz;
    all.push_back(std::move(c));
  }
  return all;
}

MotionModel::Refined MotionModel::refined(const Tensor& rows, const Tensor& before, const Tensor& state) const {
  const Tensor theirs = rows * to_refiner_scale_ + to_refiner_shift_, effectors = (*refiner_effectors_)(theirs, before);
  const auto out = refining_->forward(theirs, (effectors - effector_mean_) / effector_deviation_, state, packed_refiner_);
  return {(out.rows - to_refiner_shift_) / to_refiner_scale_, effectors.narrow(2, 0, 3 * refiner_effectors_->count()).clone(), out.state};
}

Carried MotionModel::behind(const Tensor& frame, const Tensor& state) const {
  Carried c;
  c.frame = frame;
  c.state = state;
  c.shown = c.frame;
  if (refiner_) {
    const Refined out = refined(c.frame.view({1, 1, -1}), {}, torch::zeros({1, 2 * refining_->config().hidden}, c.frame.options()));
    c.refiner_before = out.effectors[0][0];
    c.refiner_state = out.state[0].clone();
    c.shown = out.rows.view({-1});
  }
  c.feet = followed_(c.shown.view({1, 1, -1})).view({-1}).narrow(0, 0, 3 * followed_.count()).clone();
  return c;
}

MotionModel::Run MotionModel::run(const Carried& before, const Motion& m) const {
  const std::int64_t t = m.frames(), b = m.candidates(), d = columns();
  const Tensor first = before.frame.narrow(0, 0, d).expand({1, b, d}), first_contacts = before.frame.narrow(0, d, kFeet).expand({1, b, kFeet});
  const Tensor states = torch::cat({first, m.states.narrow(0, 0, t - 1)}, 0) + m.noise, contacts = torch::cat({first_contacts, m.contacts.narrow(0, 0, t - 1)}, 0);
  Run r;
  r.input = torch::cat({states, contacts}, 2).reshape({t * b, d + kFeet});
  const auto out = network_->forward(r.input, before.state.expand({b, before.state.size(0)}).contiguous(), packed_.get());
  r.mixture = network_->mixture(out.y, r.input);
  r.state = out.state;
  return r;
}

Seen MotionModel::see(const Carried& before, const Motion& m, Carried* after) const {
  const std::int64_t t = m.frames(), b = m.candidates(), d = columns();
  const Run r = run(before, m);
  if (after) after->state = r.state[0].clone();
  Seen seen;
  seen.frame_rate_hz = generator_.reference.frame_rate_hz;
  seen.noise = m.noise;
  seen.nats = lstm_gmm::feature_loss(r.mixture, m.states.reshape({t * b, d})).view({t, b});
  seen.contact_logits = r.mixture.contact_logits.view({t, b, kFeet});
  seen.rows = torch::cat({m.states, m.contacts}, 2);
  if (refiner_) {
    const Refined out = refined(seen.rows, before.refiner_before.expand({b, before.refiner_before.size(0)}).contiguous(), before.refiner_state.expand({b, before.refiner_state.size(0)}).contiguous());
    seen.rows = out.rows;
    if (after) {
      after->refiner_before = out.effectors[t - 1][0];
      after->refiner_state = out.state[0].clone();
    }
  }
  seen.contacts = (seen.rows.detach().narrow(2, d, kFeet) >= 0.5).to(number_);
  const Tensor x = seen.rows.narrow(2, 0, d) * deviation_ + mean_;
  seen.features = x;
  const Tensor turns = x.select(2, 2);
  seen.heading = before.heading + turns.cumsum(0);
  const Tensor from = seen.heading - turns, c = from.cos(), s = from.sin(), dx = x.select(2, 0), dy = x.select(2, 1);
  seen.root = torch::stack({before.x + (c * dx - s * dy).cumsum(0), before.y + (s * dx + c * dy).cumsum(0)}, 2);
  seen.steps = (dx.square() + dy.square() + 1e-12).sqrt();
  const std::int64_t n = followed_.count();
  const Tensor points = followed_(seen.rows, before.feet.expand({b, 3 * n}).contiguous());
  const Tensor positions = points.narrow(2, 0, 3 * n).view({t, b, n, 3}), world = in_world(positions, seen.root, seen.heading);
  seen.feet = positions.narrow(2, 0, kFeet);
  seen.foot_velocities = points.narrow(2, 3 * n, 3 * kFeet).view({t, b, kFeet, 3});
  seen.feet_on_ground = world.narrow(2, 0, kFeet);
  seen.point = follows_joint_ ? world.select(2, kFeet) : seen.root;
  return seen;
}

Carried MotionModel::advance(const Carried& before, const Motion& m, std::int64_t frames) const {
  const torch::NoGradGuard no_grad;
  const Motion own{m.states.narrow(0, 0, frames), m.noise.narrow(0, 0, frames), m.contacts.narrow(0, 0, frames)};
  if (own.candidates() != 1) throw Error(Exit::internal, {}, fmt::format("control: {} candidates to go on from, expected 1", own.candidates()));
  Carried c;
  const Seen seen = see(before, own, &c);
  const std::int64_t last = frames - 1;
  c.frame = torch::cat({own.states[last][0], own.contacts[last][0]}).clone();
  c.x = seen.root[last][0][0].item<double>();
  c.y = seen.root[last][0][1].item<double>();
  c.heading = seen.heading[last][0].item<double>();
  c.speed = seen.steps[last][0].item<double>() * seen.frame_rate_hz;
  c.shown = seen.rows[last][0].clone();
  const std::int64_t n = 3 * followed_.count();
  c.feet = followed_(seen.rows.narrow(0, last, 1)).view({-1}).narrow(0, 0, n).clone();
  return c;
}

MotionModel::Expected MotionModel::next(const Carried& before) const {
  const torch::NoGradGuard no_grad;
  const Tensor zero = torch::zeros({1, 1, columns()}, before.frame.options());
  const lstm_gmm::Mixture mixture = run(before, {zero, zero, torch::zeros({1, 1, kFeet}, zero.options())}).mixture;
  const auto best = mixture.log_weights[0].argmax().item<std::int64_t>();
  return {mixture.means[0][best], mixture.log_sigmas[0][best].exp(), (mixture.contact_logits[0] > 0).to(zero.scalar_type())};
}

Tensor MotionModel::scale(const Carried& before, const Motion& m) const {
  const torch::NoGradGuard no_grad;
  const std::int64_t t = m.frames(), b = m.candidates(), d = columns();
  const lstm_gmm::Mixture mixture = run(before, m).mixture;
  const Tensor z = (m.states.reshape({t * b, 1, d}) - mixture.means) * (-mixture.log_sigmas).exp();
  const Tensor best = (mixture.log_weights - (0.5 * z.square() + mixture.log_sigmas).sum(2)).argmax(1);
  return mixture.log_sigmas.exp().index({torch::arange(t * b), best}).view({t, b, d});
}

}  // namespace mocap::control
