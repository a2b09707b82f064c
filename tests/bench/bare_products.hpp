// Timing of training steps against the matrix products that they consist of.
#pragma once
#include <fmt/core.h>
#include <torch/torch.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <utility>
#include <vector>

namespace mocap::bench {

using torch::Tensor;

inline double seconds(const std::function<void()>& run) {
  const auto start = std::chrono::steady_clock::now();
  run();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

struct Spread {
  double median, low, high;
};
inline Spread spread(std::vector<double> v) {
  std::sort(v.begin(), v.end());
  return {v.size() % 2 ? v[v.size() / 2] : (v[v.size() / 2 - 1] + v[v.size() / 2]) / 2, v.front(), v.back()};
}

// Widths from layer to layer.
using Layers = std::vector<std::pair<int, int>>;
inline void chain(Layers& layers, const std::vector<int>& sizes) {
  for (std::size_t i = 0; i + 1 < sizes.size(); ++i) layers.emplace_back(sizes[i], sizes[i + 1]);
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

// Every product of one shard's training step over `steps` of time. Naive: what is outside the recurrence over all steps at once, the rest a step at a time. Merged: whatever does
// not wait for the recurrence (`beside`) over all steps at once, weight gradients too.
class BareProducts {
 public:
  BareProducts(std::int64_t batch, int steps, const Layers& outside, const Layers& recurrent, const Layers& beside = {}) : steps_(steps), outside_(outside.size()) {
    const std::int64_t rows = batch * steps;
    for (const auto* layers : {&outside, &recurrent, &beside})
      for (const auto& [in, out] : *layers) flop_ += 6.0 * in * out * static_cast<double>(rows);
    for (const auto& [in, out] : outside) all_.emplace_back(rows, in, out);
    for (const auto& [in, out] : beside) {
      all_.emplace_back(rows, in, out);
      step_beside_.emplace_back(batch, in, out);
    }
    for (const auto& [in, out] : recurrent) {
      step_.emplace_back(batch, in, out);
      late_.emplace_back(rows, in, out);
    }
  }

  double flop() const { return flop_; }

  void naive() {
    const torch::NoGradGuard guard;
    for (std::size_t i = 0; i < outside_; ++i) whole(all_[i]);
    for (int n = 0; n < steps_; ++n)
      for (auto* group : {&step_, &step_beside_})
        for (Products& p : *group) p.forward();
    for (int n = 0; n < steps_; ++n)
      for (auto* group : {&step_, &step_beside_})
        for (Products& p : *group) p.backward_input(), p.backward_weight();
  }

  void merged() {
    const torch::NoGradGuard guard;
    for (Products& p : all_) whole(p);
    for (int n = 0; n < steps_; ++n)
      for (Products& p : step_) p.forward();
    for (int n = 0; n < steps_; ++n)
      for (Products& p : step_) p.backward_input();
    for (Products& p : late_) p.backward_weight();
  }

 private:
  static void whole(Products& p) { p.forward(), p.backward_input(), p.backward_weight(); }

  int steps_;
  std::size_t outside_;
  double flop_ = 0;
  std::vector<Products> all_, step_, step_beside_, late_;
};

inline void print_row(const char* name, const std::vector<double>& times, const std::vector<double>& bare, double flop) {
  std::vector<double> ratio;
  for (std::size_t i = 0; i < times.size(); ++i) ratio.push_back(times[i] / bare[i]);
  const Spread t = spread(times), r = spread(ratio);
  fmt::print("{:<44} {:8.1f} ms {:8.1f} GFLOP/s   ratio {:5.2f}  ({:.2f} .. {:.2f})\n", name, 1e3 * t.median, flop / t.median / 1e9, r.median, r.low, r.high);
}

}  // namespace mocap::bench
