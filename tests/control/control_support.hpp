// Tiny models to look for motion with, in memory.
#pragma once
#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "libmocap/base/random.hpp"
#include "libmocap/clip/ground.hpp"
#include "libmodels/control/path_follower.hpp"
#include "libmodels/nn/mlp.hpp"
#include "tests/store/sample_clips.hpp"

namespace mocap::control {

inline torch::Tensor normal(at::IntArrayRef sizes, std::uint64_t stream, double deviation = 1) {
  Random random(11, stream);
  return deviation * nn::normal_tensor(sizes, random).to(torch::kDouble);
}

// A body that leans a little while it walks: far from the half turns at which headings are not defined.
inline std::vector<Clip> gentle_motions(std::size_t count, std::uint64_t seed, std::size_t frames = 40) {
  std::vector<Clip> clips;
  for (std::size_t i = 0; i < count; ++i) {
    Clip clip = mocap::testing::with_contacts(mocap::testing::sample_clip("clip" + std::to_string(i), frames, seed + i));
    for (auto& q : clip.rotations) q = exp_map(0.2 * log_map(q));
    clips.push_back(std::move(clip));
  }
  return clips;
}

struct Data {
  mocap::testing::TemporaryFolder folder;
  std::unique_ptr<train::StateDataset> set;
  Data() {
    mocap::testing::write_archive(folder / "c.h5", gentle_motions(4, 1), "preset:default");
    set = std::make_unique<train::StateDataset>(folder / "c.h5");
  }
};
inline const Data& data() {
  static const Data d;
  return d;
}

inline torch::Tensor starts_of(const train::StateDataset& set) {
  std::vector<torch::Tensor> pairs;
  for (const auto& clip : set.clips())
    for (const std::int64_t first : {0, 9, 23}) pairs.push_back(clip.rows.narrow(0, first, 2));
  return torch::stack(pairs);
}

inline lstm_gmm::LstmGmmConfig tiny() {
  lstm_gmm::LstmGmmConfig c;
  c.hidden = 6;
  c.width = 7;
  c.mixtures = 2;
  return c;
}

inline lstm_gmm::Model tiny_generator(std::uint64_t seed = 3) {
  lstm_gmm::Model m;
  m.network = std::make_unique<lstm_gmm::Network>(tiny(), seed);
  m.reference = data().set->reference();
  m.starts = starts_of(*data().set);
  m.default_frames = 30;
  return m;
}

// Its change of the motion is far from small.
inline refiner::Model tiny_refiner() {
  refiner::RefinerConfig c;
  c.hidden = 6;
  c.width = 5;
  refiner::Model m;
  m.network = std::make_unique<refiner::RefinerNetwork>(c, 7);
  m.reference = data().set->reference();
  m.contacts_rule = "preset:default";
  const torch::NoGradGuard no_grad;
  m.network->output->weight(0).mul_(20);
  const torch::Tensor e = refiner::EndEffectors(m.reference)(data().set->clips()[0].rows.unsqueeze(1)).squeeze(1);
  m.effector_mean = e.mean(0);
  m.effector_deviation = e.std(0).clamp_min(0.01);
  return m;
}

// A network that has learnt one thing: all goes back to the mean pose, which moves `step` metres forward in every frame, with both feet up.
inline lstm_gmm::Model walker(double step, double log_sigma = -2) {
  lstm_gmm::Model m = tiny_generator();
  m.reference.mean[0] = static_cast<float>(step);
  m.reference.mean[1] = m.reference.mean[2] = 0;
  for (int k = 0; k < 3; ++k) m.reference.deviation[static_cast<std::size_t>(k)] = 0.02f;
  const torch::NoGradGuard no_grad;
  for (auto& p : m.network->parameters()) p.zero_();
  const std::int64_t mixtures = 2, d = 69;
  torch::Tensor y = torch::zeros({m.network->config().outputs()});
  y.narrow(0, mixtures + mixtures * d, mixtures * d).fill_(log_sigma);
  y.narrow(0, mixtures + 2 * mixtures * d, 2).fill_(-1);
  m.network->named_parameters()["decoder.1.bias"].copy_(y);
  m.starts.narrow(2, 0, d).mul_(0.1);
  m.starts.narrow(2, d, 2).zero_();
  return m;
}

inline Motion random_motion(std::int64_t frames, std::int64_t candidates, std::uint64_t stream, torch::Dtype number = torch::kDouble) {
  return {normal({frames, candidates, 69}, stream, 0.6).to(number), normal({frames, candidates, 69}, stream + 1, 0.05).to(number), (normal({frames, candidates, 2}, stream + 2) > 0).to(number)};
}

inline Carried placed(Carried c, double x, double y, double heading) {
  c.x = x;
  c.y = y;
  c.heading = heading;
  return c;
}

// A term of one's own.
class TermOf final : public Term {
 public:
  explicit TermOf(std::function<torch::Tensor(const Seen&)> f) : f_(std::move(f)) {}
  std::string name() const override { return "own"; }
  torch::Tensor operator()(const Seen& seen) const override { return f_(seen); }

 private:
  std::function<torch::Tensor(const Seen&)> f_;
};
inline std::shared_ptr<const Term> term_of(std::function<torch::Tensor(const Seen&)> f) { return std::make_shared<TermOf>(std::move(f)); }

}  // namespace mocap::control
