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

TEST(Evaluation, MatchesTheMixOfClasses) {
  // Both draw each class from one distribution; the generated ones have as many of a as of b, the real ones a fifth of b.
  Set generated = features("g", 400, 0, 2), real = features("r", 400, 0, 1);
  Rows kept;
  for (std::size_t i = 0; i < 400; ++i)
    if (i % 2 == 0 || i % 8 == 1) kept.push_back(i);
  View& view = real.views[0];
  view.features = take(view.features, kept);
  view.posteriors = take(view.posteriors, kept);
  view.labels = take(view.labels, kept);
  join_views(real);
  Sets sets;
  sets.generated = generated;
  sets.real = real;
  EXPECT_EQ(difference_of_mix(sets), "a: 50 % of the generated clips, 80 % of the real ones");
  Options options;
  options.resamples = 0;
  const double before = value(evaluate(sets, options), "fid");
  EXPECT_EQ(match_classes(sets.generated, sets.real, 1), 150u);  // 200 of a stay, and 50 of b
  join_views(sets.generated);
  EXPECT_EQ(sets.generated.size(), 250u);
  EXPECT_EQ(std::count(sets.generated.views[0].labels.begin(), sets.generated.views[0].labels.end(), 1), 50);
  for (Eigen::Index i = 0; i < 250; ++i) EXPECT_EQ(sets.generated.views[0].posteriors(i, 0), sets.generated.views[0].labels[static_cast<std::size_t>(i)] == 0 ? 0.9 : 0.2);
  EXPECT_EQ(difference_of_mix(sets), "");
  EXPECT_LT(value(evaluate(sets, options), "fid"), 0.5 * before);
  sets.generated.views[0].labels.assign(250, 0);
  EXPECT_THROW(match_classes(sets.generated, sets.real, 1), Error);  // no b
  sets.generated.views[0].labels[7] = -1;
  EXPECT_THROW(match_classes(sets.generated, sets.real, 1), Error);
}

TEST(Evaluation, FiguresByValueAreThoseOfItsClipsAlone) {
  Sets sets;
  sets.generated = features("g", 120, 0, 2);
  sets.real = features("r", 120, 0, 1);
  for (Set* set : sets.all()) {  // a second attribute that crosses the first
    View second = set->views[0];
    second.attribute = "style";
    second.classes = {"x", "y"};
    for (std::size_t i = 0; i < second.labels.size(); ++i) second.labels[i] = i % 4 < 2 ? 0 : 1;
    set->views.push_back(second);
    join_views(*set);
  }
  Options options;
  options.resamples = 0;
  options.by = "style";
  const Report all = evaluate(sets, options);
  Sets half = sets;
  for (Set* set : half.all()) {
    Rows rows;
    for (std::size_t i = 0; i < set->size(); ++i)
      if (set->views[1].labels[i] == 1) rows.push_back(i);
    for (View& v : set->views) v = {v.attribute, v.classes, take(v.features, rows), take(v.posteriors, rows), take(v.labels, rows)};
    join_views(*set);
  }
  options.by.clear();
  const Report alone = evaluate(half, options);
  EXPECT_NEAR(value(all, "within_class_variance.y"), value(alone, "within_class_variance"), 1e-9);
  EXPECT_NEAR(value(all, "within_class_variance.y.real"), value(alone, "within_class_variance.real"), 1e-9);
  EXPECT_EQ(all.find("within_class_variance.a"), nullptr);
  options.by = "gender";
  EXPECT_THROW(evaluate(sets, options), Error);
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
