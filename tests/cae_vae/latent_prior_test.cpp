#include "libmodels/cae_vae/latent_prior.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "libmocap/base/error.hpp"

namespace mocap::cae_vae {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// Two clumps, one of them slanted and three times as heavy.
LatentPrior two() {
  LatentPrior p{VectorXd(2), MatrixXd(2, 2), {MatrixXd(2, 2), MatrixXd(2, 2)}};
  p.weight << 0.75, 0.25;
  p.mean << 2, -3,
            1, 0;
  p.root[0] << 1, 0,
               0.8, 0.5;
  p.root[1] << 0.4, 0,
               0, 0.6;
  return p;
}

MatrixXd drawn(const LatentPrior& p, int count, std::uint64_t seed, double scale = 1) {
  Random random(seed, 1);
  MatrixXd z(p.mean.rows(), count);
  for (int n = 0; n < count; ++n) z.col(n) = p.draw(random, scale);
  return z;
}

TEST(LatentPrior, DrawsHaveItsMoments) {
  const LatentPrior p = two();
  const MatrixXd z = drawn(p, 40000, 1);
  const VectorXd mean = z.rowwise().mean(), expected = p.mean * p.weight;
  EXPECT_LT((mean - expected).norm(), 0.05);
  MatrixXd covariance = MatrixXd::Zero(2, 2);
  for (int k = 0; k < 2; ++k) covariance += p.weight[k] * (p.root[static_cast<std::size_t>(k)] * p.root[static_cast<std::size_t>(k)].transpose() + (p.mean.col(k) - expected) * (p.mean.col(k) - expected).transpose());
  const MatrixXd apart = z.colwise() - mean;
  EXPECT_LT((apart * apart.transpose() / 40000 - covariance).norm(), 0.1);
  const MatrixXd still = drawn(p, 100, 2, 0);
  for (int n = 0; n < 100; ++n) EXPECT_LT(std::min((still.col(n) - p.mean.col(0)).norm(), (still.col(n) - p.mean.col(1)).norm()), 1e-12);
}

TEST(LatentPrior, IsFoundAgainFromDraws) {
  const LatentPrior p = two();
  const MatrixXd z = drawn(p, 4000, 3), none = MatrixXd::Zero(2, 4000);
  const LatentPrior found = fit_latent_prior(z, none, 2, 7);
  ASSERT_EQ(found.components(), 2);
  const int heavy = found.weight[0] > 0.5 ? 0 : 1;
  EXPECT_NEAR(found.weight[heavy], 0.75, 0.02);
  EXPECT_LT((found.mean.col(heavy) - p.mean.col(0)).norm(), 0.08);
  EXPECT_LT((found.mean.col(1 - heavy) - p.mean.col(1)).norm(), 0.08);
  EXPECT_LT((found.root[static_cast<std::size_t>(heavy)] - p.root[0]).norm(), 0.1);
  const MatrixXd unseen = drawn(p, 4000, 4);
  EXPECT_NEAR(found.log_likelihood(unseen), p.log_likelihood(unseen), 0.02);
  EXPECT_GT(found.log_likelihood(unseen), fit_latent_prior(z, none, 1, 7).log_likelihood(unseen) + 0.3);
  EXPECT_EQ(fit_latent_prior(z, none, 2, 7).mean, found.mean);
}

// By hand for one component: N(mean, covariance + mean variance).
TEST(LatentPrior, TakesInWhatThePosteriorsDoNotKnow) {
  MatrixXd z(1, 20), v(1, 20);
  for (int n = 0; n < 20; ++n) z(0, n) = n, v(0, n) = 2 + n % 2;
  const LatentPrior p = fit_latent_prior(z, v, 16, 1);
  ASSERT_EQ(p.components(), 2);  // ten windows each
  const LatentPrior one = fit_latent_prior(z, v, 1, 1);
  EXPECT_NEAR(one.mean(0, 0), 9.5, 1e-9);
  EXPECT_NEAR(one.root[0](0, 0), std::sqrt((20.0 * 20 - 1) / 12 + 2.5 + 1e-4), 1e-9);
  EXPECT_NEAR(one.log_likelihood(MatrixXd::Constant(1, 1, 9.5)), -0.5 * std::log(2 * std::numbers::pi) - std::log(one.root[0](0, 0)), 1e-9);
}

TEST(LatentPrior, WindowsThatAreAllAlikeGiveADistribution) {
  const LatentPrior p = fit_latent_prior(MatrixXd::Constant(3, 40, 1.5), MatrixXd::Zero(3, 40), 4, 1);
  EXPECT_TRUE(p.mean.allFinite());
  EXPECT_NEAR(p.weight.sum(), 1, 1e-12);
  EXPECT_LT((drawn(p, 50, 1).array() - 1.5).abs().maxCoeff(), 0.1);
  EXPECT_THROW((void)fit_latent_prior(MatrixXd(3, 0), MatrixXd(3, 0), 4, 1), Error);
}

TEST(LatentPrior, GoesThroughAModelFile) {
  const LatentPrior p = two();
  auto weights = stored(p);
  weights["cae/encoder_bias"] = {{1}, {0}};
  const LatentPrior back = take_latent_prior(weights, 2, "m.h5");
  EXPECT_EQ(weights.size(), 1u);
  EXPECT_LT((back.mean - p.mean).norm() + (back.root[0] - p.root[0]).norm() + (back.root[1] - p.root[1]).norm() + (back.weight - p.weight).norm(), 1e-6);
}

}  // namespace
}  // namespace mocap::cae_vae
