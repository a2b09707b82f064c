#include "libmodels/control/path_follower.hpp"

#include <algorithm>
#include <cmath>

#include "libmocap/base/random.hpp"

namespace mocap::control {

namespace {

constexpr int kAttempts = 4;  // at a window behind one that made less way than kSlow of what the speed asks for
constexpr double kSlow = 0.4, kBehind = 0.3, kFastest = 4, kStallSeconds = 3, kStallMetres = 0.25, kSpacing = 0.05;

}  // namespace

Followed follow_path(const MotionModel& model, const lstm_gmm::Sampler& sampler, const GroundCurve& curve, const Terms& terms, const FollowSettings& settings, const PlanOptions& options, std::uint64_t number) {
  const double rate = model.reference().frame_rate_hz;
  const double reach = kFastest * static_cast<double>(options.window) / rate + kBehind;
  const GroundCurve even = curve.resampled(kSpacing);
  const double length = even.length();  // of a shaken curve less than its own: what is followed is this one
  auto points = even.points();
  Followed f;
  f.clip.path = points;
  const Vector2 end = even.tangent_at(length);
  points.push_back(points.back() + (reach + 1) * end);
  const auto longer = std::make_shared<GroundCurve>(points);

  PlanOptions own = options;
  own.seed = options.seed + (number << 32);
  double at = 0;
  std::optional<double> speed = settings.speed;
  const auto terms_at = [&](const torch::Tensor& contacts_before) {
    Terms all = terms;
    all.push_back(curve_term(longer, at - kBehind, at + reach, settings.curve_sigma));
    if (settings.facing_sigma > 0) all.push_back(facing_term(longer, at - kBehind, at + reach, settings.facing_sigma));
    if (speed) all.push_back(speed_term(*speed, settings.speed_sigma));
    if (settings.step_length) all.push_back(step_length_term(contacts_before, *settings.step_length, settings.step_sigma));
    return all;
  };
  const Vector2 first = curve.point_at(0);
  const std::int64_t d = model.columns();
  Carried start = best_start(model, sampler, model.generator().starts, first.x(), first.y(), curve.initial_heading(), terms_at(torch::zeros({2})), own);
  if (!speed) speed = start.speed;
  Shown shown(model.reference(), start);
  Planner planner(model, sampler, std::move(start), own);

  const double most = settings.most_seconds > 0 ? settings.most_seconds : std::max(5.0, 3 * length);
  const auto limit = static_cast<std::int64_t>(std::llround(most * rate));
  std::vector<double> distances = {0};  // of the frame that it starts with, which stands on the curve
  std::vector<double> reached = {0};
  double nats = 0;
  std::int64_t windowed = 0;
  bool slow = false;
  while (static_cast<std::int64_t>(distances.size()) < limit) {
    FollowedWindow w;
    w.first = static_cast<std::int64_t>(distances.size());
    const Planned planned = planner.next(terms_at(planner.now().shown.narrow(0, d, train::kContactBits) >= 0.5), slow ? kAttempts : 1);
    const double before = at;
    std::int64_t kept = 0;
    for (std::int64_t i = 0; i < planned.point.size(0) && !f.reached_end && static_cast<std::int64_t>(distances.size()) < limit; ++i, ++kept) {
      const auto near = longer->nearest({planned.point[i][0].item<double>(), planned.point[i][1].item<double>()}, at - kBehind, at + reach);
      at = std::max(at, near.s);
      distances.push_back(near.distance);
      reached.push_back(at);
      w.mean_distance += near.distance;
      f.reached_end = at >= length;
    }
    slow = at - before < kSlow * *speed * static_cast<double>(kept) / rate;
    shown.add(planned.rows.narrow(0, 0, kept));
    w.mean_distance /= static_cast<double>(std::max<std::int64_t>(1, kept));
    w.after_swarm = planned.after_swarm;
    w.after_lbfgs = planned.after_lbfgs;
    w.terms = planned.terms;
    for (const auto& [name, value] : planned.terms)
      if (name == "prior") w.prior_per_frame = value / static_cast<double>(planned.window);
    nats += w.prior_per_frame * static_cast<double>(planned.window);
    windowed += planned.window;
    f.windows.push_back(std::move(w));
    if (f.reached_end) break;
    const auto back = static_cast<std::size_t>(std::llround(kStallSeconds * rate));
    f.stalled = reached.size() > back && reached.back() - reached[reached.size() - 1 - back] < kStallMetres;
    if (f.stalled) break;
  }
  const auto path = std::move(f.clip.path);
  f.clip = shown.piece();
  f.clip.path = path;
  f.followed_m = curve.length() * std::min(1.0, at / length);
  for (const double distance : distances) {
    f.mean_distance += distance / static_cast<double>(distances.size());
    f.largest_distance = std::max(f.largest_distance, distance);
  }
  double way = 0;
  for (std::size_t i = 1; i < f.clip.frames(); ++i) way += (f.clip.root_position[i] - f.clip.root_position[i - 1]).head<2>().norm();
  f.mean_speed = f.clip.frames() > 1 ? way * rate / static_cast<double>(f.clip.frames() - 1) : 0;
  f.prior_per_frame = windowed ? nats / static_cast<double>(windowed) : 0;
  return f;
}

}  // namespace mocap::control
