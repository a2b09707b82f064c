#include <dlfcn.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <torch/torch.h>

#include <cmath>
#include <cstring>
#include <numbers>

#include "libmocap/base/error.hpp"
#include "libmocap/skeleton/canonical_body.hpp"
#include "libmodels/nn/blas.hpp"
#include "libmodels/nn/gru.hpp"
#include "libmodels/nn/losses.hpp"
#include "libmodels/nn/mlp.hpp"
#include "libmodels/nn/sharded.hpp"
#include "tests/nn/gradient_check.hpp"

namespace mocap::nn {
namespace {

using torch::Tensor;

Tensor noise(at::IntArrayRef sizes, std::uint64_t stream) {
  Random random(3, stream);
  return normal_tensor(sizes, random).to(torch::kDouble);
}

bool same_bits(const Tensor& a, const Tensor& b) {
  return a.sizes() == b.sizes() && std::memcmp(a.contiguous().data_ptr(), b.contiguous().data_ptr(), a.nbytes()) == 0;
}

TEST(Blas, OneThread) {
  use_one_blas_thread();
  EXPECT_EQ(at::get_num_threads(), 1);
  const auto processor_seconds = [](clockid_t clock) {
    timespec t{};
    clock_gettime(clock, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
  };
  const Tensor a = torch::ones({512, 512});
  // The best of five: threads that OpenBLAS started when it was loaded spin for a moment before they sleep.
  double least = 100;
  for (int attempt = 0; attempt < 5; ++attempt) {
    const double process = processor_seconds(CLOCK_PROCESS_CPUTIME_ID), thread = processor_seconds(CLOCK_THREAD_CPUTIME_ID);
    for (int i = 0; i < 4; ++i) (void)torch::mm(a, a);
    least = std::min(least, (processor_seconds(CLOCK_PROCESS_CPUTIME_ID) - process) / (processor_seconds(CLOCK_THREAD_CPUTIME_ID) - thread));
  }
  EXPECT_LT(least, 1.3);
  EXPECT_NE(compute_libraries().find("LibTorch"), std::string::npos);
}

TEST(Blas, MoreThreadsAreRefused) {
  use_one_blas_thread();
  at::set_num_threads(2);
  EXPECT_THROW(check_one_blas_thread(), Error);
  use_one_blas_thread();
  if (auto* set = reinterpret_cast<void (*)(int)>(dlsym(RTLD_DEFAULT, "openblas_set_num_threads"))) {
    set(2);
    EXPECT_THROW(check_one_blas_thread(), Error);
  }
  use_one_blas_thread();
  EXPECT_NO_THROW(check_one_blas_thread());
}

TEST(Mlp, EqualsPlainOperations) {
  for (const bool activate_last : {true, false}) {
    Random random(1, 2);
    Mlp mlp({11, 7, 9, 5}, activate_last, random);
    mlp.to(torch::kDouble);
    const auto reference = [&](Tensor x, const std::vector<Tensor>& p) {
      for (std::size_t i = 0; i < p.size(); i += 2) {
        x = torch::addmm(p[i + 1], x, p[i].t());
        if (i + 2 < p.size() || activate_last) x = torch::elu(x);
      }
      return x;
    };
    const Tensor x = noise({6, 11}, 1).set_requires_grad(true), weight = noise({6, 5}, 2);
    std::vector<Tensor> inputs = mlp.interleaved_parameters();
    const Tensor ours = mlp.forward(x), theirs = reference(x, inputs);
    EXPECT_LT((ours - theirs).abs().max().item<double>(), 1e-13);
    inputs.push_back(x);
    const auto a = torch::autograd::grad({(ours * weight).sum()}, inputs),
               b = torch::autograd::grad({(theirs * weight).sum()}, inputs);
    for (std::size_t i = 0; i < a.size(); ++i) EXPECT_LT((a[i] - b[i]).abs().max().item<double>(), 1e-12) << i;
  }
}

TEST(Mlp, NamesSeedsAndScale) {
  Random r1(1, 2), r2(1, 2), r3(1, 3);
  Mlp a({300, 200, 100}, false, r1), b({300, 200, 100}, false, r2), c({300, 200, 100}, false, r3);
  const auto names = parameters_by_path(a);
  ASSERT_EQ(names.size(), 4u);
  EXPECT_EQ(names[0].first, "0/weight");
  EXPECT_EQ(names[3].first, "1/bias");
  EXPECT_TRUE(same_bits(a.weight(0), b.weight(0)));
  EXPECT_FALSE(same_bits(a.weight(0), c.weight(0)));
  EXPECT_NEAR(a.weight(0).std().item<double>(), std::sqrt(2.0 / 300), 0.002);
  EXPECT_NEAR(a.weight(1).std().item<double>(), 0.5 / std::sqrt(200.0), 0.001);
}

TEST(Mlp, GraphIsFreed) {
  // The tape must not own the graph that owns it: the input dies with the output.
  Random random(1, 2);
  const Mlp mlp({3, 4}, true, random);
  Tensor x = torch::ones({2, 3});
  c10::weak_intrusive_ptr<c10::TensorImpl> watched(x.getIntrusivePtr());
  {
    Tensor y = mlp.forward(x);
    x = Tensor();
    EXPECT_TRUE(y.requires_grad());
  }
  EXPECT_TRUE(watched.expired());
}

TEST(Gru, EqualsPyTorchsCell) {
  Random random(1, 2);
  GruCell ours(5, 8, random);
  ours.to(torch::kDouble);
  torch::nn::GRUCell theirs(5, 8);
  theirs->to(torch::kDouble);
  {
    const torch::NoGradGuard guard;
    theirs->weight_ih.copy_(ours.weight_ih);
    theirs->weight_hh.copy_(ours.weight_hh);
    theirs->bias_ih.copy_(ours.bias_ih);
    theirs->bias_hh.copy_(ours.bias_hh);
  }
  const Tensor x = noise({4, 5}, 1).set_requires_grad(true), h = noise({4, 8}, 2).set_requires_grad(true),
               weight = noise({4, 8}, 3);
  const Tensor a = ours.forward(x, h), b = theirs->forward(x, h);
  EXPECT_LT((a - b).abs().max().item<double>(), 1e-14);
  const auto ga =
      torch::autograd::grad({(a * weight).sum()}, {x, h, ours.weight_ih, ours.weight_hh, ours.bias_ih, ours.bias_hh});
  const auto gb = torch::autograd::grad({(b * weight).sum()},
                                        {x, h, theirs->weight_ih, theirs->weight_hh, theirs->bias_ih, theirs->bias_hh});
  for (std::size_t i = 0; i < ga.size(); ++i) EXPECT_LT((ga[i] - gb[i]).abs().max().item<double>(), 1e-13) << i;
}

Tensor unit(const Tensor& q) { return normalize_quaternions(q); }

TEST(Losses, GeodesicDistanceIsTheRotationAngle) {
  const Tensor t = unit(noise({40, 4}, 1)), q = unit(noise({40, 4}, 2));
  const Tensor expected = 2 * torch::acos((q * t).sum(-1).abs().clamp_max(1));
  EXPECT_LT((geodesic_distance(q, t) - expected).abs().max().item<double>(), 1e-7);
  EXPECT_LT((geodesic_distance(-3.5 * q, t) - expected).abs().max().item<double>(), 1e-7);
  // Small angles keep their relative accuracy, where arccos has lost all digits.
  const double angle = 1e-9;
  const Tensor near = torch::tensor({{std::cos(angle / 2), std::sin(angle / 2), 0.0, 0.0}}, torch::kDouble);
  const Tensor identity = torch::tensor({{1.0, 0.0, 0.0, 0.0}}, torch::kDouble);
  EXPECT_NEAR(geodesic_distance(near, identity).item<double>(), angle, 1e-15);
  EXPECT_NEAR(geodesic_distance(torch::tensor({{0.0, 0.0, 1.0, 0.0}}, torch::kDouble), identity).item<double>(),
              std::numbers::pi, 1e-12);
}

TEST(Losses, GeodesicGradient) {
  const Tensor t = unit(noise({10, 4}, 1)), weight = noise({10}, 3);
  const auto f = [&](const std::vector<Tensor>& in) { return (geodesic_distance(in[0], t) * weight).sum(); };
  expect_gradients(f, {noise({10, 4}, 2)}, 1e-6, 40);
  for (const double angle : {1e-3, 1e-5}) expect_gradients(f, {t + angle * noise({10, 4}, 4)}, 2e-4, 40, angle * 1e-4);
  // Finite and bounded where the angle or the quaternion vanish.
  for (const Tensor& q0 : {t, -t, torch::zeros_like(t)})
    for (const auto type : {torch::kDouble, torch::kFloat}) {
      const Tensor q = q0.to(type).clone().set_requires_grad(true);
      const Tensor g = torch::autograd::grad({geodesic_distance(q, t.to(type)).sum()}, {q})[0];
      EXPECT_TRUE(torch::isfinite(g).all().item<bool>());
      EXPECT_LE(g.norm(2, -1).max().item<double>(), 2.0001);
    }
}

TEST(Losses, OtherTermsAndTheirGradients) {
  const Tensor t = unit(noise({6, 4}, 1)), q = unit(noise({6, 4}, 2));
  const Tensor dot = (q * t).sum(-1);
  EXPECT_LT((quaternion_d2(q, t) - (1 - dot.abs())).abs().max().item<double>(), 1e-15);
  EXPECT_LT((quaternion_d3(q, t) - 2 * quaternion_d2(q, t)).abs().max().item<double>(), 1e-14);  // eq. 19
  EXPECT_LT(unit_norm_penalty(q).max().item<double>(), 1e-14);
  EXPECT_NEAR(unit_norm_penalty(torch::tensor({{2.0, 0.0, 0.0, 0.0}})).item<double>(), 3, 1e-6);
  expect_gradients(
      [&](const auto& in) {
        return (quaternion_d2(in[0], t) + quaternion_d3(in[0], t) + unit_norm_penalty(in[0])).sum();
      },
      {noise({6, 4}, 3)}, 1e-6, 24);
}

TEST(Losses, GaussianKl) {
  const Tensor mu_q = noise({4, 3}, 1), mu_p = noise({4, 3}, 2), sq = noise({4, 3}, 3).exp(),
               sp = noise({4, 3}, 4).exp();
  EXPECT_LT(gaussian_kl(mu_q, sq, mu_q, sq).abs().max().item<double>(), 1e-14);
  // The integral of q (log q - log p) over a fine grid, one dimension.
  const double m = 0.3, s = 0.7, pm = -0.5, ps = 1.4;
  const Tensor x = torch::linspace(-12, 12, 200001, torch::kDouble);
  const auto log_density = [&](double mean, double sd) {
    return -0.5 * ((x - mean) / sd).square() - std::log(sd) - 0.5 * std::log(2 * std::numbers::pi);
  };
  const double expected =
      ((log_density(m, s)).exp() * (log_density(m, s) - log_density(pm, ps))).sum().item<double>() * 24 / 200000;
  const auto one = [](double v) { return torch::full({1}, v, torch::kDouble); };
  EXPECT_NEAR(gaussian_kl(one(m), one(s), one(pm), one(ps)).item<double>(), expected, 1e-9);
  expect_gradients([](const auto& in) { return gaussian_kl(in[0], in[1], in[2], in[3]).sum(); }, {mu_q, sq, mu_p, sp},
                   1e-6, 12, 1e-5);
}

TEST(Losses, JointWeightsFallAlongTheChains) {
  const auto body = canonical_body();
  const Tensor alpha = joint_weights(*body, 0.0);
  ASSERT_EQ(alpha.numel(), body->joint_count());
  for (int j = 1; j < body->joint_count(); ++j)
    EXPECT_LT(alpha[j].item<double>(), alpha[body->parents[j]].item<double>()) << body->joint_names[j];
  EXPECT_GE(joint_weights(*body, 0.08).min().item<double>(), 0.08f);
}

struct Toy {
  std::vector<Tensor> parameters;
  Tensor x;
  explicit Toy(std::int64_t batch = 13) {
    Random random(5, 5);
    for (const auto& sizes : {std::vector<std::int64_t>{20, 9}, {9}, {9, 9}})
      parameters.push_back(normal_tensor(sizes, random).set_requires_grad(true));
    parameters.push_back(torch::ones({4}).set_requires_grad(true));  // unused
    x = normal_tensor({batch, 20}, random);
  }
  ShardedGradient::Share share(int shards, int shard) const {
    const auto [first, last] = shard_range(x.size(0), shards, shard);
    const Tensor rows = x.slice(0, first, last);
    const Tensor y = torch::tanh(torch::addmm(parameters[1], rows, parameters[0])).mm(parameters[2]);
    return {y.square().sum() / static_cast<double>(x.size(0)), {static_cast<double>(last - first), 1}};
  }
};

TEST(Sharded, SameBitsForAnyNumberOfThreads) {
  const Toy toy;
  const Tensor whole = toy.share(1, 0).loss;
  for (const int shards : {1, 2, 3, 8}) {
    std::vector<Tensor> expected;
    for (const int threads : {1, 2, 5}) {
      ShardedGradient executor(shards, threads);
      for (int repeat = 0; repeat < 20; ++repeat) {
        const auto result = executor.compute(toy.parameters, [&](int s) { return toy.share(shards, s); });
        if (expected.empty()) expected = result.gradients;
        EXPECT_NEAR(result.loss, whole.item<double>(), 1e-5);
        EXPECT_EQ(result.figures, (std::vector<double>{13, static_cast<double>(shards)}));
        for (std::size_t p = 0; p < expected.size(); ++p) ASSERT_TRUE(same_bits(result.gradients[p], expected[p]));
      }
    }
    const auto reference =
        torch::autograd::grad({toy.share(1, 0).loss}, {toy.parameters[0], toy.parameters[1], toy.parameters[2]});
    for (std::size_t p = 0; p < 3; ++p) EXPECT_LT((reference[p] - expected[p]).abs().max().item<double>(), 1e-5);
    EXPECT_EQ(expected[3].abs().sum().item<double>(), 0);
    for (const Tensor& p : toy.parameters) EXPECT_FALSE(p.grad().defined());
  }
}

TEST(Sharded, LowestFailingShardIsReportedAndWorkGoesOn) {
  const Toy toy;
  ShardedGradient executor(4, 3);
  for (int repeat = 0; repeat < 10; ++repeat) {
    try {
      (void)executor.compute(toy.parameters, [&](int s) {
        if (s >= 2) throw Error(Exit::data, {}, fmt::format("shard {}", s));
        return toy.share(4, s);
      });
      FAIL() << "no exception";
    } catch (const Error& e) {
      EXPECT_EQ(e.message(), "shard 2");
    }
    EXPECT_NEAR(executor.compute(toy.parameters, [&](int s) { return toy.share(4, s); }).loss,
                toy.share(1, 0).loss.item<double>(), 1e-5);
  }
}

TEST(Sharded, RangesCoverTheBatch) {
  for (const std::int64_t batch : {0, 1, 5, 64})
    for (const int shards : {1, 2, 7}) {
      std::int64_t next = 0;
      for (int s = 0; s < shards; ++s) {
        const auto [first, last] = shard_range(batch, shards, s);
        EXPECT_EQ(first, next);
        EXPECT_LE(std::abs((last - first) * shards - batch), shards);
        next = last;
      }
      EXPECT_EQ(next, batch);
    }
}

}  // namespace
}  // namespace mocap::nn
