#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "libmocap/base/random.hpp"
#include "libmodels/nn/packed_matrix.hpp"
#include "libmodels/nn/pointwise.hpp"

namespace mocap::nn {
namespace {

template <class T>
std::vector<T> noise(std::size_t count, std::uint64_t stream) {
  Random random(7, stream);
  std::vector<T> values(count);
  for (T& v : values) v = static_cast<T>(random.normal());
  return values;
}

std::vector<Isa> available() {
  std::vector<Isa> all;
  for (const Isa isa : {Isa::base, Isa::avx2, Isa::avx512})
    if (isa <= best_isa()) all.push_back(isa);
  return all;
}

// Restores the processor's own instruction set at the end of a test.
struct IsaScope {
  ~IsaScope() { limit_isa(Isa::avx512); }
};

template <class T>
void check_products(double tolerance) {
  for (const auto [rows, k, n] :
       {std::array{1, 5, 3}, {2, 64, 32}, {7, 33, 31}, {13, 96, 100}, {32, 40, 64}, {67, 17, 33}, {5, 0, 40}}) {
    const auto x = noise<T>(rows * (k + 2), 1), w = noise<T>((k + 1) * (n + 3), 2), bias = noise<T>(n, 3),
               start = noise<T>(rows * (n + 1), 4);
    for (const bool transposed : {false, true}) {
      PackedMatrix<T> packed;
      const int ld = transposed ? k + 1 : n + 3;
      packed.pack(w.data(), transposed ? 1 : ld, transposed ? ld : 1, k, n);
      for (const Isa isa : available())
        for (const Start s : {Start::zero, Start::bias, Start::accumulate}) {
          std::vector<T> y = start;
          packed.multiply_as(isa, rows, x.data(), k + 2, 1, y.data(), n + 1, s, bias.data());
          for (int r = 0; r < rows; ++r) {
            for (int j = 0; j < n; ++j) {
              double expected = s == Start::bias ? bias[j] : s == Start::accumulate ? start[r * (n + 1) + j] : T(0);
              for (int i = 0; i < k; ++i)
                expected += static_cast<double>(x[r * (k + 2) + i]) * (transposed ? w[j * ld + i] : w[i * ld + j]);
              ASSERT_NEAR(y[r * (n + 1) + j], expected, tolerance)
                  << isa_name(isa) << " " << rows << "x" << k << "x" << n;
            }
            ASSERT_EQ(y[r * (n + 1) + n], start[r * (n + 1) + n]) << "wrote past the row";
          }
        }
    }
  }
}

TEST(PackedMatrix, EqualsTheDefinition) {
  check_products<float>(2e-5);
  check_products<double>(1e-13);
}

TEST(PackedMatrix, RowsDoNotDependOnTheirNeighboursOrTheInstructionSet) {
  const int rows = 45, k = 70, n = 90;
  const auto x = noise<float>(rows * k, 1), w = noise<float>(k * n, 2);
  PackedMatrix<float> packed;
  packed.pack(w.data(), n, 1, k, n);
  for (const Isa isa : available()) {
    std::vector<float> together(rows * n), alone(n);
    packed.multiply_as(isa, rows, x.data(), k, 1, together.data(), n, Start::zero, nullptr);
    for (int r = 0; r < rows; ++r) {
      packed.multiply_as(isa, 1, x.data() + r * k, k, 1, alone.data(), n, Start::zero, nullptr);
      for (int j = 0; j < n; ++j) ASSERT_EQ(alone[j], together[r * n + j]);
    }
    if (isa == Isa::base) continue;  // rounds products on processors without a fused multiply-add
    std::vector<float> narrow(rows * n);
    packed.multiply_as(Isa::avx2, rows, x.data(), k, 1, narrow.data(), n, Start::zero, nullptr);
    EXPECT_EQ(narrow, together);
  }
}

TEST(WeightGradient, EqualsTheDefinitionAcrossSlices) {
  const int rows = 600, out = 37, in = 41;
  const auto d = noise<double>(rows * (out + 3), 1), x = noise<double>(rows * in, 2);
  std::vector<double> dw(out * in, 1.0);
  weight_gradient<double>(rows, d.data(), out + 3, out, x.data(), in, in, dw.data(), in, Start::accumulate);
  for (int o = 0; o < out; ++o)
    for (int i = 0; i < in; ++i) {
      double expected = 1;
      for (int r = 0; r < rows; ++r) expected += d[r * (out + 3) + o] * x[r * in + i];
      ASSERT_NEAR(dw[o * in + i], expected, 1e-11);
    }
}

TEST(Pointwise, FloatFunctionsAreAccurate) {
  for (float x = -90; x < 60; x += 0.0137f) {
    float y = x, sigma;
    elu(1, 1, &y, 1);
    EXPECT_NEAR(y, x > 0 ? x : std::expm1(static_cast<double>(x)), 1.2e-7 * std::max(1.0f, std::abs(x)));
    softplus(1, &x, 0.0f, &sigma);
    const double expected = std::max<double>(x, 0) + std::log1p(std::exp(-std::abs(static_cast<double>(x))));
    EXPECT_NEAR(sigma, expected, 4e-7 * expected + 1e-37);
    // One gate at a time: r and z saturated, so that h' is tanh(x); then z = sigma(x) over h = 1, n = 0.
    const float gi[3] = {60, -60, x}, gh[3] = {0, 0, 0}, h = 0.5f, gz[3] = {0, x, 0}, one = 1;
    float next;
    gru_gates<float>(1, 1, gi, gh, &h, 1, nullptr, &next, 1);
    EXPECT_NEAR(next, std::tanh(static_cast<double>(x)), 2e-7);
    gru_gates<float>(1, 1, gz, gh, &one, 1, nullptr, &next, 1);
    EXPECT_NEAR(next, 1 / (1 + std::exp(-static_cast<double>(x))), 2e-7);
  }
}

TEST(Pointwise, NotANumberStaysOne) {
  float y = NAN, sigma;
  elu(1, 1, &y, 1);
  EXPECT_TRUE(std::isnan(y));
  const float s = NAN;
  softplus(1, &s, 0.0f, &sigma);
  EXPECT_TRUE(std::isnan(sigma));
}

TEST(Pointwise, SameBitsOnEveryInstructionSet) {
  const IsaScope restore;
  const int rows = 3, hidden = 37;
  const auto gi = noise<float>(rows * 3 * hidden, 1), gh = noise<float>(rows * 3 * hidden, 2),
             h = noise<float>(rows * hidden, 3);
  std::vector<std::vector<float>> results;
  for (const Isa isa : available()) {
    limit_isa(isa);
    std::vector<float> gates(rows * 4 * hidden), next(rows * hidden), all;
    gru_gates<float>(rows, hidden, gi.data(), gh.data(), h.data(), hidden, gates.data(), next.data(), hidden);
    all.insert(all.end(), gates.begin(), gates.end());
    all.insert(all.end(), next.begin(), next.end());
    gru_gates_backward<float>(rows, hidden, gates.data(), h.data(), hidden, next.data(), hidden, gates.data());
    all.insert(all.end(), gates.begin(), gates.end());
    std::vector<float> e = gi, s(gi.size());
    elu(rows, 3 * hidden, e.data(), 3 * hidden);
    softplus<float>(static_cast<std::int64_t>(gi.size()), gi.data(), 1e-4f, s.data());
    all.insert(all.end(), e.begin(), e.end());
    all.insert(all.end(), s.begin(), s.end());
    results.push_back(all);
  }
  for (const auto& r : results) EXPECT_EQ(r, results[0]);
}

}  // namespace
}  // namespace mocap::nn
