#include "libmocap/metrics/sample_figures.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "fixtures.hpp"
#include "libmocap/base/error.hpp"

namespace mocap::metrics {
namespace {

using test::expected;
using test::fixture;

std::string message_of(const std::function<void()>& body) {
  try {
    body();
  } catch (const Error& e) {
    EXPECT_EQ(e.status(), Exit::data);
    return e.what();
  }
  return "nothing was thrown";
}
bool refuses(const std::function<void()>& body, const std::string& part) {
  const std::string m = message_of(body);
  return m.find(part) != std::string::npos ? true : (ADD_FAILURE() << m, false);
}

const std::vector<std::string> kClasses = {"walking", "jogging", "jumping", "lifting"};

TEST(InceptionScore, AgreesWithNumPyAndKnowsItsBounds) {
  EXPECT_NEAR(inception_score(fixture("p4")).mean, expected("is.4"), 1e-12);
  EXPECT_NEAR(inception_score(joint_posteriors({fixture("p4"), fixture("p2")})).mean, expected("is.joint"), 1e-12);
  const auto torch = inception_score_torch_fidelity(fixture("p4"));
  EXPECT_NEAR(torch.mean, expected("is.torch-fidelity"), 1e-12);
  EXPECT_NEAR(torch.deviation, expected("is.torch-fidelity.std"), 1e-12);
  // One-hot and balanced reaches the bound; all alike is 1.
  Eigen::MatrixXd hot = Eigen::MatrixXd::Zero(9, 3);
  for (int i = 0; i < 9; ++i) hot(i, i % 3) = 1;
  EXPECT_NEAR(inception_score(hot).mean, 3, 1e-12);
  EXPECT_NEAR(inception_bound(3, 9), 3, 1e-12);
  EXPECT_NEAR(inception_score(hot.topRows(7)).mean, inception_bound(3, 7), 1e-12);
  EXPECT_LT(inception_bound(3, 7), 3);
  EXPECT_NEAR(inception_bound(8, 3), 3, 1e-12);
  EXPECT_NEAR(inception_score(Eigen::MatrixXd::Constant(5, 4, 0.25)).mean, 1, 1e-12);
  EXPECT_EQ(inception_score(fixture("p4"), 4, 3).mean, inception_score(fixture("p4"), 4, 3).mean);
  EXPECT_NE(inception_score(fixture("p4"), 4, 3).mean, inception_score(fixture("p4"), 4, 4).mean);
  EXPECT_GT(inception_score(fixture("p4"), 4, 3).deviation, 0);
}

TEST(InceptionScore, Refuses) {
  refuses([] { inception_score(Eigen::MatrixXd::Ones(5, 1)); }, "over 1 classes, expected at least two");
  refuses([] { inception_score(Eigen::MatrixXd::Constant(5, 2, 0.4)); }, "row 1 sums to 0.8");
  refuses([] { inception_score(fixture("p4"), 161); }, "160 clips for 161 splits");
  Eigen::MatrixXd nan = fixture("p4");
  nan(3, 1) = std::nan("");
  refuses([&] { inception_score(nan); }, "row 4 sums to nan");
  refuses([] { joint_posteriors({fixture("p4"), Eigen::MatrixXd::Constant(3, 2, 0.5)}); }, "160 and of 3 clips");
}

TEST(Kid, AgreesWithTorchFidelity) {
  KidOptions o;
  o.subsets = 20;
  o.subset = 60;
  o.seed = 2020;
  o.numpy_draws = true;
  const auto torch = kid(fixture("a"), fixture("b"), o);
  EXPECT_NEAR(torch.mean, expected("kid.torch-fidelity"), 1e-10);
  EXPECT_NEAR(torch.deviation, expected("kid.torch-fidelity.std"), 1e-10);
  o = {};
  o.subsets = 1;
  EXPECT_NEAR(kid(fixture("a").topRows(150), fixture("b"), o).mean, expected("kid.all"), 1e-10);
  o.subsets = 12;
  o.subset = 50;
  const double one = kid(fixture("a"), fixture("b"), o).mean;
  o.threads = 2;
  EXPECT_EQ(kid(fixture("a"), fixture("b"), o).mean, one);
  // Unbiased: halves of one set lie about 0, on either side.
  EXPECT_LT(std::abs(kid(fixture("a").topRows(80), fixture("a").bottomRows(80), o).mean), 0.3);
  Eigen::MatrixXd nan = fixture("a");
  nan(0, 0) = std::nan("");
  refuses([&] { kid(nan, fixture("b"), o); }, "row 1, column 1 is not finite");
  refuses([&] { kid(fixture("few_a"), fixture("b"), o); }, "features of 16 and of 8");
}

TEST(PrecisionRecall, AgreesWithNumPy) {
  const auto pr = precision_recall(fixture("a"), fixture("b"));
  EXPECT_DOUBLE_EQ(pr.precision, expected("precision"));
  EXPECT_DOUBLE_EQ(pr.recall, expected("recall"));
  const auto same = precision_recall(fixture("a"), fixture("a"), 3, 2);
  EXPECT_EQ(same.precision, 1);
  EXPECT_EQ(same.recall, 1);
  // One clip repeated: real enough, but it recalls nothing.
  const Eigen::MatrixXd one = fixture("b").row(0).replicate(40, 1);
  EXPECT_EQ(precision_recall(one, fixture("b")).precision, 1);
  EXPECT_LT(precision_recall(one, fixture("b")).recall, 0.05);
  const Eigen::MatrixXd far = fixture("b").array() + 100;
  EXPECT_EQ(precision_recall(far, fixture("b")).precision, 0);
  refuses([] { precision_recall(fixture("a").topRows(3), fixture("b")); }, "3 clips, expected at least 4");
}

TEST(Accuracy, CountsWhatIsLabelled) {
  auto labels = test::fixture_labels();
  long counted = 0;
  EXPECT_DOUBLE_EQ(accuracy(fixture("p4"), labels, &counted), expected("accuracy"));
  EXPECT_EQ(counted, 160);
  for (std::size_t i = 0; i < 150; ++i) labels[i] = -1;
  accuracy(fixture("p4"), labels, &counted);
  EXPECT_EQ(counted, 10);
  refuses([] { accuracy(fixture("p4"), std::vector<int>(160, -1)); }, "no clip is labelled");
  refuses([] { accuracy(fixture("p4"), {1, 2}); }, "2 labels for 160 clips");
  refuses([] { accuracy(fixture("p4"), std::vector<int>(160, 4)); }, "label 4, expected one of 4 classes");
}

TEST(Diversity, AgreesWithNumPy) {
  const auto& a = fixture("a");
  EXPECT_NEAR(diversity_a2m(a, 200, 3), expected("diversity.a2m"), 1e-10);
  EXPECT_NEAR(multimodality_a2m(a, test::fixture_labels(), kClasses, 20, 4), expected("multimodality.a2m"), 1e-10);
  EXPECT_NEAR(diversity(a, 200000), expected("diversity.all"), 0.02);
  EXPECT_NEAR(within_class_variance(a, test::fixture_labels(), kClasses), expected("within"), 1e-10);
  EXPECT_GT(multimodality(a, test::fixture_labels(), kClasses), 1);
  const Eigen::MatrixXd one = a.row(0).replicate(160, 1);
  EXPECT_EQ(diversity(one), 0);
  EXPECT_EQ(within_class_variance(one, test::fixture_labels(), kClasses), 0);
  EXPECT_EQ(multimodality(one, test::fixture_labels(), kClasses), 0);
}

TEST(Multimodality, AnEmptyClassIsRefusedNotLoopedOn) {
  auto labels = test::fixture_labels();
  for (int& l : labels)
    if (l == 2) l = 1;
  refuses([&] { multimodality(fixture("a"), labels, kClasses); }, "class jumping has 0 clips, expected at least 2");
  refuses([&] { multimodality_a2m(fixture("a"), labels, kClasses); }, "class jumping has 0 clips, expected at least 1");
  labels[0] = 2;
  refuses([&] { multimodality(fixture("a"), labels, kClasses); }, "class jumping has 1 clips");
  refuses([&] { within_class_variance(fixture("a"), labels, kClasses); }, "class jumping has 1 clips");
  refuses([&] { multimodality(fixture("a"), {0, 1}, kClasses); }, "2 labels for 160 clips");
  refuses([&] { diversity(fixture("a").topRows(1)); }, "1 clips, expected at least 2");
}

}  // namespace
}  // namespace mocap::metrics
