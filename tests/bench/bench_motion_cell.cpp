// Training step and sampling of the Motion Cell at paper size, against the bare matrix products of the same step and an
// idiomatic LibTorch loop. Everything alternates in one run and only ratios of neighbours count, since other load on
// the machine comes and goes: bench_motion_cell [PAIRS]
#include <fmt/core.h>
#include <torch/torch.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <functional>
#include <thread>
#include <vector>

#include "libmodels/motion_cell/network.hpp"
#include "libmodels/motion_cell/packed_cell.hpp"
#include "libmodels/motion_cell/sampler.hpp"
#include "libmodels/nn/blas.hpp"
#include "libmodels/nn/losses.hpp"
#include "libmodels/nn/sharded.hpp"
#include "tests/motion_cell/reference.hpp"

namespace mocap::motion_cell {
namespace {

using torch::Tensor;

constexpr int kBatch = 64, kWords = 66, kShards = 2, kThreads = 2;

double seconds(const std::function<void()>& run) {
  const auto start = std::chrono::steady_clock::now();
  run();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

struct Spread {
  double median, low, high;
};
Spread spread(std::vector<double> v) {
  std::sort(v.begin(), v.end());
  return {v.size() % 2 ? v[v.size() / 2] : (v[v.size() / 2 - 1] + v[v.size() / 2]) / 2, v.front(), v.back()};
}

// The products of one layer in a step: output, gradient of the input, gradient of the weights (accumulated).
struct Products {
  Tensor x, w, y, dy, dx, dw;
  Products(std::int64_t rows, std::int64_t in, std::int64_t out)
      : x(torch::randn({rows, in})),
        w(torch::randn({out, in})),
        y(torch::empty({rows, out})),
        dy(torch::randn({rows, out})),
        dx(torch::empty({rows, in})),
        dw(torch::zeros({out, in})) {}
  void forward() { at::mm_out(y, x, w.t()); }
  void backward_input() { at::mm_out(dx, dy, w); }
  void backward_weight() { at::addmm_out(dw, dw, dy.t(), x); }
};

// Every product of one shard's training step. Naive: word encoder, decoder and f_w over all words at once, everything
// in the cell a word at a time. Merged: whatever does not wait for the recurrence over all words at once, weight
// gradients too.
class BareProducts {
 public:
  BareProducts(const MotionCellConfig& c, std::int64_t batch) : rows_(batch * kWords), batch_(batch) {
    const int p = c.width, e = c.word, z = c.latent, state = 2 * c.hidden, a = c.control;
    chain(outside_, {c.word_features(), p, p, e});
    chain(outside_, {e, p, p, c.word_features()});
    chain(outside_, {e, p, p, e});
    for (int i = 0; i < 2; ++i) chain(recurrent_, {e + state + a, p, p, p, p, z});
    chain(recurrent_, {z, p, p, e});
    chain(recurrent_, {2 * e, 3 * c.hidden});
    for (int i = 0; i < 3; ++i) chain(recurrent_, {c.hidden, 3 * c.hidden});
    for (int i = 0; i < 2; ++i) chain(beside_, {state + a, p, p, p, p, z});
    chain(beside_, {e + state + a, p, p, e});
    for (const auto* layers : {&outside_, &recurrent_, &beside_})
      for (const auto& [in, out] : *layers) flop_ += 6.0 * in * out * static_cast<double>(rows_);
    for (const auto& [in, out] : outside_) all_.emplace_back(rows_, in, out);
    for (const auto& [in, out] : beside_) all_.emplace_back(rows_, in, out);
    for (const auto& [in, out] : recurrent_) {
      step_.emplace_back(batch_, in, out);
      late_.emplace_back(rows_, in, out);
    }
    for (const auto& [in, out] : beside_) step_beside_.emplace_back(batch_, in, out);
  }

  double flop() const { return flop_; }

  void naive() {
    const torch::NoGradGuard guard;
    const std::size_t outside = outside_.size();
    for (std::size_t i = 0; i < outside; ++i) whole(all_[i]);
    for (int n = 0; n < kWords; ++n)
      for (auto* group : {&step_, &step_beside_})
        for (Products& p : *group) p.forward();
    for (int n = 0; n < kWords; ++n)
      for (auto* group : {&step_, &step_beside_})
        for (Products& p : *group) p.backward_input(), p.backward_weight();
  }

  void merged() {
    const torch::NoGradGuard guard;
    for (Products& p : all_) whole(p);
    for (int n = 0; n < kWords; ++n)
      for (Products& p : step_) p.forward();
    for (int n = 0; n < kWords; ++n)
      for (Products& p : step_) p.backward_input();
    for (Products& p : late_) p.backward_weight();
  }

 private:
  using Layers = std::vector<std::pair<int, int>>;
  static void chain(Layers& layers, const std::vector<int>& sizes) {
    for (std::size_t i = 0; i + 1 < sizes.size(); ++i) layers.emplace_back(sizes[i], sizes[i + 1]);
  }
  static void whole(Products& p) { p.forward(), p.backward_input(), p.backward_weight(); }

  std::int64_t rows_, batch_;
  double flop_ = 0;
  Layers outside_, recurrent_, beside_;
  std::vector<Products> all_, step_, step_beside_, late_;
};

Tensor loss(const MotionCellConfig& c, const CellOutput& out, const Tensor& x, const Tensor& target) {
  const auto quaternions = [&](const Tensor& t) {
    return t.slice(2, 0, 4 * c.joints).reshape({t.size(0), t.size(1), c.joints, 4});
  };
  const Tensor rotation = nn::geodesic_distance(quaternions(out.y), target).sum();
  return (rotation + (out.y - x).slice(2, 4 * c.joints).square().sum() + out.kl.sum()) / kBatch;
}

void print_row(const char* name, const std::vector<double>& times, const std::vector<double>& bare, double flop) {
  std::vector<double> ratio;
  for (std::size_t i = 0; i < times.size(); ++i) ratio.push_back(times[i] / bare[i]);
  const Spread t = spread(times), r = spread(ratio);
  fmt::print("{:<44} {:8.1f} ms {:8.1f} GFLOP/s   ratio {:5.2f}  ({:.2f} .. {:.2f})\n", name, 1e3 * t.median,
             flop / t.median / 1e9, r.median, r.low, r.high);
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
  for (int s = 0; s < kShards; ++s) bare.emplace_back(c, kBatch / kShards);
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
