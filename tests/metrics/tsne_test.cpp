#include "libmocap/metrics/tsne.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <map>

#include "libmocap/base/error.hpp"
#include "libmocap/base/random.hpp"
#include "libmocap/metrics/frechet.hpp"

namespace mocap::metrics {
namespace {

// What tests/data/metrics/make_tsne.py found with NumPy.
const Eigen::MatrixXd& reference(const std::string& name) {
  static const auto all = [] {
    std::map<std::string, Eigen::MatrixXd> out;
    std::ifstream in(TEST_DATA "/metrics/tsne.txt");
    std::string key;
    Eigen::Index rows = 0, columns = 0;
    while (in >> key >> rows >> columns) {
      Eigen::MatrixXd& x = out[key] = Eigen::MatrixXd(rows, columns);
      for (Eigen::Index i = 0; i < rows; ++i)
        for (Eigen::Index j = 0; j < columns; ++j) in >> x(i, j);
    }
    return out;
  }();
  return all.at(name);
}

double worst(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) { return (a - b).cwiseAbs().maxCoeff(); }

Eigen::MatrixXd normal(Eigen::Index n, Eigen::Index d, std::uint64_t seed) {
  Random random(seed, 1);
  Eigen::MatrixXd x(n, d);
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < d; ++j) x(i, j) = random.normal();
  return x;
}

// Normal around centres that lie `apart` from each other, in turn.
Eigen::MatrixXd blobs(Eigen::Index n, Eigen::Index d, int centres, double apart) {
  Eigen::MatrixXd x = normal(n, d, 5);
  for (Eigen::Index i = 0; i < n; ++i) x(i, i % centres) += apart;
  return x;
}

void refuses(const Eigen::MatrixXd& x, const TsneOptions& options, const std::string& part, Exit status = Exit::data) {
  try {
    tsne(x, options);
    ADD_FAILURE() << "nothing was thrown, expected: " << part;
  } catch (const Error& e) {
    EXPECT_EQ(e.status(), status);
    EXPECT_NE((std::string(e.what()) + " " + e.hint()).find(part), std::string::npos) << e.what() << " " << e.hint();
  }
}

TEST(Tsne, ProbabilitiesAreNumPys) {
  const Eigen::MatrixXd p = conditional_probabilities(reference("small"), 5);
  EXPECT_LT(worst(p.transpose(), reference("conditional")), 1e-10);
  for (Eigen::Index i = 0; i < p.cols(); ++i) {
    EXPECT_EQ(p(i, i), 0);
    EXPECT_NEAR(p.col(i).sum(), 1, 1e-14);
    double entropy = 0;
    for (const double v : p.col(i))
      if (v > 0) entropy -= v * std::log(v);
    EXPECT_NEAR(std::exp(entropy), 5, 1e-10);
  }
  const Eigen::MatrixXd joint = joint_probabilities(p);
  EXPECT_NEAR(joint.sum(), 1, 1e-14);
  EXPECT_EQ(worst(joint, joint.transpose()), 0);
  EXPECT_LT(worst(joint, (reference("conditional") + reference("conditional").transpose()) / 40), 1e-11);
}

TEST(Tsne, ProbabilitiesOfEqualAndOfFarPoints) {
  // Eight equal points, more than the perplexity: they share evenly. All others are too far to count.
  Eigen::MatrixXd x = Eigen::MatrixXd::Zero(12, 2);
  for (Eigen::Index i = 8; i < 12; ++i) x(i, 0) = 1e6 * static_cast<double>(i);
  const Eigen::MatrixXd p = conditional_probabilities(x, 3);
  EXPECT_TRUE(p.allFinite());
  for (Eigen::Index j = 1; j < 8; ++j) EXPECT_NEAR(p(j, 0), 1.0 / 7, 1e-12);
  EXPECT_LT(p(9, 0), 1e-12);
  for (Eigen::Index i = 0; i < 12; ++i) EXPECT_NEAR(p.col(i).sum(), 1, 1e-14);
  // All at one distance.
  EXPECT_LT(worst(conditional_probabilities(Eigen::MatrixXd::Identity(6, 6), 2) + Eigen::MatrixXd::Identity(6, 6) / 5, Eigen::MatrixXd::Constant(6, 6, 0.2)), 1e-15);
  // No size of the features is too large or too small, and none changes the map's neighbourhoods.
  for (const double scale : {1e-150, 1e-3, 1e150}) {
    TsneOptions o;
    o.perplexity = 5;
    o.iterations = 300;
    EXPECT_NEAR(tsne(reference("small") * scale, o).perplexity, 5, 1e-9) << scale;
  }
}

TEST(Tsne, GradientIsNumPysAndThatOfTheDivergence) {
  const Eigen::MatrixXd joint = joint_probabilities(conditional_probabilities(reference("small"), 5)), y = reference("places");
  EXPECT_NEAR(tsne_divergence(joint, y), reference("divergence")(0, 0), 1e-10);
  const Eigen::MatrixXd g = tsne_gradient(joint, y);
  EXPECT_LT(worst(g, reference("gradient")), 1e-11);
  EXPECT_LT(worst(tsne_gradient(joint, y, 12), reference("exaggerated")), 1e-10);
  for (Eigen::Index i = 0; i < y.rows(); ++i)
    for (Eigen::Index k = 0; k < 2; ++k) {
      const double h = 1e-5;
      Eigen::MatrixXd up = y, down = y;
      up(i, k) += h;
      down(i, k) -= h;
      EXPECT_NEAR(g(i, k), (tsne_divergence(joint, up) - tsne_divergence(joint, down)) / (2 * h), 1e-8);
    }
}

TEST(Tsne, DescendsAsFarAsNumPy) {
  TsneOptions o;
  o.perplexity = 15;
  const TsneMap map = tsne(reference("blobs"), o);
  const double theirs = reference("blobs.divergence")(0, 0);
  EXPECT_LT(map.divergence, 1.03 * theirs);
  EXPECT_GT(map.divergence, 0.9 * theirs);
  EXPECT_NEAR(map.perplexity, 15, 1e-9);
  EXPECT_EQ(map.learning_rate, 50);
  EXPECT_LT(map.points.colwise().mean().norm(), 1e-12);
}

TEST(Tsne, KeepsNeighboursAndBlobsApart) {
  const Eigen::MatrixXd x = blobs(150, 8, 3, 12);
  for (const bool random : {false, true}) {
    TsneOptions o;
    o.perplexity = 20;
    o.random_start = random;
    const TsneMap map = tsne(x, o);
    EXPECT_GT(trustworthiness(x, map.points), 0.95);
    // Everybody's nearest neighbour is of its own blob, and the blobs' centres lie further apart than their radii together.
    for (Eigen::Index i = 0; i < 150; ++i) {
      Eigen::VectorXd d = (map.points.rowwise() - map.points.row(i)).rowwise().squaredNorm();
      d[i] = 1e300;
      Eigen::Index nearest = 0;
      d.minCoeff(&nearest);
      EXPECT_EQ(nearest % 3, i % 3);
    }
    Eigen::MatrixXd centre = Eigen::MatrixXd::Zero(3, 2);
    for (Eigen::Index i = 0; i < 150; ++i) centre.row(i % 3) += map.points.row(i) / 50;
    double radius = 0;
    for (Eigen::Index i = 0; i < 150; ++i) radius = std::max(radius, (map.points.row(i) - centre.row(i % 3)).norm());
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < a; ++b) EXPECT_GT((centre.row(a) - centre.row(b)).norm(), 1.2 * radius);
  }
}

TEST(Tsne, TrustworthinessKnowsGoodAndBadMaps) {
  const Eigen::MatrixXd x = normal(100, 2, 3);
  EXPECT_EQ(trustworthiness(x, x), 1);
  EXPECT_EQ(trustworthiness(x, -3 * x, 10, 2), 1);
  EXPECT_NEAR(trustworthiness(x, normal(100, 2, 4)), 0.5, 0.06);
  // By hand: on a line 0 1 2 4.5 8 13, 0 and 13 exchanged in the map, k = 1. Nearest in features: 1 0(of 1: 0 and 2 at one distance, the first) 1 2 4.5 8.
  Eigen::VectorXd line(6), map(6);
  line << 0, 1, 2, 4.5, 8, 13;
  map << 13, 1, 2, 4.5, 8, 0;
  // The map's nearest: of 0 (at 13) it is 8, rank 4; of 1 it is 2 or 13 (at 0), at one distance: 2, the first, rank 2; of 13 (at 0) it is 1, rank 4; of 8 it is 4.5; others agree.
  EXPECT_NEAR(trustworthiness(line, map, 1), 1 - 2.0 / (6 * 1 * (12 - 3 - 1)) * (3 + 1 + 0 + 0 + 0 + 3), 1e-12);
  EXPECT_THROW(trustworthiness(x, x, 50), Error);
  EXPECT_THROW(trustworthiness(x, x.topRows(9)), Error);
}

TEST(Tsne, EqualBytesOnAnyThreadsAndBySeed) {
  const Eigen::MatrixXd x = blobs(133, 5, 2, 4);
  TsneOptions o;
  o.iterations = 400;
  const Eigen::MatrixXd one = tsne(x, o).points;
  for (const int threads : {2, 3, 7}) {
    o.threads = threads;
    EXPECT_EQ(worst(tsne(x, o).points, one), 0) << threads;
  }
  o.seed = 2;  // says nothing to the principal start
  EXPECT_EQ(worst(tsne(x, o).points, one), 0);
  o.random_start = true;
  const Eigen::MatrixXd second = tsne(x, o).points;
  EXPECT_EQ(worst(tsne(x, o).points, second), 0);
  o.seed = 3;
  EXPECT_GT(worst(tsne(x, o).points, second), 1e-3);
}

TEST(Tsne, TakesItsOptions) {
  const Eigen::MatrixXd x = blobs(60, 5, 2, 4);
  TsneOptions o;
  o.perplexity = 10;
  o.iterations = 60;
  int calls = 0, last = 0;
  o.progress = [&](int done) { ++calls, last = done; };
  const TsneMap first = tsne(x, o);
  EXPECT_EQ(calls, 60);
  EXPECT_EQ(last, 60);
  EXPECT_EQ(first.learning_rate, 50);
  o.learning_rate = 20;
  const TsneMap slow = tsne(x, o);
  EXPECT_EQ(slow.learning_rate, 20);
  EXPECT_GT(worst(slow.points, first.points), 1e-6);
  o.learning_rate = 0;
  o.exaggeration = 4;
  EXPECT_GT(worst(tsne(x, o).points, first.points), 1e-6);
  o.exaggeration = 12;
  o.exaggerated = 20;
  EXPECT_GT(worst(tsne(x, o).points, first.points), 1e-6);
  o.exaggeration = 1;  // N / 1 / 4
  EXPECT_EQ(tsne(blobs(400, 3, 2, 4), o).learning_rate, 100);
}

// On a line clips would never pass each other.
TEST(Tsne, OneAxisIsEnough) {
  TsneOptions o;
  o.perplexity = 5;
  const Eigen::MatrixXd x = normal(30, 1, 8);
  EXPECT_GT(trustworthiness(x, tsne(x, o).points, 3), 0.95);
  EXPECT_GT(trustworthiness(x, tsne(x * Eigen::RowVector3d(1, 2, -1), o).points, 3), 0.95);
}

TEST(Tsne, Refuses) {
  const Eigen::MatrixXd x = normal(90, 3, 1);
  TsneOptions o;
  refuses(x, o, "90 clips with a perplexity of 30, expected at least 91 clips");
  refuses(x, o, "at most 29.6 goes");
  o.perplexity = 29.6;
  EXPECT_NO_THROW(tsne(x, [&] { auto few = o; few.iterations = 2; return few; }()));
  refuses(x.topRows(2), o, "2 clips, expected at least 3");
  refuses(x.topRows(4), o, "a principal map takes 3");
  Eigen::MatrixXd bad = x;
  bad(4, 1) = std::nan("");
  refuses(bad, o, "row 5, column 2 is nan");
  bad(4, 1) = INFINITY;
  refuses(bad, o, "row 5, column 2 is infinite");
  bad(4, 1) = 0;
  bad(0, 1) = 1.7e308;
  bad(5, 1) = -1.7e308;
  refuses(bad, o, "than a double can hold");
  refuses(Eigen::MatrixXd::Ones(95, 3), o, "all 95 clips have the same features");
  refuses(Eigen::MatrixXd::Zero(kTsneMost + 1, 1), o, "at most 20000");
  o.learning_rate = 1e200;
  refuses(x, o, "runs away");
  o.learning_rate = -1;
  refuses(x, o, "learning rate", Exit::usage);
  o.learning_rate = 0;
  o.perplexity = 1;
  refuses(x, o, "more than 1", Exit::usage);
  o.perplexity = 5;
  o.iterations = 0;
  refuses(x, o, "at least one", Exit::usage);
  o.iterations = 1;
  o.exaggeration = 0.5;
  refuses(x, o, "exaggeration", Exit::usage);
}

TEST(PrincipalMap, IsNumPysSvd) {
  const Pca pca = fit_pca(reference("small"), 2);
  EXPECT_LT(worst(project(pca, reference("small")), reference("principal")), 1e-12);
  EXPECT_NEAR(pca.kept, reference("shares").sum(), 1e-13);
  EXPECT_NEAR(pca.variance[0] / pca.variance[1], reference("shares")(0, 0) / reference("shares")(0, 1), 1e-11);
}

}  // namespace
}  // namespace mocap::metrics
