#include "libmodels/control/planner.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "libmocap/base/error.hpp"
#include "libmocap/base/random.hpp"

namespace mocap::control {

using torch::Tensor;

namespace {

enum Draw : std::uint64_t { kWindow = 301, kStart = 302 };

}  // namespace

void PlanOptions::validate() const {
  if (window < 2) refuse_usage(fmt::format("a window of {} frames, expected at least 2", window));
  if (overlap < 0 || overlap >= window) refuse_usage(fmt::format("an overlap of {} frames of a window of {}, expected less than the window", overlap, window));
  if (swarm.particles < 1) refuse_usage(fmt::format("{} particles, expected at least 1", swarm.particles));
}

Planner::Planner(const MotionModel& model, const lstm_gmm::Sampler& sampler, Carried start, const PlanOptions& options) : model_(model), sampler_(sampler), now_(std::move(start)), options_(options) { options.validate(); }

Planned Planner::next(const Terms& terms, int attempts) {
  Minimised found;
  for (int attempt = 0; attempt < std::max(1, attempts); ++attempt) {
    SwarmOptions how = options_.swarm;
    if (attempt > 0) how.spread = std::max(1.0, how.spread);
    const Motion start = swarm(model_, sampler_, now_, options_.window, left_, terms, how, options_.seed, stream_of(kWindow, windows_++));
    Minimised one = minimise(model_, now_, start, terms, options_.lbfgs);
    if (attempt == 0 || one.after < found.after) found = std::move(one);
  }
  const torch::NoGradGuard no_grad;
  const Seen seen = model_(now_, found.motion);
  const std::int64_t kept = options_.window - options_.overlap;
  Planned planned;
  planned.window = options_.window;
  planned.after_swarm = found.before;
  planned.after_lbfgs = found.after;
  for (const auto& term : terms) planned.terms.emplace_back(term->name(), (*term)(seen).item<double>());
  planned.rows = seen.rows.narrow(0, 0, kept).select(1, 0).to(torch::kFloat).contiguous();
  planned.point = seen.point.narrow(0, 0, kept).select(1, 0).to(torch::kDouble).contiguous();
  left_ = options_.overlap > 0 ? torch::cat({found.motion.states.narrow(0, kept, options_.overlap).select(1, 0), found.motion.contacts.narrow(0, kept, options_.overlap).select(1, 0)}, 1).clone() : Tensor();
  now_ = model_.advance(now_, found.motion, kept);
  return planned;
}

Carried best_start(const MotionModel& model, const lstm_gmm::Sampler& sampler, const Tensor& starts, double x, double y, double heading, const Terms& terms, const PlanOptions& options, std::int64_t most) {
  const torch::NoGradGuard no_grad;
  const std::int64_t count = starts.size(0), tried = std::min(count, most);
  Carried best;
  double lowest = std::numeric_limits<double>::infinity();
  std::vector<Carried> all = model.starts(starts.index_select(0, torch::div(torch::arange(tried) * count, tried, "floor")));
  for (std::int64_t i = 0; i < tried; ++i) {
    Carried& start = all[static_cast<std::size_t>(i)];
    start.x = x;
    start.y = y;
    start.heading = heading;
    SwarmOptions few = options.swarm;
    few.rounds = 0;
    const Motion motion = swarm(model, sampler, start, options.window, {}, terms, few, options.seed, stream_of(kStart, static_cast<std::uint64_t>(i)));
    const double e = objective(model, start, motion, terms).item<double>();
    if (best.frame.defined() && !(e < lowest)) continue;
    if (e < lowest) lowest = e;  // the first may be no number: any other is better then
    best = std::move(start);
  }
  return best;
}

Shown::Shown(const train::Reference& reference, const Carried& start) : reference_(reference), decode_(reference.skeleton, reference.frame_rate_hz, {start.heading, {start.x, start.y}}) { add(start.shown.to(torch::kFloat).unsqueeze(0)); }

void Shown::add(const Tensor& rows) {
  const Tensor r = rows.contiguous();
  rows_.insert(rows_.end(), r.data_ptr<float>(), r.data_ptr<float>() + r.numel());
}

Clip Shown::piece() {
  const auto frames = static_cast<std::int64_t>(rows_.size()) / (static_cast<std::int64_t>(reference_.mean.size()) + train::kContactBits);
  auto [features, contacts] = train::raw_states(rows_.data(), frames, reference_);
  rows_.clear();
  Clip clip = decode_(features);
  clip.contacts = std::move(contacts);
  return clip;
}

}  // namespace mocap::control
