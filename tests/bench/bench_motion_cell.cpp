// Training step and sampling of the Motion Cell at paper size, against the bare matrix products of the same step and an
// idiomatic LibTorch loop. Everything alternates in one run and only ratios of neighbours count, since other load on
// the machine comes and goes: bench_motion_cell [PAIRS]
#include <cstdlib>

#include "libmodels/motion_cell/network.hpp"
#include "libmodels/motion_cell/packed_cell.hpp"
#include "libmodels/motion_cell/sampler.hpp"
#include "libmodels/nn/blas.hpp"
#include "libmodels/nn/losses.hpp"
#include "libmodels/nn/sharded.hpp"
#include "tests/bench/bare_products.hpp"
#include "tests/motion_cell/reference.hpp"

namespace mocap::motion_cell {
namespace {

using namespace bench;

constexpr int kBatch = 64, kWords = 66, kShards = 2, kThreads = 2;

BareProducts bare_products(const MotionCellConfig& c, std::int64_t batch) {
  const int p = c.width, e = c.word, z = c.latent, state = 2 * c.hidden, a = c.control;
  Layers outside, recurrent, beside;
  chain(outside, {c.word_features(), p, p, e});
  chain(outside, {e, p, p, c.word_features()});
  chain(outside, {e, p, p, e});
  for (int i = 0; i < 2; ++i) chain(recurrent, {e + state + a, p, p, p, p, z});
  chain(recurrent, {z, p, p, e});
  chain(recurrent, {2 * e, 3 * c.hidden});
  for (int i = 0; i < 3; ++i) chain(recurrent, {c.hidden, 3 * c.hidden});
  for (int i = 0; i < 2; ++i) chain(beside, {state + a, p, p, p, p, z});
  chain(beside, {e + state + a, p, p, e});
  return {batch, kWords, outside, recurrent, beside};
}

Tensor loss(const MotionCellConfig& c, const CellOutput& out, const Tensor& x, const Tensor& target) {
  const auto quaternions = [&](const Tensor& t) {
    return t.slice(2, 0, 4 * c.joints).reshape({t.size(0), t.size(1), c.joints, 4});
  };
  const Tensor rotation = nn::geodesic_distance(quaternions(out.y), target).sum();
  return (rotation + (out.y - x).slice(2, 4 * c.joints).square().sum() + out.kl.sum()) / kBatch;
}

void training(int pairs) {
  MotionCell cell(MotionCellConfig::preset("paper"), 1);
  const MotionCellConfig& c = cell.config();
  const CellInput in = random_input(c, kBatch, kWords, -1);
  CellInput own = in;
  own.replace = torch::rand({kWords, kBatch}) < 0.5;
  const Tensor target = nn::normalize_quaternions(in.x.slice(2, 0, 4 * c.joints).reshape({kBatch, -1, c.joints, 4}));
  nn::ShardedGradient executor(kShards, kThreads);
  const auto parameters = cell.parameters();
  const auto step = [&](const CellInput& all, bool ours) {
    const auto packed = ours ? cell.pack() : nullptr;
    (void)executor.compute(parameters, [&](int s) -> nn::ShardedGradient::Share {
      const auto [first, last] = nn::shard_range(kBatch, kShards, s);
      const CellInput part{all.x.slice(0, first, last), all.classes.slice(0, first, last),
                           all.posterior_noise.slice(1, first, last), all.initial_noise.slice(0, first, last),
                           all.replace.defined() ? all.replace.slice(1, first, last) : Tensor()};
      const CellOutput out = ours ? cell.forward(part, packed) : reference_forward(cell, part);
      return {loss(c, out, part.x, target.slice(0, first, last)), {}};
    });
  };
  std::vector<BareProducts> bare;
  for (int s = 0; s < kShards; ++s) bare.push_back(bare_products(c, kBatch / kShards));
  const double flop = bare[0].flop() * kShards;
  fmt::print(
      "training step, {} parameters, batch {} x {} words, {} shards on {} threads, {:.1f} GFLOP in matrix products\n",
      cell.parameter_count(), kBatch, kWords, kShards, kThreads, flop / 1e9);

  std::vector<double> t_naive, t_merged, t_ours, t_own, t_plain;
  for (int i = -1; i < pairs; ++i) {
    const double naive = seconds([&] { executor.for_each(kShards, [&](int s) { bare[s].naive(); }); });
    const double ours = seconds([&] { step(in, true); });
    const double merged = seconds([&] { executor.for_each(kShards, [&](int s) { bare[s].merged(); }); });
    const double with_own = seconds([&] { step(own, true); });
    const double plain = seconds([&] { step(in, false); });
    if (i < 0) continue;  // the first round warms caches and memory up
    t_naive.push_back(naive), t_merged.push_back(merged), t_ours.push_back(ours), t_own.push_back(with_own),
        t_plain.push_back(plain);
  }
  print_row("bare products, a word at a time", t_naive, t_naive, flop);
  print_row("bare products, merged over words", t_merged, t_naive, flop);
  print_row("training step, teacher forcing", t_ours, t_naive, flop);
  print_row("training step, half own outputs", t_own, t_naive, flop);
  print_row("idiomatic LibTorch loop, teacher forcing", t_plain, t_naive, flop);
}

void sampling(int repeats) {
  const MotionCell cell(MotionCellConfig::preset("paper"), 1);
  const Sampler sampler(cell);
  const auto clips = [](int count, std::int64_t frames) {
    std::vector<ClipRequest> requests;
    for (int i = 0; i < count; ++i)
      requests.push_back({1, static_cast<std::uint64_t>(i), frames, {{0, {i % 4, i % 2}}}});
    return requests;
  };
  const auto rate = [&](const char* name, const std::vector<ClipRequest>& requests, int threads, double wanted) {
    std::vector<double> rates;
    for (int i = -1; i < repeats; ++i) {
      const double t = seconds([&] { (void)sample_clips(sampler, requests, {.threads = threads}); });
      if (i >= 0) rates.push_back(static_cast<double>(requests.size()) * static_cast<double>(requests[0].frames) / t);
    }
    const Spread s = spread(rates);
    fmt::print("{:<44} {:8.0f} frames/s  ({:.0f} .. {:.0f}), PyTorch's best {:.0f}\n", name, s.median, s.low, s.high,
               wanted);
  };
  rate("sampling 64 clips of 198 frames, 2 threads", clips(64, 198), 2, 28000);
  rate("sampling 1 clip of 600 frames", clips(1, 600), 1, 1400);
}

}  // namespace
}  // namespace mocap::motion_cell

int main(int argc, char** argv) {
  const int pairs = argc > 1 ? std::max(1, std::atoi(argv[1])) : 9;
  mocap::nn::use_one_blas_thread();
  fmt::print("{}\n", mocap::nn::compute_libraries());
  mocap::motion_cell::training(pairs);
  mocap::motion_cell::sampling(pairs);
}
