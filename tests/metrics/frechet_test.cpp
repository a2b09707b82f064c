#include "libmocap/metrics/frechet.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "fixtures.hpp"
#include "libmocap/base/error.hpp"
#include "libmocap/base/random.hpp"

namespace mocap::metrics {
namespace {

using test::expected;
using test::fixture;

std::string message_of(const std::function<void()>& body) {
  try {
    body();
  } catch (const Error& e) {
    EXPECT_EQ(e.status(), Exit::data);
    return std::string(e.what()) + " | " + e.hint();
  }
  return "nothing was thrown";
}

Eigen::MatrixXd normal(Eigen::Index n, Eigen::Index d, std::uint64_t seed) {
  Random random(seed, 0);
  Eigen::MatrixXd x(n, d);
  for (double& v : x.reshaped()) v = random.normal();
  return x;
}

TEST(FrechetDistance, KnownGaussians) {
  // Commuting covariances: |m1 - m2|^2 + sum (s1 - s2)^2.
  Gaussian a{Eigen::Vector3d(1, 2, 3), Eigen::Vector3d(4, 9, 0).asDiagonal(), 0}, b{Eigen::Vector3d(1, 0, 3), Eigen::Vector3d(1, 16, 25).asDiagonal(), 0};
  EXPECT_NEAR(frechet_distance(a, b), 4 + 1 + 1 + 25, 1e-12);
  // 2 x 2: tr sqrt(S1 S2) = sqrt(tr(S1 S2) + 2 sqrt(det S1 S2)).
  Eigen::Matrix2d s1, s2;
  s1 << 2, 0.7, 0.7, 1;
  s2 << 1.5, -0.4, -0.4, 3;
  const double root = std::sqrt((s1 * s2).trace() + 2 * std::sqrt((2 - 0.49) * (4.5 - 0.16)));
  EXPECT_NEAR(frechet_distance({Eigen::Vector2d::Zero(), s1, 0}, {Eigen::Vector2d::Zero(), s2, 0}), s1.trace() + s2.trace() - 2 * root, 1e-12);
}

TEST(FrechetDistance, OfASetToItselfIsZeroAndSymmetric) {
  const auto& a = fixture("a");
  const auto& b = fixture("b");
  EXPECT_NEAR(frechet_distance(a, a), 0, 1e-12);
  EXPECT_GE(frechet_distance(a, a), 0);
  EXPECT_NEAR(frechet_distance(a, b), frechet_distance(b, a), 1e-10);
  EXPECT_EQ(frechet_distance(a, b, 1), frechet_distance(a, b, 2));
  // A shift by v adds |v|^2 and nothing else.
  Eigen::MatrixXd moved = a;
  moved.col(3).array() += 2;
  EXPECT_NEAR(frechet_distance(a, moved), 4, 1e-10);
}

TEST(FrechetDistance, AgreesWithSciPy) {
  EXPECT_NEAR(frechet_distance(fixture("a"), fixture("b")), expected("fid.pytorch-fid.full"), 1e-9);
  // With columns that are always 0 the eigenvalue form is what torch-fidelity finds; pytorch-fid's 1e-6 changes the third digit.
  Eigen::MatrixXd a = fixture("a"), b = fixture("b");
  a.col(2).setZero();
  a.col(5).setZero();
  b.col(5).setZero();
  b.col(7).setZero();
  EXPECT_NEAR(frechet_distance(a, b), expected("fid.torch-fidelity.dead"), 2e-6);
  for (const auto& [name, formula] : {std::pair{"pytorch-fid", Compat::pytorch_fid}, {"clean-fid", Compat::clean_fid}, {"torch-fidelity", Compat::torch_fidelity}, {"a2m", Compat::a2m}, {"actor", Compat::actor}}) {
    EXPECT_EQ(parse_compat(name), formula);
    EXPECT_NEAR(frechet_distance_compat(fixture("a"), fixture("b"), formula), expected(std::string("fid.") + name + ".full"), formula == Compat::pytorch_fid ? 1e-9 : 1e-7) << name;
    EXPECT_NEAR(frechet_distance_compat(a, b, formula), expected(std::string("fid.") + name + ".dead"), 1e-6) << name;
    EXPECT_NEAR(frechet_distance_compat(fixture("few_a"), fixture("few_b"), formula), expected(std::string("fid.") + name + ".few"), 1e-6) << name;
  }
  EXPECT_NE(expected("fid.pytorch-fid.dead"), expected("fid.torch-fidelity.dead"));
  EXPECT_EQ(frechet_distance_compat(fixture("a"), fixture("b"), parse_compat("none")), frechet_distance(fixture("a"), fixture("b")));
}

TEST(Gaussians, CountsAreRepeatedRows) {
  const auto& b = fixture("b");
  std::vector<int> counts(static_cast<std::size_t>(b.rows()), 1);
  counts[0] = 3;
  counts[7] = 0;
  Eigen::MatrixXd repeated(b.rows() + 1, b.cols());
  repeated << b, b.row(0);
  repeated.row(7) = b.row(0);
  const Gaussian a = gaussian(b, counts), c = gaussian(repeated);
  EXPECT_EQ(a.n, c.n);
  EXPECT_LT((a.mean - c.mean).norm() + (a.covariance - c.covariance).norm(), 1e-12);
  EXPECT_NE(message_of([&] { gaussian(b, std::vector<int>{1, 2}); }).find("2 counts for 150 clips"), std::string::npos);
  EXPECT_NE(message_of([&] { gaussian(b, std::vector<int>(150, 0)); }).find("0 clips"), std::string::npos);
}

TEST(FrechetDistance, Refuses) {
  EXPECT_NE(message_of([] { frechet_distance(fixture("few_a"), fixture("few_b")); }).find("12 clips with 16 features, expected more clips than features | a covariance"), std::string::npos);
  EXPECT_NE(message_of([] { frechet_distance(fixture("a"), fixture("few_b")); }).find("features of 8 and of 16"), std::string::npos);
  EXPECT_NE(message_of([] { frechet_distance(Eigen::MatrixXd(fixture("a").topRows(8)), fixture("b")); }).find("8 clips with 8 features"), std::string::npos);
  EXPECT_EQ(message_of([] { frechet_distance(Eigen::MatrixXd(fixture("a").topRows(9)), fixture("b")); }), "nothing was thrown");
  for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity()}) {
    Eigen::MatrixXd x = fixture("a");
    x(4, 2) = bad;
    EXPECT_NE(message_of([&] { gaussian(x, "real"); }).find("real: row 5, column 3 is"), std::string::npos);
    EXPECT_NE(message_of([&] { frechet_distance(x, fixture("b"), 2); }).find("row 5"), std::string::npos);
  }
  EXPECT_NE(message_of([] { gaussian(Eigen::MatrixXd::Zero(1, 2)); }).find("1 clips, expected at least two"), std::string::npos);
  EXPECT_THROW(parse_compat("fid"), Error);
}

TEST(Pca, KeepsTheLargestAxes) {
  const auto pca = fit_pca(fixture("b"), 4);
  EXPECT_NEAR(pca.kept, expected("pca.kept"), 1e-12);
  EXPECT_LT((pca.axes.transpose() * pca.axes - Eigen::Matrix4d::Identity()).norm(), 1e-12);
  EXPECT_NEAR(frechet_distance(project(pca, fixture("a")), project(pca, fixture("b"))), expected("fid.pca"), 1e-9);
  EXPECT_GT(pca.variance[0], pca.variance[3]);
  const auto all = fit_pca(fixture("b"), 8);
  EXPECT_NEAR(frechet_distance(project(all, fixture("a")), project(all, fixture("b"))), frechet_distance(fixture("a"), fixture("b")), 1e-9);
  EXPECT_NE(message_of([] { fit_pca(fixture("b"), 9); }).find("expected at most 8"), std::string::npos);
  EXPECT_NE(message_of([] { fit_pca(fixture("few_b"), 14); }).find("expected at most 13"), std::string::npos);
  EXPECT_NE(message_of([&] { project(pca, fixture("few_a")); }).find("expected 8"), std::string::npos);
}

TEST(FrechetDistance, TendsToZeroForSamplesOfOneDistribution) {
  const double small = frechet_distance(normal(200, 6, 1), normal(200, 6, 2)), large = frechet_distance(normal(20000, 6, 3), normal(20000, 6, 4));
  EXPECT_LT(large, 0.01);
  EXPECT_GT(small, 5 * large);
}

}  // namespace
}  // namespace mocap::metrics
