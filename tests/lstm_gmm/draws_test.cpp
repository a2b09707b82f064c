// Motion from numbers that are given instead of drawn, and behind frames that are given.
#include <gtest/gtest.h>

#include <cmath>

#include "libmocap/base/error.hpp"
#include "libmocap/base/random.hpp"
#include "libmodels/lstm_gmm/sampler.hpp"

namespace mocap::lstm_gmm {
namespace {

using torch::Tensor;

LstmGmmConfig tiny() {
  LstmGmmConfig c;
  c.features = 6;
  c.hidden = 8;
  c.width = 7;
  c.mixtures = 3;
  return c;
}

std::vector<float> numbers(std::size_t count, std::uint64_t stream) {
  Random random(4, stream);
  std::vector<float> out(count);
  for (float& v : out) v = static_cast<float>(random.normal());
  return out;
}

ClipRequest request(std::int64_t frames) {
  ClipRequest r{1, 1, frames, numbers(6, 1), numbers(32, 2)};
  r.first.insert(r.first.end(), {1.0f, 0.0f});
  return r;
}

TEST(Draws, TakeTheStreamsPlace) {
  const Sampler sampler(Network(tiny(), 4));
  ClipRequest a = request(6), b = request(6);
  a.draws = b.draws = numbers(5 * 7, 3);
  b.seed = 77;  // has no say
  b.stream = 5;
  const auto clips = sampler.sample({a, b});
  EXPECT_EQ(clips[0], clips[1]);
  EXPECT_NE(clips[0], sampler.sample({request(6)})[0]);
  b.draws = numbers(5 * 7, 4);
  EXPECT_NE(clips[0], sampler.sample({b})[0]);
  b.draws = a.draws;
  b.draws.back() += 1;  // of the last frame: all before it stay
  const auto other = sampler.sample({b})[0];
  EXPECT_TRUE(std::equal(other.begin(), other.begin() + 5 * 8, clips[0].begin()));
  EXPECT_NE(other[5 * 8 + 5], clips[0][5 * 8 + 5]);
}

// The first number of a frame chooses the component by its distribution function, the others are deviations of its features.
TEST(Draws, ChooseAComponentAndAPointOfIt) {
  const Network network(tiny(), 4);
  const Sampler sampler(network);
  const torch::NoGradGuard no_grad;
  const ClipRequest r = request(2);
  const Tensor x = torch::tensor(r.first).view({1, 8});
  const Mixture m = network.mixture(network.forward(x, torch::tensor(r.state).view({1, 32})).y, x);
  std::vector<int> seen(3);
  for (double u = 0.02; u < 1; u += 0.04) {
    double z = 0;  // where the normal distribution function is u, by bisection
    for (double low = -8, high = 8; high - low > 1e-9; (0.5 * std::erfc(-z / std::sqrt(2.0)) < u ? low : high) = z) z = (low + high) / 2;
    std::int64_t component = 0;
    for (double sum = std::exp(m.log_weights[0][0].item<double>()); component < 2 && u > sum; sum += std::exp(m.log_weights[0][component].item<double>())) ++component;
    ++seen[static_cast<std::size_t>(component)];
    ClipRequest given = r;
    given.draws = std::vector<float>(7, 0.0f);
    given.draws[0] = static_cast<float>(z);
    const auto mean = sampler.sample({given})[0];
    for (std::int64_t k = 0; k < 6; ++k) EXPECT_NEAR(mean[8 + static_cast<std::size_t>(k)], m.means[0][component][k].item<float>(), 1e-5) << u;
    given.draws[3] = -1.5f;
    const auto moved = sampler.sample({given})[0];
    EXPECT_NEAR(moved[8 + 2] - mean[8 + 2], -1.5 * std::exp(m.log_sigmas[0][component][2].item<double>()), 1e-5);
    EXPECT_EQ(moved[8 + 3], mean[8 + 3]);
  }
  for (const int count : seen) EXPECT_GT(count, 0);
}

TEST(Draws, GivenFramesAreSeenAndGoneOnFrom) {
  const Network network(tiny(), 4);
  const Sampler sampler(network);
  const torch::NoGradGuard no_grad;
  ClipRequest r = request(6);
  r.draws = numbers(5 * 7, 3);
  r.given = numbers(3 * 8, 5);
  for (const std::size_t at : {6, 7, 14, 15, 22, 23}) r.given[at] = at % 2 ? 1.0f : 0.0f;
  const auto clip = sampler.sample({r})[0];
  for (std::size_t i = 0; i < r.given.size(); ++i) EXPECT_EQ(clip[8 + i], r.given[i]);
  // Frame 4 by the network run over the frames before it.
  Tensor state = torch::tensor(r.state).view({1, 32}), x;
  Mixture m;
  for (int t = 0; t < 4; ++t) {
    x = torch::tensor(std::vector<float>(clip.begin() + 8 * t, clip.begin() + 8 * (t + 1))).view({1, 8});
    const auto out = network.forward(x, state);
    state = out.state;
    m = network.mixture(out.y, x);
  }
  double nearest = 1e9;
  for (std::int64_t c = 0; c < 3; ++c) {
    double off = 0;
    for (std::int64_t k = 0; k < 6; ++k) off += std::abs(clip[4 * 8 + static_cast<std::size_t>(k)] - (m.means[0][c][k].item<double>() + m.log_sigmas[0][c][k].exp().item<double>() * static_cast<double>(r.draws[static_cast<std::size_t>(3 * 7 + 1 + k)])));
    nearest = std::min(nearest, off);
  }
  EXPECT_LT(nearest, 1e-4);
  for (std::int64_t k = 0; k < 2; ++k) EXPECT_EQ(clip[4 * 8 + 6 + static_cast<std::size_t>(k)], m.contact_logits[0][k].item<float>() > 0 ? 1 : 0);
  // All of them given, and more than are asked for.
  r.given = numbers(9 * 8, 6);
  const auto all = sampler.sample({r})[0];
  EXPECT_TRUE(std::equal(all.begin() + 8, all.end(), r.given.begin()));
  // Beside others of other lengths each is as it is alone.
  std::vector<ClipRequest> many = {request(3), r, request(9)};
  many[0].draws = numbers(2 * 7, 8);
  many[2].given = numbers(8, 9);
  const auto together = sampler.sample(many, {2, 3, 1, 0});
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(together[i], sampler.sample({many[i]})[0]) << i;
}

TEST(Draws, OtherSizesAreRefused) {
  const Sampler sampler(Network(tiny(), 4));
  const auto status = [&](const std::function<void(ClipRequest&)>& change) {
    ClipRequest r = request(4);
    change(r);
    try {
      (void)sampler.sample({r});
    } catch (const Error& e) {
      return e.status();
    }
    return Exit::ok;
  };
  EXPECT_EQ(status([](auto& r) { r.draws.assign(3 * 7, 0.0f); }), Exit::ok);
  EXPECT_EQ(status([](auto& r) { r.draws.assign(3 * 7 - 1, 0.0f); }), Exit::internal);
  EXPECT_EQ(status([](auto& r) { r.draws.assign(4 * 7, 0.0f); }), Exit::internal);
  EXPECT_EQ(status([](auto& r) { r.given.assign(8, 0.0f); }), Exit::ok);
  EXPECT_EQ(status([](auto& r) { r.given.assign(9, 0.0f); }), Exit::internal);
}

}  // namespace
}  // namespace mocap::lstm_gmm
