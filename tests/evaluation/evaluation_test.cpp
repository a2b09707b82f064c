// The room as another program uses it: several generators against the same real set. The tool's own table is tests/cli/fid-eval.tst.
#include "libmocap/evaluation/evaluation.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "libmocap/base/error.hpp"
#include "libmocap/base/random.hpp"

namespace mocap::evaluation {
namespace {

Set features(const std::string& name, Eigen::Index n, double shift, std::uint64_t seed) {
  Random random(seed, 0x7e57);
  Set set;
  set.path = name;
  View view;
  view.attribute = "action";
  view.classes = {"a", "b"};
  view.features.resize(n, 4);
  view.posteriors.resize(n, 2);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < 4; ++j) view.features(i, j) = random.normal(shift + static_cast<double>(i % 2), 1);
    view.labels.push_back(static_cast<int>(i % 2));
    view.posteriors.row(i) << (i % 2 == 0 ? 0.9 : 0.2), (i % 2 == 0 ? 0.1 : 0.8);
  }
  set.views.push_back(view);
  join_views(set);
  return set;
}

double value(const Report& report, const std::string& name) {
  const auto* i = report.find(name);
  return i ? i->value : throw std::out_of_range(name);
}

TEST(Evaluation, JudgesSeveralGeneratorsAgainstOneRealSet) {
  const Set real = features("real", 120, 0, 1);
  Options options;
  options.resamples = 20;
  const Report good = evaluate({features("good", 100, 0, 2), real, {}}, options), bad = evaluate({features("bad", 100, 2, 3), real, {}}, options);
  EXPECT_LT(value(good, "fid"), value(bad, "fid"));
  EXPECT_LT(value(good, "kid"), value(bad, "kid"));
  EXPECT_GT(value(good, "precision"), value(bad, "precision"));
  EXPECT_EQ(value(good, "fid.floor_halves"), value(bad, "fid.floor_halves"));  // the same halves for each
  EXPECT_EQ(value(good, "diversity.real"), value(bad, "diversity.real"));
  EXPECT_EQ(value(good, "accuracy.action"), 1);
  for (const std::string name : {"fid", "kid", "is", "diversity", "diversity.real", "within_class_variance", "within_class_variance.real", "multimodality", "multimodality.real"}) {
    const auto* i = good.find(name);
    ASSERT_NE(i, nullptr) << name;
    EXPECT_LT(i->low, i->high) << name;
  }
  EXPECT_EQ(good.find("energy"), nullptr);  // no clips
  options.threads = 2;
  EXPECT_EQ(format_report(evaluate({features("good", 100, 0, 2), real, {}}, options), Format::json), format_report(good, Format::json));
}

TEST(Evaluation, KidHasNoUnitsButAsPublished) {
  Options options;
  options.resamples = 0;
  Sets sets{features("g", 60, 1, 2), features("r", 60, 0, 1), {}}, large = sets;
  for (Set* set : large.all()) set->features *= 100;
  const auto own = evaluate(sets, options), scaled = evaluate(large, options);
  EXPECT_NEAR(value(own, "kid"), value(scaled, "kid"), 1e-9);
  EXPECT_NEAR(value(own, "kid.floor_halves"), value(scaled, "kid.floor_halves"), 1e-9);
  options.compat = metrics::Compat::torch_fidelity;
  const auto published = evaluate(sets, options), published_large = evaluate(large, options);
  EXPECT_GT(value(published_large, "kid"), 1e6 * value(published, "kid"));
  EXPECT_TRUE(std::isnan(published.find("kid")->low));
}

TEST(Evaluation, ReducesByTheTrainingClipsAndNamesWhatItRefuses) {
  Sets sets{features("g", 60, 0, 2), features("r", 60, 0, 1), features("t", 60, 0, 3)};
  const double kept = reduce(sets, 2);
  EXPECT_GT(kept, 0.4);
  EXPECT_LT(kept, 1);
  for (const Set* set : sets.all()) EXPECT_EQ(set->features.cols(), 2);
  sets.real.views[0].labels.assign(60, 0);
  sets.real.path = "real.npz";
  try {
    evaluate(sets, {});
    ADD_FAILURE() << "a class without clips was taken";
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("class b has 0 clips"), std::string::npos) << e.what();
    EXPECT_NE(std::string(e.what()).find("real.npz"), std::string::npos) << e.what();
  }
  Options none;
  none.repeats = 0;
  EXPECT_THROW(evaluate({features("g", 60, 0, 2), features("r", 60, 0, 1), {}}, none), Error);
  const Groups unlabelled = [] {
    Sets s{features("g", 4, 0, 2), features("r", 4, 0, 1), {}};
    s.real.views[0].labels.clear();
    return group_by_labels(s);
  }();
  EXPECT_TRUE(unlabelled.by_class);
  EXPECT_FALSE(unlabelled.real_by_class);
  EXPECT_EQ(unlabelled.classes, (std::vector<std::string>{"a", "b"}));
  EXPECT_EQ(unlabelled.real, std::vector<int>(4, -1));
}

TEST(Report, HasItsForms) {
  Report report;
  report.rows = {{"fid.floor_halves", {1.5, std::nan(""), std::nan(""), 3}}, {"kid", {0.25, 0.125, 0.5, 4}}};
  for (int i = 0; i < 22; ++i) report.frozen.push_back("c" + std::to_string(i));
  EXPECT_EQ(format_report(report, Format::tsv), "figure\tvalue\tlow\thigh\tn\nfid.floor_halves\t1.5\t-\t-\t3\nkid\t0.25\t0.125\t0.5\t4\n");
  EXPECT_NE(format_report(report, Format::latex).find("fid.floor\\_halves & 1.5 & - & - & 3 \\\\\n"), std::string::npos);
  const std::string text = format_report(report, Format::text), json = format_report(report, Format::json);
  EXPECT_NE(text.find("frozen: c0 c1"), std::string::npos);
  EXPECT_NE(text.find("c19 and 2 more"), std::string::npos);
  EXPECT_EQ(text.find("exploding"), std::string::npos);
  EXPECT_NE(json.find("\"fid.floor_halves.low\": null"), std::string::npos);
  EXPECT_NE(json.find("\"exploding\": []"), std::string::npos);
  EXPECT_EQ(report.find("fid"), nullptr);
  EXPECT_EQ(parse_format("latex"), Format::latex);
  EXPECT_THROW(parse_format("html"), Error);
}

}  // namespace
}  // namespace mocap::evaluation
