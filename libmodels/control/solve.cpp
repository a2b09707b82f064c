#include "libmodels/control/solve.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "libmocap/base/random.hpp"

namespace mocap::control {

using torch::Tensor;

namespace {

constexpr double kInertia = 0.73, kPull = 2.05;

}  // namespace

Tensor total(const Seen& seen, const Terms& terms) {
  Tensor sum;
  for (const auto& term : terms) {
    const Tensor one = (*term)(seen);
    sum = sum.defined() ? sum + one : one;
  }
  return sum;
}

double lbfgs(std::vector<Tensor> unknown, const LbfgsOptions& options, const std::function<Tensor()>& objective) {
  torch::optim::LBFGS search(std::move(unknown), torch::optim::LBFGSOptions(1).max_iter(options.iterations).max_eval(2 * options.iterations + 2).history_size(12).line_search_fn("strong_wolfe"));
  std::optional<double> begun;
  (void)search.step([&]() -> Tensor {
    const torch::AutoGradMode with_gradients(true);
    search.zero_grad();
    Tensor value = objective();
    value.backward();
    if (!begun) begun = value.item<double>();
    return value.detach();
  });
  return *begun;
}

Tensor objective(const MotionModel& model, const Carried& before, const Motion& motion, const Terms& terms) { return total(model(before, motion), terms); }

std::vector<std::pair<std::string, double>> by_term(const MotionModel& model, const Carried& before, const Motion& motion, const Terms& terms) {
  const torch::NoGradGuard no_grad;
  const Seen seen = model(before, motion);
  std::vector<std::pair<std::string, double>> all;
  for (const auto& term : terms) all.emplace_back(term->name(), (*term)(seen).item<double>());
  return all;
}

Motion swarm(const MotionModel& model, const lstm_gmm::Sampler& sampler, const Carried& before, std::int64_t frames, const Tensor& given, const Terms& terms, const SwarmOptions& options, std::uint64_t seed, std::uint64_t stream) {
  const torch::NoGradGuard no_grad;
  const std::int64_t d = model.columns(), width = d + train::kContactBits, drawn = 1 + d, size = frames * drawn;
  const auto particles = static_cast<std::size_t>(std::max(1, options.particles));
  const auto values = [](const Tensor& t) {
    const Tensor c = t.to(torch::kFloat).contiguous();
    return std::vector<float>(c.data_ptr<float>(), c.data_ptr<float>() + c.numel());
  };
  const std::vector<float> first = values(before.frame), state = values(before.state), kept = given.defined() ? values(given) : std::vector<float>();
  std::vector<lstm_gmm::ClipRequest> requests(particles);
  std::vector<std::vector<float>> velocity(particles, std::vector<float>(static_cast<std::size_t>(size), 0.0f)), own(particles);
  std::vector<double> own_best(particles, std::numeric_limits<double>::infinity());
  std::vector<Random> random;
  for (std::size_t i = 0; i < particles; ++i) {
    random.emplace_back(seed, stream_of(stream, i));
    auto& r = requests[i];
    r.frames = frames + 1;
    r.first = first;
    r.state = state;
    if (i % 2 == 0) r.given = kept;
    for (std::int64_t k = 0; k < size; ++k) r.draws.push_back(static_cast<float>(options.spread * random[i].normal()));
  }
  std::size_t best = 0;
  std::vector<float> best_draws;
  Motion best_motion;
  double lowest = std::numeric_limits<double>::infinity();
  lstm_gmm::SampleOptions how;
  how.threads = options.threads;
  how.chunk = static_cast<int>((particles + static_cast<std::size_t>(options.threads) - 1) / static_cast<std::size_t>(options.threads));
  for (int round = 0;; ++round) {
    const auto clips = sampler.sample(requests, how);
    const auto b = static_cast<std::int64_t>(particles);
    Tensor rows = torch::empty({frames, b, width});
    for (std::int64_t i = 0; i < b; ++i) rows.select(1, i).copy_(torch::from_blob(const_cast<float*>(clips[static_cast<std::size_t>(i)].data()) + width, {frames, width}));  // without the frame carried
    rows = rows.to(before.frame.scalar_type());
    const Motion all{rows.narrow(2, 0, d).contiguous(), torch::zeros({frames, b, d}, rows.options()), rows.narrow(2, d, train::kContactBits).contiguous()};
    const Tensor found = objective(model, before, all, terms).to(torch::kDouble);
    for (std::size_t i = 0; i < particles; ++i) {
      const double e = found[static_cast<std::int64_t>(i)].item<double>();
      if (!(e < own_best[i])) continue;
      own_best[i] = e;
      own[i] = requests[i].draws;
      if (e >= lowest) continue;
      lowest = e;
      best = i;
      best_draws = own[i];
      const Motion one = all.candidate(static_cast<std::int64_t>(i));
      best_motion = {one.states.clone(), one.noise.clone(), one.contacts.clone()};
    }
    if (round >= options.rounds || own[best].empty()) break;
    for (std::size_t i = 0; i < particles; ++i)
      for (std::size_t k = 0; k < static_cast<std::size_t>(size); ++k) {
        const float now = requests[i].draws[k];
        const double to_own = own[i].empty() ? 0 : own[i][k] - now, to_best = best_draws[k] - now;
        velocity[i][k] = static_cast<float>(kInertia * (velocity[i][k] + kPull * (random[i].uniform() * to_own + random[i].uniform() * to_best)));
        requests[i].draws[k] = now + velocity[i][k];
      }
  }
  if (best_motion.states.defined()) return best_motion;
  // Nothing finite: the frame before, held, so that the caller sees the objective for what it is.
  const Tensor still = before.frame.expand({frames, 1, width});
  return {still.narrow(2, 0, d).clone(), torch::zeros({frames, 1, d}, still.options()), still.narrow(2, d, train::kContactBits).clone()};
}

Minimised minimise(const MotionModel& model, const Carried& before, const Motion& start, const Terms& terms, const LbfgsOptions& options) {
  Minimised result{start, 0, 0};
  {
    const torch::NoGradGuard no_grad;
    result.before = objective(model, before, start, terms).item<double>();
  }
  result.after = result.before;
  for (int run = 0; run < std::max(1, options.rereads); ++run) {
    const Motion from = result.motion;
    const Tensor scale = model.scale(before, from);
    Tensor z = torch::zeros_like(from.states), e = (from.noise / options.noise_sigma).clone();
    z.set_requires_grad(true);
    e.set_requires_grad(true);
    const auto motion = [&] { return Motion{from.states + scale * z, options.noise_sigma * e, from.contacts}; };
    (void)lbfgs({z, e}, options, [&] { return objective(model, before, motion(), terms).sum(); });
    const torch::NoGradGuard no_grad;
    Motion found = motion();
    found = {found.states.detach().clone(), found.noise.detach().clone(), from.contacts};
    const double fixed = objective(model, before, found, terms).item<double>();
    if (!(fixed < result.after)) break;
    result.motion = found;
    result.after = fixed;
    if (run + 1 == std::max(1, options.rereads)) break;
    // Contacts as the network has them where it sees the motion as it is now. They change the objective: the better of both goes on.
    Motion reread = found;
    reread.contacts = model.contacts_of(model(before, found));
    const double with = objective(model, before, reread, terms).item<double>();
    if (torch::equal(reread.contacts, found.contacts)) break;
    if (with < result.after) {
      result.motion = reread;
      result.after = with;
    }
  }
  return result;
}

}  // namespace mocap::control
