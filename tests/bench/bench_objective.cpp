// Training step of the Motion Cell at preset `small` (batch 32 x 120 frames, 2 shards on 2 threads) by what its loss is made of:
// representations, distances (forward kinematics among them), classifiers, the remedies for exposure bias, single layer. All
// variants alternate in one run and each is compared with the first of its round: bench_objective [ROUNDS]
#include <cstdlib>

#include "libmocap/base/error.hpp"
#include "libmodels/motion_cell/training.hpp"
#include "libmodels/nn/blas.hpp"
#include "libmodels/nn/losses.hpp"
#include "libmodels/nn/sharded.hpp"
#include "tests/bench/bare_products.hpp"
#include "tests/objective/data.hpp"

namespace mocap {
namespace {

using features::RotationRepresentation;
using motion_cell::Exposure;
using objective::Distance;
using namespace bench;

// Forward kinematics as one writes it in LibTorch, joint by joint on (frames, 4) quaternions.
Tensor plain_positions(const Skeleton& s, const Tensor& q) {
  const auto multiply = [](const Tensor& a, const Tensor& b) {
    const auto u = a.unbind(1), v = b.unbind(1);
    return torch::stack({u[0] * v[0] - u[1] * v[1] - u[2] * v[2] - u[3] * v[3], u[0] * v[1] + u[1] * v[0] + u[2] * v[3] - u[3] * v[2], u[0] * v[2] - u[1] * v[3] + u[2] * v[0] + u[3] * v[1],
                         u[0] * v[3] + u[1] * v[2] - u[2] * v[1] + u[3] * v[0]},
                        1);
  };
  const auto rotate = [](const Tensor& a, const Vector3& offset) {
    const Tensor v = torch::tensor({offset.x(), offset.y(), offset.z()}, torch::kFloat).expand({a.size(0), 3}), u = a.narrow(1, 1, 3), t = 2 * torch::cross(u, v, 1);
    return v + a.narrow(1, 0, 1) * t + torch::cross(u, t, 1);
  };
  std::vector<Tensor> world{q.select(1, 0)}, place{torch::zeros({q.size(0), 3})};
  for (std::size_t j = 1; j < s.parents.size(); ++j) {
    const auto parent = static_cast<std::size_t>(s.parents[j]);
    world.push_back(multiply(world[parent], q.select(1, static_cast<std::int64_t>(j))));
    place.push_back(place[parent] + rotate(world[parent], s.rest_offsets[j]));
  }
  std::vector<Tensor> all(place.begin() + 1, place.end());
  for (const auto& e : s.end_sites) all.push_back(place[static_cast<std::size_t>(e.parent)] + rotate(world[static_cast<std::size_t>(e.parent)], e.offset));
  return torch::stack(all, 1);
}

void kinematics(int rounds) {
  const auto body = canonical_body();
  const nn::BodyPositions ours(*body);
  Random random(1, 1);
  const Tensor q = nn::normalize_quaternions(nn::normal_tensor({16 * 120, body->joint_count(), 4}, random)), goal = nn::normal_tensor({16 * 120, ours.points(), 3}, random);
  const auto run = [&](const std::function<Tensor(const Tensor&)>& positions) {
    const Tensor x = q.clone().set_requires_grad(true);
    (void)torch::autograd::grad({((positions(x) - goal).square().sum(-1) + 1e-12).sqrt().sum()}, {x});
  };
  std::vector<double> a, b;
  for (int i = -1; i < rounds; ++i) {
    const double one = seconds([&] { run(ours); }), other = seconds([&] { run([&](const Tensor& x) { return plain_positions(*body, x); }); });
    if (i >= 0) a.push_back(one), b.push_back(other);
  }
  fmt::print("positional loss of a shard (16 x 120 frames), forward and backward, one thread: {:.1f} ms; joint by joint in LibTorch {:.1f} ms\n", 1e3 * spread(a).median, 1e3 * spread(b).median);
}

struct Variant {
  std::string name;
  std::unique_ptr<motion_cell::MotionCellTraining> training;
  std::vector<double> times;
};

void steps(int rounds) {
  const mocap::testing::TemporaryFolder folder;
  std::vector<Clip> clips;
  for (int i = 0; i < 32; ++i) clips.push_back(mocap::testing::waving(fmt::format("c{}", i), 150, 0.1 * i));
  mocap::testing::write_archive(folder / "w.h5", clips);
  const std::vector<Clip> some(clips.begin(), clips.begin() + 4);
  mocap::testing::write_classifier(folder / "a.h5", some, "action", {"run", "walk"}, 1);
  mocap::testing::write_classifier(folder / "b.h5", some, "side", {"left", "right"}, 2);
  std::map<RotationRepresentation, std::unique_ptr<train::MotionDataset>> data;
  std::map<RotationRepresentation, std::unique_ptr<objective::ClassifierLoss>> losses;
  for (const auto r : {RotationRepresentation::quaternion, RotationRepresentation::rotation_matrix, RotationRepresentation::axis_angle}) {
    data[r] = std::make_unique<train::MotionDataset>(folder / "w.h5", r, std::vector<std::string>{});
    losses[r] = std::make_unique<objective::ClassifierLoss>(std::vector<std::string>{folder / "a.h5", folder / "b.h5"}, *data[r]);
  }
  std::vector<Variant> variants;
  const auto add = [&](const std::string& name, RotationRepresentation r, Distance d, Exposure exposure, bool judged, bool single = false) {
    auto config = motion_cell::TrainingConfig::preset("small");
    config.pretraining.steps = 0;
    config.objective.distance = d;
    config.exposure = exposure;
    auto network = motion_cell::MotionCellConfig::preset("small");
    network.single_layer = single;
    if (single) network.word_length = 1;
    variants.push_back({name, std::make_unique<motion_cell::MotionCellTraining>(network, config, *data[r], nullptr, judged ? losses[r].get() : nullptr), {}});
  };
  const auto quaternion = RotationRepresentation::quaternion, matrix = RotationRepresentation::rotation_matrix, vector = RotationRepresentation::axis_angle;
  add("quaternion d1, teacher forcing", quaternion, Distance::d1, Exposure::none, false);
  add("quaternion d2", quaternion, Distance::d2, Exposure::none, false);
  add("quaternion d3", quaternion, Distance::d3, Exposure::none, false);
  add("quaternion l2", quaternion, Distance::l2, Exposure::none, false);
  add("quaternion fk", quaternion, Distance::fk, Exposure::none, false);
  add("rotation-matrix geodesic", matrix, Distance::geodesic, Exposure::none, false);
  add("rotation-matrix fk", matrix, Distance::fk, Exposure::none, false);
  add("axis-angle l2", vector, Distance::l2, Exposure::none, false);
  add("quaternion d1, own output", quaternion, Distance::d1, Exposure::own_output, false);
  add("quaternion d1, own output, two classifiers", quaternion, Distance::d1, Exposure::own_output, true);
  add("rotation-matrix, own output, two classifiers", matrix, Distance::geodesic, Exposure::own_output, true);
  add("quaternion d1, noise", quaternion, Distance::d1, Exposure::noise, false);
  add("quaternion d1, joint dropout", quaternion, Distance::d1, Exposure::joint_dropout, false);
  add("single layer, teacher forcing", quaternion, Distance::d1, Exposure::none, false, true);
  nn::ShardedGradient executor(2, 2);
  for (int i = -1; i < rounds; ++i)
    for (Variant& v : variants) {
      std::vector<Tensor> parameters;
      for (const auto& [name, p] : v.training->parameters()) parameters.push_back(p);
      v.training->prepare(3999);
      const double t = seconds([&] {
        (void)executor.compute(parameters, [&](int shard) {
          train::LossTerms terms;
          return nn::ShardedGradient::Share{v.training->shard_loss(shard, terms), {}};
        });
      });
      if (i >= 0) v.times.push_back(t);
    }
  fmt::print("step at preset small, batch 32 x 120 frames, 2 shards on 2 threads, forward and backward\n");
  for (const Variant& v : variants) {
    std::vector<double> ratios;
    for (std::size_t i = 0; i < v.times.size(); ++i) ratios.push_back(v.times[i] / variants[0].times[i]);
    fmt::print("{:<48} {:8.1f} ms   ratio {:.2f}  ({:.2f} .. {:.2f})\n", v.name, 1e3 * spread(v.times).median, spread(ratios).median, *std::min_element(ratios.begin(), ratios.end()),
               *std::max_element(ratios.begin(), ratios.end()));
  }
}

}  // namespace
}  // namespace mocap

int main(int argc, char** argv) {
  const int rounds = argc > 1 ? std::max(1, std::atoi(argv[1])) : 15;
  mocap::nn::use_one_blas_thread();
  fmt::print("{}\n", mocap::nn::compute_libraries());
  mocap::kinematics(rounds);
  mocap::steps(rounds);
}
