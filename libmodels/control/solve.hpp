// Solving the MAP problem of one window (Wang, Chai, Xia 2018, eq. 19): particle swarm for the start, then L-BFGS with strong Wolfe conditions.
//
// A particle is the generator's own noise: for every frame the standard normal numbers that choose a component of the mixture and a point of it. So every particle is a motion that the network can
// make, wherever the swarm moves it. Kennedy's constants: v <- 0.73 (v + 2.05 r_1 (own best - x) + 2.05 r_2 (best - x)), r uniform by coordinate.
//
// L-BFGS runs on (s_t - s_t^0) / sigma_t and d_t / 0.05, where s^0 is the start and sigma_t the deviations of the mixture there: the prior is round in these, in which the states' own numbers differ by a
// factor of a thousand. Contacts are read from the network before each of `rereads` runs and held within it.
#pragma once
#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "libmodels/control/terms.hpp"
#include "libmodels/lstm_gmm/sampler.hpp"

namespace mocap::control {

struct SwarmOptions {
  int particles = 128, rounds = 1;  // 0 rounds: the best of the particles as they are drawn
  double spread = 0.75;            // deviation of the first draws
  int threads = 1;
};

struct LbfgsOptions {
  int iterations = 30, rereads = 2;  // iterations of each run
  double noise_sigma = 0.05;         // scale of d
};

// The sum of the terms, (B).
torch::Tensor total(const Seen& seen, const Terms& terms);
// L-BFGS from where the unknowns are, which it moves. `objective`: a number that depends on them. What it was at the start.
double lbfgs(std::vector<torch::Tensor> unknown, const LbfgsOptions& options, const std::function<torch::Tensor()>& objective);

// (B) nats of each candidate.
torch::Tensor objective(const MotionModel& model, const Carried& before, const Motion& motion, const Terms& terms);
// Every term by name, of one candidate.
std::vector<std::pair<std::string, double>> by_term(const MotionModel& model, const Carried& before, const Motion& motion, const Terms& terms);

// The motion of one candidate that the swarm ends with. `given` (G, D + 2): frames that half of the particles begin with, as an earlier window left them; may be undefined.
// Equal (seed, stream) give equal motions for any number of threads.
Motion swarm(const MotionModel& model, const lstm_gmm::Sampler& sampler, const Carried& before, std::int64_t frames, const torch::Tensor& given, const Terms& terms, const SwarmOptions& options, std::uint64_t seed, std::uint64_t stream);

struct Minimised {
  Motion motion;
  double before = 0, after = 0;  // the objective; never higher after than before
};
// Of one candidate. Where no step lowers the objective the motion stays what it was.
Minimised minimise(const MotionModel& model, const Carried& before, const Motion& start, const Terms& terms, const LbfgsOptions& options);

}  // namespace mocap::control
