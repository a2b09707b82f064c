// Motion of any length by sliding windows (Wang, Chai, Xia 2018, sections 5.2 and 5.3): each window is solved (solve.hpp), all of it but the overlap is kept, and the next begins behind what was kept,
// with the overlap as one of the things that its swarm starts from. 34 frames and 17 of overlap are theirs.
#pragma once
#include "libmodels/control/solve.hpp"

namespace mocap::control {

struct PlanOptions {
  std::int64_t window = 34, overlap = 17;
  SwarmOptions swarm;
  LbfgsOptions lbfgs;
  std::uint64_t seed = 1;

  void validate() const;  // Error(usage)
};

struct Planned {
  torch::Tensor rows;                            // (F, D + 2) the frames kept, as they are shown
  torch::Tensor point;                           // (F, 2) the followed joint on the ground, m, world
  double after_swarm = 0, after_lbfgs = 0;       // the objective of the whole window
  std::vector<std::pair<std::string, double>> terms;  // of the whole window, at the end
  std::int64_t window = 0;                       // frames in it
};

class Planner {
 public:
  // All are kept by reference.
  Planner(const MotionModel& model, const lstm_gmm::Sampler& sampler, Carried start, const PlanOptions& options);

  const Carried& now() const { return now_; }
  // The next window - overlap frames under these terms. `attempts`: swarms of their own, the later ones drawn with the generator's whole noise; the lowest objective in the end wins.
  Planned next(const Terms& terms, int attempts = 1);

 private:
  const MotionModel& model_;
  const lstm_gmm::Sampler& sampler_;
  Carried now_;
  PlanOptions options_;
  torch::Tensor left_;  // (overlap, D + 2) what the window before planned further
  std::uint64_t windows_ = 0;
};

// Of the starts (K, 2, input) that a model brings along, tried up to `most` of them evenly, the one from which the swarm finds the lowest objective, placed at `x`, `y`, `heading`.
Carried best_start(const MotionModel& model, const lstm_gmm::Sampler& sampler, const torch::Tensor& starts, double x, double y, double heading, const Terms& terms, const PlanOptions& options, std::int64_t most = 16);

// The frames of a motion, put together piece by piece into a clip.
class Shown {
 public:
  Shown(const train::Reference& reference, const Carried& start);  // with the start's frame
  void add(const torch::Tensor& rows);                                  // (F, D + 2)
  Clip piece();                                                         // the frames since the last piece, with contacts

 private:
  const train::Reference& reference_;
  features::StateDecoder decode_;
  std::vector<float> rows_;
};

}  // namespace mocap::control
