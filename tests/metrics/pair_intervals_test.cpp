// The intervals of figures that are means over pairs of clips: against the truth of Gaussians, and of a jackknife done the long way.
#include <gtest/gtest.h>

#include <cmath>

#include "libmocap/base/error.hpp"
#include "libmocap/base/random.hpp"
#include "libmocap/metrics/sample_figures.hpp"

namespace mocap::metrics {
namespace {

Eigen::MatrixXd gauss(Eigen::Index n, Eigen::Index d, double deviation, std::uint64_t seed) {
  Random random(seed, 0x7e57);
  Eigen::MatrixXd x(n, d);
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < d; ++j) x(i, j) = random.normal(0, deviation);
  return x;
}

constexpr int kRepeats = 100, kFewest = 88;  // of 95 expected: below 88 with probability 0.004
constexpr Eigen::Index kN = 60, kD = 6;
constexpr double kDeviation = 1.5;

// E|x - x'| of N(0, s^2 I): a chi distribution of d degrees, scaled by s sqrt 2.
double mean_distance(double s) { return 2 * s * std::exp(std::lgamma((kD + 1) / 2.0) - std::lgamma(kD / 2.0)); }

template <class F>
int covered(double truth, F&& interval) {
  int count = 0;
  for (int r = 0; r < kRepeats; ++r) {
    const Interval i = interval(static_cast<std::uint64_t>(r));
    EXPECT_LT(i.low, i.value);
    EXPECT_GT(i.high, i.value);
    count += i.low <= truth && truth <= i.high;
  }
  return count;
}

TEST(PairIntervals, KidCoversTheTruth) {
  const Eigen::MatrixXd y = gauss(90, kD, 1, 1000);
  KidOptions o;
  o.subsets = 20;
  o.subset = 50;  // of both sets only a part is drawn
  // E k(x,x') = 1 + 3 s^4/d and E k(x,y) = 1 + 3 s^2 |y|^2/d^2, for x and x' of N(0, s^2 I): odd powers vanish.
  double own = 0;
  for (Eigen::Index i = 0; i < y.rows(); ++i)
    for (Eigen::Index j = 0; j < y.rows(); ++j)
      if (i != j) own += std::pow(y.row(i).dot(y.row(j)) / kD + 1, 3);
  own /= static_cast<double>(y.rows() * (y.rows() - 1));
  const double s2 = kDeviation * kDeviation;
  const double truth = 1 + 3 * s2 * s2 / kD + own - 2 * (1 + 3 * s2 * y.rowwise().squaredNorm().mean() / (kD * kD));
  const int count = covered(truth, [&](std::uint64_t r) {
    const Eigen::MatrixXd x = gauss(kN, kD, kDeviation, r);
    return kid_interval(x, y, kid(x, y, o), o);
  });
  RecordProperty("covered", count);
  EXPECT_GE(count, kFewest);
}

TEST(PairIntervals, DiversityCoversTheTruth) {
  for (const int pairs : {20, 200, 5000}) {  // fewer pairs than clips, and far more: neither source of error may be forgotten
    const int count = covered(mean_distance(kDeviation), [&](std::uint64_t r) {
      const Eigen::MatrixXd x = gauss(kN, kD, kDeviation, r);
      return diversity_interval(diversity(x, pairs, r), x, pairs);
    });
    RecordProperty("covered." + std::to_string(pairs), count);
    EXPECT_GE(count, kFewest) << pairs;
  }
}

TEST(PairIntervals, FiguresWithinClassesCoverTheTruth) {
  const std::vector<std::string> classes = {"a", "b", "c"};
  std::vector<int> labels;
  for (Eigen::Index i = 0; i < kN; ++i) labels.push_back(static_cast<int>(i % 3));
  const auto clips = [&](std::uint64_t r) {
    Eigen::MatrixXd x = gauss(kN, kD, 1, r);
    for (Eigen::Index i = 0; i < kN; ++i) x.row(i) = (x.row(i) * (1.0 + static_cast<double>(i % 3))).array() + static_cast<double>(40 * (i % 3));  // deviations 1, 2, 3
    return x;
  };
  const int variance = covered(kD * (1 + 4 + 9) / 3.0, [&](std::uint64_t r) {
    const auto x = clips(r);
    return within_class_variance_interval(within_class_variance(x, labels, classes), x, labels, classes);
  });
  const int modes = covered(mean_distance(2), [&](std::uint64_t r) {
    const auto x = clips(r);
    return multimodality_interval(multimodality(x, labels, classes, 20, r), x, labels, classes);
  });
  RecordProperty("covered.variance", variance);
  RecordProperty("covered.multimodality", modes);
  EXPECT_GE(variance, kFewest);
  EXPECT_GE(modes, kFewest);
}

// Every row left out in turn, the figure taken over all pairs.
template <class F>
double long_way(const Eigen::MatrixXd& x, F&& figure) {
  const Eigen::Index n = x.rows();
  Eigen::VectorXd v(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    Eigen::MatrixXd less(n - 1, x.cols());
    less << x.topRows(i), x.bottomRows(n - 1 - i);
    v[i] = figure(less);
  }
  return static_cast<double>(n - 1) / static_cast<double>(n) * (v.array() - v.mean()).square().sum();
}

TEST(PairIntervals, AreTheJackknifeDoneTheLongWay) {
  const Eigen::MatrixXd x = gauss(20, 3, 2, 5).array() + 7, y = gauss(25, 3, 1, 6);
  const double t = t_quantile(0.975, 19);
  KidOptions o;
  const auto all = [&](const Eigen::MatrixXd& g) {
    const auto k = [](const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) { return Eigen::ArrayXXd(((a * b.transpose()).array() / 3 + 1).cube()); };
    const Eigen::ArrayXXd own = k(g, g);
    const double n = static_cast<double>(g.rows());
    return (own.sum() - own.matrix().trace()) / (n * (n - 1)) - 2 * k(g, y).mean();
  };
  const auto i = kid_interval(x, y, {4, 0}, o);
  EXPECT_EQ(i.value, 4);
  EXPECT_NEAR((i.high - 4) / t, std::sqrt(long_way(x, all)), 1e-9 * (i.high - 4));
  EXPECT_EQ(i.n, 20);
  // The spread of the subsets drawn counts besides.
  const auto more = kid_interval(x, y, {4, 50}, o);
  EXPECT_NEAR(std::pow((more.high - 4) / t, 2), std::pow((i.high - 4) / t, 2) + 50 * 50 / 100.0, 1e-6 * std::pow(more.high, 2));
  const auto trace = [](const Eigen::MatrixXd& g) { return (g.rowwise() - g.colwise().mean()).squaredNorm() / static_cast<double>(g.rows() - 1); };
  const auto w = within_class_variance_interval(30, x, std::vector<int>(20, 0), {"a"});
  EXPECT_NEAR((w.high - 30) / t, std::sqrt(long_way(x, trace)), 1e-9 * w.high);
  const auto distance = [](const Eigen::MatrixXd& g) {
    double sum = 0;
    for (Eigen::Index a = 0; a < g.rows(); ++a)
      for (Eigen::Index b = 0; b < g.rows(); ++b) sum += (g.row(a) - g.row(b)).norm();
    return sum / static_cast<double>(g.rows() * (g.rows() - 1));
  };
  const auto d = diversity_interval(5, x, 2000000000);
  EXPECT_NEAR((d.high - 5) / t, std::sqrt(long_way(x, distance)), 1e-6);
}

TEST(PairIntervals, AreTheSameOnAnyNumberOfThreadsAndAbsentForTwoClips) {
  const Eigen::MatrixXd x = gauss(600, 4, 1, 2), y = gauss(300, 4, 1, 3);
  KidOptions one, two;
  two.threads = 2;
  EXPECT_EQ(kid_interval(x, y, {0, 0}, one).high, kid_interval(x, y, {0, 0}, two).high);
  EXPECT_EQ(diversity_interval(2, x, 200, 1).high, diversity_interval(2, x, 200, 2).high);
  EXPECT_TRUE(std::isnan(diversity_interval(2, x.topRows(2)).low));
  EXPECT_TRUE(std::isnan(kid_interval(x.topRows(2), y, {0, 0}, one).high));
  EXPECT_TRUE(std::isnan(multimodality_interval(2, x.topRows(5), {0, 0, 0, 1, 1}, {"a", "b"}).low));
  EXPECT_EQ(diversity_interval(0.01, x.topRows(4)).low, 0);
  EXPECT_THROW(kid_interval(x, y.leftCols(3), {0, 0}, one), Error);
}

TEST(Standard, BringsColumnsToUnitSizeAndKeepsStillOnesStill) {
  Eigen::MatrixXd y = gauss(500, 4, 1, 9);
  y.col(1) *= 1000;
  y.col(1).array() += 5e4;
  y.col(2).setConstant(3);
  const Standard standard = standard_of(y);
  const Eigen::MatrixXd z = standard(y);
  EXPECT_NEAR(z.col(1).mean(), 0, 1e-9);
  EXPECT_NEAR(z.col(1).squaredNorm() / 499, 1, 1e-9);
  EXPECT_EQ(z.col(2).cwiseAbs().maxCoeff(), 0);
  EXPECT_NEAR(standard.scale[2], standard.scale.minCoeff(), 1e-12);  // not 0: a tenth of the root mean square
  EXPECT_NEAR(standard.scale[2], 0.1 * standard.scale[1] / 2, 0.01 * standard.scale[2]);
  EXPECT_EQ(standard_of(Eigen::MatrixXd::Ones(5, 2)).scale[0], 1);
  EXPECT_THROW(standard(y.leftCols(2)), Error);
  EXPECT_THROW(standard_of(y.topRows(1)), Error);
}

}  // namespace
}  // namespace mocap::metrics
