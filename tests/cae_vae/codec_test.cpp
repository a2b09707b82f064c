#include "libmodels/cae_vae/codec.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "libmodels/nn/mlp.hpp"
#include "tests/cae_vae/data.hpp"

namespace mocap::cae_vae {
namespace {

using torch::Tensor;

const Network& network() {
  static const std::unique_ptr<Network> n = [] {
    const torch::NoGradGuard no_grad;
    auto made = std::make_unique<Network>(tiny(2), 4);
    Random random(2, 2);
    made->scale_mean.copy_(nn::normal_tensor({8}, random));
    made->scale_deviation.copy_(nn::normal_tensor({8}, random).abs() + 0.2);
    for (auto& p : made->vae->parameters()) p.add_(nn::normal_tensor(p.sizes(), random) * 0.1);
    return made;
  }();
  return *n;
}

double difference(const std::vector<float>& a, const std::vector<float>& b) {
  double most = 0;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) most = std::max(most, std::abs(static_cast<double>(a[i] - b[i])));
  return a.size() == b.size() ? most : std::numeric_limits<double>::infinity();
}

TEST(CaeVaeDecoder, IsTheNetworksAndDoesNotLookAtOtherWindows) {
  const torch::NoGradGuard no_grad;
  Random random(1, 7);
  const Tensor z = nn::normal_tensor({70, 4}, random);
  const Tensor expected = network().cae->decode(network().restored(network().vae->mean(z))).contiguous();
  const Decoder decoder(network());
  std::vector<float> all(static_cast<std::size_t>(expected.numel())), one(20 * 58);
  decoder(z.data_ptr<float>(), 70, all.data());
  EXPECT_LT(difference(all, {expected.data_ptr<float>(), expected.data_ptr<float>() + expected.numel()}), 1e-4);
  EXPECT_GT(expected.abs().max().item<double>(), 0.5);
  for (const std::int64_t i : {0, 63, 64, 69}) {
    decoder(z.data_ptr<float>() + 4 * i, 1, one.data());
    EXPECT_EQ(one, std::vector<float>(all.begin() + i * 20 * 58, all.begin() + (i + 1) * 20 * 58)) << i;
  }
}

TEST(CaeVaeCodec, ClipsDependOnTheirStreamAlone) {
  const Codec codec(network());
  std::vector<ClipRequest> requests;
  for (std::uint64_t i = 0; i < 70; ++i) requests.push_back({5, i, i % 3 == 0 ? 47 : 20 - static_cast<std::int64_t>(i % 2), {}});
  const auto clips = codec.sample(requests, {nullptr, 1}, 1), again = codec.sample(requests, {nullptr, 1}, 3);
  EXPECT_EQ(clips, again);
  for (const std::size_t i : {0u, 1u, 66u, 69u}) {
    EXPECT_EQ(codec.sample({requests[i]}, {nullptr, 1}, 1)[0], clips[i]);
    EXPECT_EQ(clips[i].size(), static_cast<std::size_t>(requests[i].frames) * 58);
  }
  EXPECT_NE(codec.sample({{6, 1, 20, {}}}, {nullptr, 1}, 1)[0], clips[1]);
  const std::vector<float> x = codec.sample({{5, 1, 20, codec.draw(5, 1, {})}}, {nullptr, 1}, 1)[0];
  EXPECT_EQ(std::vector<float>(x.begin(), x.begin() + 19 * 58), clips[1]);  // the latent that is drawn
  EXPECT_EQ(codec.sample({{5, 1, 20, {}}}, {nullptr, 0}, 1), codec.sample({{9, 4, 20, {}}}, {nullptr, 0}, 1));
}

TEST(CaeVaeCodec, LongMotionBeginsWithItsWindowAndHasNoSeams) {
  const Codec codec(network());
  const auto window = codec.sample({{5, 3, 20, {}}}, {nullptr, 1}, 1)[0], motion = codec.sample({{5, 3, 200, {}}}, {nullptr, 1}, 1)[0];
  EXPECT_EQ(std::vector<float>(motion.begin(), motion.begin() + 10 * 58), std::vector<float>(window.begin(), window.begin() + 10 * 58));
  // Steps between frames are no larger where windows meet (every 10 frames) than within one.
  const auto step = [](const std::vector<float>& x, std::size_t t) {
    double sum = 0;
    for (std::size_t c = 0; c < 58; ++c) sum += std::pow(static_cast<double>(x[t * 58 + c] - x[(t - 1) * 58 + c]), 2);
    return std::sqrt(sum);
  };
  double within = 0, at_seams = 0;
  for (std::size_t t = 1; t < 20; ++t) within = std::max(within, step(window, t));
  for (std::size_t t = 10; t < 200; t += 10) at_seams = std::max(at_seams, step(motion, t));
  EXPECT_LT(at_seams, 1.5 * within);
}

TEST(CaeVaeCodec, ReconstructsAnyLengthWindowByWindow) {
  const torch::NoGradGuard no_grad;
  const Codec codec(network());
  Random random(1, 9);
  const Tensor x = nn::normal_tensor({53, 58}, random);
  const std::vector<float> back = codec.reconstruct(x.data_ptr<float>(), 53);
  ASSERT_EQ(back.size(), 53u * 58);
  const auto alone = [&](std::int64_t first) { return codec.sample({{1, 1, 20, codec.encode(x.data_ptr<float>() + first * 58)}}, {nullptr, 1}, 1)[0]; };
  const auto rows = [](const std::vector<float>& v, std::int64_t from, std::int64_t to) { return std::vector<float>(v.begin() + from * 58, v.begin() + to * 58); };
  EXPECT_EQ(rows(back, 0, 10), rows(alone(0), 0, 10));
  EXPECT_EQ(rows(back, 50, 53), rows(alone(33), 17, 20));  // the last window ends with the motion
  EXPECT_EQ(codec.reconstruct(x.data_ptr<float>(), 20), alone(0));
  EXPECT_THROW((void)codec.reconstruct(x.data_ptr<float>(), 19), Error);
  const Tensor first = network().cae->decode(network().cae->encode(x.narrow(0, 0, 20).unsqueeze(0))).contiguous();
  EXPECT_EQ(codec.reconstruct(x.data_ptr<float>(), 20, false), std::vector<float>(first.data_ptr<float>(), first.data_ptr<float>() + first.numel()));
  const Tensor z = network().vae->posterior(network().standardised(network().cae->encode(x.narrow(0, 3, 20).unsqueeze(0)))).mean;
  const Latent latent = codec.encode(x.data_ptr<float>() + 3 * 58);
  for (std::size_t k = 0; k < 4; ++k) EXPECT_NEAR(latent[k], z[0][static_cast<std::int64_t>(k)].item<float>(), 1e-5);
}

}  // namespace
}  // namespace mocap::cae_vae
