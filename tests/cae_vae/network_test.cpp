#include "libmodels/cae_vae/network.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "libmocap/base/error.hpp"
#include "libmodels/nn/mlp.hpp"
#include "tests/cae_vae/data.hpp"

namespace mocap::cae_vae {
namespace {

using mocap::testing::refusal;
using torch::Tensor;

struct OneThread : ::testing::Environment {
  void SetUp() override { nn::use_one_blas_thread(); }
};
const auto* const kEnvironment = ::testing::AddGlobalTestEnvironment(new OneThread);

Tensor normal(at::IntArrayRef sizes, std::uint64_t stream = 1) {
  Random random(3, stream);
  return nn::normal_tensor(sizes, random);
}

// Section III by loops: what conv1d, max_pool1d and the rest add up to.
TEST(CaeVaeNetwork, EncodesAndDecodesAsThePaperSays) {
  const torch::NoGradGuard no_grad;
  CaeVaeConfig c = tiny();
  c.upsampling = Upsampling::nearest;
  const Network network(c, 1);
  const Tensor x = normal({2, 20, 58}), y = network.cae->encode(x), back = network.cae->decode(y);
  ASSERT_EQ(y.sizes(), at::IntArrayRef({2, 8, 10}));
  ASSERT_EQ(back.sizes(), at::IntArrayRef({2, 20, 58}));
  const auto weights = network.cae->named_parameters();
  const Tensor w = weights["encoder_weight"], v = weights["decoder_weight"], a = weights["decoder_bias"];
  const auto convolved = [&](const Tensor& rows, const Tensor& kernel, int filter, int t) {  // rows (T, C)
    double sum = 0;
    for (int k = 0; k < 5; ++k)
      if (const int at = t + k - 2; at >= 0 && at < 20) sum += (kernel[filter].select(1, k) * rows[at]).sum().item<double>();
    return sum;
  };
  for (const int f : {0, 3, 7})
    for (const int t : {0, 4, 9}) EXPECT_NEAR(y[1][f][t].item<double>(), std::max({0.0, convolved(x[1], w, f, 2 * t), convolved(x[1], w, f, 2 * t + 1)}), 1e-4);
  const Tensor up = y[1].repeat_interleave(2, 1).transpose(0, 1);
  for (const int column : {0, 20, 57})
    for (const int t : {0, 7, 19}) EXPECT_NEAR(back[1][t][column].item<double>(), a[column].item<double>() + convolved(up, v, column, t), 1e-4);
}

// What is linear over the pooled frames is linear over all of them, but for the ends.
TEST(CaeVaeNetwork, LinearUpsamplingLiesBetween) {
  const torch::NoGradGuard no_grad;
  CaeVaeConfig c = tiny();
  c.kernel = 1;
  const Network network(c, 1);
  auto weights = network.cae->named_parameters();
  weights["decoder_weight"].zero_();
  weights["decoder_weight"][5][2][0] = 1;
  Tensor y = torch::zeros({1, 8, 10});
  for (int i = 0; i < 10; ++i) y[0][2][i] = 2 * i + 0.5;  // the middle of frames 2 i and 2 i + 1
  const Tensor x = network.cae->decode(y);
  for (int t = 1; t < 19; ++t) EXPECT_NEAR(x[0][t][5].item<double>(), t, 1e-5);
  EXPECT_NEAR(x[0][0][5].item<double>(), 0.5, 1e-5);
  EXPECT_NEAR(x[0][19][5].item<double>(), 18.5, 1e-5);
}

TEST(CaeVaeNetwork, SeparateFiltersKeepRootAndPoseApart) {
  const torch::NoGradGuard no_grad;
  const Network network(tiny(3), 1);
  Tensor x = normal({1, 20, 58}), other = x.clone();
  other.narrow(2, 55, 3) += 1;  // root velocities
  const Tensor y = network.cae->encode(x), z = network.cae->encode(other);
  EXPECT_TRUE(torch::equal(y.narrow(1, 0, 5), z.narrow(1, 0, 5)));
  EXPECT_FALSE(torch::equal(y.narrow(1, 5, 3), z.narrow(1, 5, 3)));
  const Tensor a = network.cae->decode(y), b = network.cae->decode(z);
  CaeVaeConfig twice = tiny(3);
  twice.upsampling = Upsampling::nearest;
  const Network nearest(twice, 1);
  EXPECT_TRUE(torch::equal(a.narrow(2, 0, 55), b.narrow(2, 0, 55)));
  EXPECT_FALSE(torch::equal(a.narrow(2, 55, 3), b.narrow(2, 55, 3)));
  EXPECT_TRUE(torch::allclose(torch::conv1d(y.repeat_interleave(2, 2), network.cae->decoder_kernel(), network.cae->decoder_bias(), 1, 2).transpose(1, 2), nearest.cae->decode(y), 1e-5, 1e-5));
}

TEST(CaeVaeNetwork, NamesAndCountsOfWeights) {
  for (const int root : {0, 3}) {
    const Network network(tiny(root), 1);
    std::int64_t count = 0;
    for (const auto& [name, tensor] : nn::parameters_by_path(network)) count += tensor.numel();
    EXPECT_EQ(count, tiny(root).parameter_count());
  }
  CaeVaeConfig paper;
  EXPECT_EQ(paper.features(), 1920);
  EXPECT_EQ(paper.parameter_count(), 2 * 32 * 58 * 15 + 32 + 58 + 64 + 1921 * 256 + 257 * 64 + 33 * 256 + 257 * 3840);
  EXPECT_EQ(nn::parameters_by_path(Network(tiny(), 1))[0].first, "scale_mean");  // CaeVaeTraining counts on it
}

// Against numerical integration over one value and by sampling over none: the formulas, not their signs as printed.
TEST(CaeVaeNetwork, LikelihoodAndDivergenceAreThoseOfGaussians) {
  const double mu = 0.7, deviation = 0.4, y = 1.1;
  const Gaussian g{torch::tensor({{mu}}), torch::tensor({{2 * std::log(deviation)}})};
  const auto density = [](double x, double m, double s) { return std::exp(-0.5 * std::pow((x - m) / s, 2)) / (s * std::sqrt(2 * M_PI)); };
  EXPECT_NEAR(negative_log_likelihood(g, torch::tensor({{y}})).item<double>(), -std::log(density(y, mu, deviation)), 1e-6);
  double kl = 0;
  for (double x = -8; x < 8; x += 1e-4)
    if (const double q = density(x, mu, deviation); q > 1e-300) kl += 1e-4 * q * std::log(q / density(x, 0, 1));
  EXPECT_NEAR(kl_divergence(g).item<double>(), kl, 1e-5);
  EXPECT_GT(kl, 0.5);
}

TEST(CaeVaeNetwork, VariancesHaveAFloor) {
  const Gaussian g{torch::tensor({{0.5}}), torch::tensor({{-80.0}})}, wide{torch::tensor({{0.5}}), torch::tensor({{std::log(0.04)}})};
  EXPECT_NEAR(negative_log_likelihood(g, torch::tensor({{0.8}}), 0.04).item<double>(), negative_log_likelihood(wide, torch::tensor({{0.8}})).item<double>(), 1e-5);
}

TEST(CaeVaeNetwork, UnitsBetweenTheStagesInvert) {
  const torch::NoGradGuard no_grad;
  const Network network(tiny(), 1);
  network.scale_mean.copy_(normal({8}, 5));
  network.scale_deviation.copy_(normal({8}, 6).abs() + 0.1);
  const Tensor y = normal({2, 8, 10}), s = network.standardised(y);
  EXPECT_EQ(s.sizes(), at::IntArrayRef({2, 80}));
  EXPECT_NEAR(s[1][3 * 10 + 4].item<double>(), ((y[1][3][4] - network.scale_mean[3]) / network.scale_deviation[3]).item<double>(), 1e-6);
  EXPECT_TRUE(torch::allclose(network.restored(s), y, 1e-5, 1e-5));
}

TEST(CaeVaeConfig, GoesThroughJsonAndRefusesWhatCannotBe) {
  const CaeVaeConfig c = tiny(2);
  EXPECT_EQ(config_from_json(to_json(c)), c);
  const auto with = [&](const char* key, nlohmann::json value) {
    auto json = to_json(c);
    json[key] = std::move(value);
    return refusal([&] { (void)config_from_json(json); });
  };
  EXPECT_NE(with("window", 21).find("even"), std::string::npos);
  EXPECT_NE(with("kernel", 4).find("odd"), std::string::npos);
  EXPECT_NE(with("kernel", 21).find("within the window"), std::string::npos);
  EXPECT_NE(with("root_filters", 8).find("fewer than"), std::string::npos);
  EXPECT_NE(with("hidden", 0).find("hidden is 0"), std::string::npos);
  EXPECT_NE(with("upsampling", "cubic").find("upsampling"), std::string::npos);
  EXPECT_NE(with("latent", 1e9).find("latent"), std::string::npos);
  EXPECT_NE(with("latent", nlohmann::json::array()).find("latent is array"), std::string::npos);
  EXPECT_NE(refusal([] { (void)config_from_json(nlohmann::json::object()); }).find("no window"), std::string::npos);
  CaeVaeConfig large = c;
  large.window = large.hidden = large.filters = 4096;
  EXPECT_NE(refusal([&] { large.validate(); }).find("weights"), std::string::npos);
  EXPECT_EQ(text(parse_root_filters("separate")), "separate");
  EXPECT_THROW(parse_root_filters("both"), Error);
}

}  // namespace
}  // namespace mocap::cae_vae
