#include "libmodels/control/terms.hpp"

#include <array>
#include <cmath>
#include <numbers>
#include <utility>

namespace mocap::control {
namespace {

using torch::Tensor;

// A term made of a function, so that a formula is one line.
template <class F>
class Formula final : public Term {
 public:
  Formula(std::string name, F f) : name_(std::move(name)), f_(std::move(f)) {}
  std::string name() const override { return name_; }
  Tensor operator()(const Seen& seen) const override { return f_(seen); }

 private:
  std::string name_;
  F f_;
};

template <class F>
std::shared_ptr<const Term> formula(std::string name, F f) {
  return std::make_shared<Formula<F>>(std::move(name), std::move(f));
}

constexpr std::array<std::int64_t, 2> kFramesAndValues = {0, 2};
const at::IntArrayRef kAllButCandidates(kFramesAndValues);

Tensor wrapped(const Tensor& angle) { return angle - (2 * std::numbers::pi) * (angle.detach() / (2 * std::numbers::pi)).round(); }

// Two numbers of the curve where it is nearest to each p, (T, B, 2); constants: at the nearest point the distance does not change to first order with where on the curve it is.
template <class F>
Tensor at_nearest(const GroundCurve& curve, const Tensor& p, double from, double to, F f) {
  const Tensor given = p.detach().to(torch::kDouble).contiguous(), found = torch::empty_like(given);
  const double* in = given.data_ptr<double>();
  double* out = found.data_ptr<double>();
  for (std::int64_t i = 0; i < given.numel(); i += 2) {
    const Vector2 v = f(curve.nearest({in[i], in[i + 1]}, from, to));
    out[i] = v.x();
    out[i + 1] = v.y();
  }
  return found.to(p.scalar_type());
}

}  // namespace

std::shared_ptr<const Term> prior() {
  return formula("prior", [](const Seen& seen) { return seen.nats.sum(0); });
}

std::shared_ptr<const Term> noise_prior(double sigma) {
  return formula("noise", [sigma](const Seen& seen) { return seen.noise.square().sum(kAllButCandidates) / (2 * sigma * sigma); });
}

std::shared_ptr<const Term> curve_term(std::shared_ptr<const GroundCurve> curve, double from, double to, double sigma) {
  return formula("curve", [=](const Seen& seen) {
    const Tensor near = at_nearest(*curve, seen.point, from, to, [](const GroundCurve::Nearest& n) { return n.point; });
    return (seen.point - near).square().sum(kAllButCandidates) / (sigma * sigma);
  });
}

std::shared_ptr<const Term> facing_term(std::shared_ptr<const GroundCurve> curve, double from, double to, double sigma) {
  return formula("facing", [=](const Seen& seen) {
    const Tensor tangent = at_nearest(*curve, seen.point, from, to, [&](const GroundCurve::Nearest& n) { return curve->tangent_at(n.s); });
    const Tensor along = seen.heading.cos() * tangent.select(2, 0) + seen.heading.sin() * tangent.select(2, 1);
    return (2 * (1 - along)).sum(0) / (sigma * sigma);
  });
}

std::shared_ptr<const Term> contact_term(double sigma, double sigma_height, double rest_height) {
  return formula("contact", [=](const Seen& seen) {
    const Tensor way = seen.foot_velocities / seen.frame_rate_hz, height = seen.feet.select(3, 2) - rest_height;
    return (seen.contacts * (way.square().sum(3) / (sigma * sigma) + height.square() / (sigma_height * sigma_height))).sum(kAllButCandidates);
  });
}

std::shared_ptr<const Term> speed_term(double metres_per_second, double sigma) {
  return formula("speed", [=](const Seen& seen) { return (seen.steps.mean(0) * seen.frame_rate_hz - metres_per_second).square() / (sigma * sigma); });
}

std::shared_ptr<const Term> direction_term(double heading, double sigma) {
  return formula("direction", [=](const Seen& seen) { return wrapped(seen.heading[seen.heading.size(0) - 1] - heading).square() / (sigma * sigma); });
}

std::shared_ptr<const Term> turn_rate_term(double before, double radians_per_second, double sigma) {
  return formula("turn_rate", [=](const Seen& seen) {
    const std::int64_t t = seen.heading.size(0);
    return ((seen.heading[t - 1] - before) * (seen.frame_rate_hz / static_cast<double>(t)) - radians_per_second).square() / (sigma * sigma);
  });
}

std::shared_ptr<const Term> step_length_term(Tensor contacts_before, double metres, double sigma) {
  return formula("step_length", [=](const Seen& seen) {
    const std::int64_t t = seen.contacts.size(0);
    const Tensor before = torch::cat({contacts_before.to(seen.contacts.scalar_type()).view({1, 1, 2}).expand({1, seen.contacts.size(1), 2}), seen.contacts.narrow(0, 0, t - 1)}, 0);
    const Tensor down = seen.contacts * (1 - before);  // (T, B, 2)
    const Tensor apart = ((seen.feet_on_ground.select(2, 0) - seen.feet_on_ground.select(2, 1)).square().sum(2) + 1e-12).sqrt().unsqueeze(2);
    return (down * (apart - metres).square()).sum(kAllButCandidates) / (down.sum(kAllButCandidates).clamp_min(1) * sigma * sigma);
  });
}

std::shared_ptr<const Term> observation_term(Measured m, double sigma_root, double sigma_angle) {
  return formula("observation", [=](const Seen& seen) {
    const std::int64_t angles = m.angles.size(1);
    const Tensor trust = m.trust.unsqueeze(1);
    const Tensor root = torch::cat({seen.root, seen.features.narrow(2, 3, 1)}, 2) - m.root.unsqueeze(1);
    const Tensor turned = torch::cat({(seen.heading - m.heading.unsqueeze(1)).unsqueeze(2), seen.features.narrow(2, 4, angles) - m.angles.unsqueeze(1)}, 2);
    return (trust.narrow(2, 0, 3) * root.square()).sum(kAllButCandidates) / (2 * sigma_root * sigma_root) + (trust.narrow(2, 3, 1 + angles) * turned.square()).sum(kAllButCandidates) / (2 * sigma_angle * sigma_angle);
  });
}

}  // namespace mocap::control
