// The terms of the MAP problem, each the negative logarithm of one probability, in nats (Wang, Chai, Xia 2018, sections 5.2 to 5.4).
//
//   Prior        sum_t -log p(s_t | ...)                                                  eq. 15, second part: the mixture of eq. 8
//   NoisePrior   sum_t |d_t|^2 / (2 sigma^2)                                              eq. 16, sigma 0.05
//   Curve        sum_t |p_t - c_near(t)|^2 / sigma^2                                      eq. 17: p the followed point on the ground, c_near the curve's nearest point to it
//   Facing       sum_t 2 (1 - cos(heading_t - tangent(t))) / sigma^2                      ours: the curve's tangent at the nearest point. Eq. 17 is as content with who walks to and fro
//   Contact      sum_t sum_(feet down) |f_t - f_(t-1)|^2 / sigma^2 + h_t^2 / sigma_y^2    eq. 18: f the toe base, h its height above the plane where it rests
//   Speed        (mean_t |step_t| rate - v)^2 / sigma^2                                   eq. 22
//   Direction    wrapped(heading_T - phi)^2 / sigma^2                                     eq. 23, whose sigma is 1
//   TurnRate     (rate (heading_T - heading_0) / T - omega)^2 / sigma^2                   5.2, "turning angles"
//   StepLength   mean over touch-downs of (|f_down - f_other| - l)^2 / sigma^2            5.2, "step sizes": between the toe bases where a foot comes down
//   Observation  sum_t |r_t - r_t^|^2 / (2 sigma_r^2) + |a_t - a_t^|^2 / (2 sigma_a^2)    eq. 25: root and joint angles of what was measured
//
// A term gives the nats of every candidate (B), differentiable with respect to the states and the noise. What is held fixed while these vary: contacts, nearest points, which frames a foot comes down in.
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "libmocap/math/ground_curve.hpp"
#include "libmodels/control/motion_model.hpp"

namespace mocap::control {

class Term {
 public:
  virtual ~Term() = default;
  virtual std::string name() const = 0;
  virtual torch::Tensor operator()(const Seen& seen) const = 0;  // (B)
};
using Terms = std::vector<std::shared_ptr<const Term>>;

std::shared_ptr<const Term> prior();
std::shared_ptr<const Term> noise_prior(double sigma);
// Nearest points are sought between `from` and `to` along the curve, so that one which crosses itself is followed in its order.
std::shared_ptr<const Term> curve_term(std::shared_ptr<const GroundCurve> curve, double from, double to, double sigma);
std::shared_ptr<const Term> facing_term(std::shared_ptr<const GroundCurve> curve, double from, double to, double sigma);
// rest_height: of the toe base above the ground where the foot stands, m; sigma of the way between frames, sigma_height of the height, m.
std::shared_ptr<const Term> contact_term(double sigma, double sigma_height, double rest_height);
std::shared_ptr<const Term> speed_term(double metres_per_second, double sigma);
std::shared_ptr<const Term> direction_term(double heading, double sigma);
std::shared_ptr<const Term> turn_rate_term(double before, double radians_per_second, double sigma);  // before: heading of the frame before the window
std::shared_ptr<const Term> step_length_term(torch::Tensor contacts_before, double metres, double sigma);  // (2) contacts of the frame before

// What was measured: of the frames of the window.
struct Measured {
  torch::Tensor root;     // (T, 3) m, world: ground position and height
  torch::Tensor heading;  // (T) rad, continuous
  torch::Tensor angles;   // (T, D - 4) rad: tilt and joint angles, the features from roll on
  torch::Tensor trust;    // (T, 4 + D - 4) 1, or 0 where a value is not to be believed: root 3, heading 1, angles
};
std::shared_ptr<const Term> observation_term(Measured measured, double sigma_root, double sigma_angle);

}  // namespace mocap::control
