#include "libmodels/train/dataset.hpp"

#include <fmt/core.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>

#include "libmocap/base/error.hpp"
#include "tests/store/sample_clips.hpp"

namespace mocap::train {
namespace {

using features::RotationRepresentation;
using testing::TemporaryFolder;
using testing::write_archive;

Clip labelled(const std::string& name, std::size_t frames, const Attributes& attributes) {
  Clip clip = testing::sample_clip(name, frames, std::hash<std::string>()(name));
  clip.attributes = attributes;
  clip.source.sha256 = std::string(64, "0123456789abcdef"[name[0] % 16]);  // a: 1, b: 2
  return clip;
}

MotionDataset load(const std::string& path, std::vector<std::string> attributes = {}, const MotionDataset* like = nullptr) {
  return MotionDataset(path, RotationRepresentation::quaternion, std::move(attributes), like);
}

std::string refusal(const std::function<void()>& body) {
  try {
    body();
  } catch (const Error& e) {
    return e.status() == Exit::data ? e.what() : std::string("another status: ") + e.what();
  }
  return "none";
}

// Nine walks and one jump; a subject; `mood` on some clips alone.
struct Corpus {
  TemporaryFolder folder;
  std::string path = folder / "train.h5";
  std::vector<Clip> clips;
  Corpus() {
    for (int i = 0; i < 9; ++i) clips.push_back(labelled(fmt::format("b_walk{}", i), 20 + 7 * static_cast<std::size_t>(i), {{"action", "walking"}, {"subject", std::to_string(i)}}));
    clips.push_back(labelled("a_jump", 13, {{"action", "jumping"}, {"subject", "0"}, {"mood", "glad"}}));
    write_archive(path, clips);
  }
};
const Corpus& corpus() {
  static const Corpus c;
  return c;
}
torch::Tensor padding_of(const MotionDataset& data) { return identity_padding(data.layout(), data.mean(), data.deviation()); }

TEST(Dataset, FeaturesAreStandardised) {
  const MotionDataset data = load(corpus().path);
  ASSERT_EQ(data.clips().size(), 10u);
  EXPECT_EQ(data.layout().columns(), 90);
  std::vector<torch::Tensor> all;
  for (const auto& c : data.clips()) all.push_back(c.features);
  const torch::Tensor x = torch::cat(all).to(torch::kDouble);
  EXPECT_EQ(static_cast<std::size_t>(x.size(0)), data.frames());
  EXPECT_LT(x.mean(0).abs().max().item<double>(), 1e-4);
  // A joint's numbers share the largest of their deviations, a root value has its own (at least 1e-3: the height here).
  const torch::Tensor sd = (x - x.mean(0)).square().mean(0).sqrt();
  EXPECT_NEAR(sd.narrow(0, 0, 84).reshape({21, 4}).amax(-1).min().item<double>(), 1, 1e-3);
  EXPECT_NEAR(sd.narrow(0, 0, 84).max().item<double>(), 1, 1e-3);
  EXPECT_NEAR(sd[87].item<double>(), 1, 1e-3);
  // Back to the clip.
  const auto raw = features::encode_motion_cell(store::ArchiveReader(corpus().path).read(3), RotationRepresentation::quaternion);
  for (const int c : {0, 5, 83, 84, 89})
    EXPECT_NEAR(data.clips()[3].features[7][c].item<double>() * data.deviation()[static_cast<std::size_t>(c)] + data.mean()[static_cast<std::size_t>(c)], raw(7, c), 1e-5);
}

TEST(Dataset, AttributesThatLabelMostClipsButSubject) {
  const MotionDataset data = load(corpus().path);
  EXPECT_EQ(data.vocabulary(), (Vocabulary{{"action", {"jumping", "walking"}}}));
  EXPECT_EQ(data.clips()[0].classes, (std::vector<std::int64_t>{1}));
  EXPECT_EQ(data.clips()[9].classes, (std::vector<std::int64_t>{0}));
  EXPECT_EQ(data.combinations().at({0}), (std::vector<std::size_t>{9}));
  EXPECT_EQ(data.sources(), (std::vector<std::string>{std::string(64, '1'), std::string(64, '2')}));
  EXPECT_EQ(load(corpus().path, {"subject"}).vocabulary().at("subject").size(), 9u);
  EXPECT_EQ(load(corpus().path, {"subject", "action"}).clips()[9].classes, (std::vector<std::int64_t>{0, 0}));
  EXPECT_EQ(data.left_out(), 0u);
  EXPECT_NE(refusal([] { load(corpus().path, {"nothing"}); }).find("no clip has an attribute 'nothing'"), std::string::npos);
}

TEST(Dataset, UnlabelledClipsAreLeftOut) {
  const MotionDataset moody = load(corpus().path, {"mood"});
  EXPECT_EQ(moody.vocabulary(), (Vocabulary{{"mood", {"glad"}}}));
  ASSERT_EQ(moody.clips().size(), 1u);
  EXPECT_EQ(moody.clips()[0].name, "a_jump");
  EXPECT_EQ(moody.left_out(), 9u);
  EXPECT_EQ(moody.combinations().at({0}), (std::vector<std::size_t>{0}));
  EXPECT_EQ(moody.sources(), (std::vector<std::string>{std::string(64, '1')}));

  // By default what labels half of the clips counts, what labels fewer does not.
  const TemporaryFolder folder;
  const Clip a = labelled("a", 20, {{"action", "walking"}}), b = labelled("b", 30, {}), c = labelled("c", 9, {{"action", ""}});
  write_archive(folder / "half.h5", {b, a});
  const MotionDataset half = load(folder / "half.h5");
  EXPECT_EQ(half.vocabulary(), (Vocabulary{{"action", {"walking"}}}));
  EXPECT_EQ(half.left_out(), 1u);
  EXPECT_EQ(half.frames(), 20u);
  write_archive(folder / "third.h5", {a, b, c});
  EXPECT_TRUE(load(folder / "third.h5").vocabulary().empty());
  // Each label stands somewhere, never both on one clip.
  Clip d = labelled("d", 9, {{"mood", "glad"}});
  write_archive(folder / "disjoint.h5", {a, d});
  EXPECT_NE(refusal([&] { load(folder / "disjoint.h5", {"action", "mood"}); }).find("no clip has all the attributes"), std::string::npos);
}

// What has a value of its own for nearly every clip is an identifier.
TEST(Dataset, ManyValuesAreNoDefaultClass) {
  const TemporaryFolder folder;
  std::vector<Clip> clips;
  for (int i = 0; i < 33; ++i) clips.push_back(labelled(fmt::format("c{}", i), 4, {{"take", std::to_string(i)}, {"day", std::to_string(i % 32)}}));
  write_archive(folder / "a.h5", clips);
  EXPECT_EQ(load(folder / "a.h5").vocabulary().count("take"), 0u);
  EXPECT_EQ(load(folder / "a.h5").vocabulary().at("day").size(), 32u);
  EXPECT_EQ(load(folder / "a.h5", {"take"}).vocabulary().at("take").size(), 33u);
}

TEST(Dataset, AValidationSetTakesStatisticsAndVocabulary) {
  const TemporaryFolder folder;
  const MotionDataset data = load(corpus().path);
  write_archive(folder / "val.h5", {labelled("v", 30, {{"action", "walking"}})});
  const MotionDataset val = load(folder / "val.h5", {}, &data);
  EXPECT_EQ(val.mean(), data.mean());
  EXPECT_EQ(val.deviation(), data.deviation());
  EXPECT_EQ(val.clips()[0].classes, (std::vector<std::int64_t>{1}));

  write_archive(folder / "unknown.h5", {labelled("v", 30, {{"action", "lifting"}})});
  EXPECT_NE(refusal([&] { load(folder / "unknown.h5", {}, &data); }).find("unknown.h5:clip v: attribute action is 'lifting'"), std::string::npos);
  write_archive(folder / "without.h5", {labelled("v", 30, {})});
  EXPECT_NE(refusal([&] { load(folder / "without.h5", {}, &data); }).find("no clip has all the attributes"), std::string::npos);
  Clip fast = labelled("v", 30, {{"action", "walking"}});
  fast.frame_rate_hz = 60;
  write_archive(folder / "fast.h5", {fast});
  EXPECT_NE(refusal([&] { load(folder / "fast.h5", {}, &data); }).find("Hz"), std::string::npos);
  auto larger = std::make_shared<Skeleton>(*canonical_body());
  larger->rest_offsets[3] *= 1.1;
  Clip other = testing::sample_clip("v", 30, 1, larger);
  other.attributes = {{"action", "walking"}};
  write_archive(folder / "other.h5", {other});
  EXPECT_NE(refusal([&] { load(folder / "other.h5", {}, &data); }).find("skeleton"), std::string::npos);
}

TEST(Dataset, BodiesThatCannotBeTrainedOn) {
  const TemporaryFolder folder;
  write_archive(folder / "point.h5", {testing::sample_clip("p", 5, 1, testing::one_joint())});
  EXPECT_NE(refusal([&] { load(folder / "point.h5"); }).find("point.h5:skeleton: 1 joint"), std::string::npos);
}

TEST(Dataset, ClipsOfOneFrame) {
  const TemporaryFolder folder;
  write_archive(folder / "a.h5", {labelled("a", 1, {{"action", "walking"}}), labelled("b", 1, {{"action", "walking"}})});
  const MotionDataset data = load(folder / "a.h5");
  const Batch batch = draw_batch(data, 4, 6, padding_of(data), 1, 1);
  EXPECT_EQ(batch.mask.sum().item<double>(), 4);
  EXPECT_TRUE(torch::isfinite(batch.features).all().item<bool>());
}

TEST(Dataset, DigestKnowsLabelsAndOrder) {
  const TemporaryFolder folder;
  const auto digest = [&](const std::vector<Clip>& clips) {
    write_archive(folder / "a.h5", clips);
    return load(folder / "a.h5", {"action"}).digest();
  };
  const Clip a = labelled("a", 9, {{"action", "x"}}), b = labelled("b", 9, {{"action", "y"}}), b_as_x = labelled("b", 9, {{"action", "x"}});
  Clip a_as_y = a, b_swapped = b;
  a_as_y.attributes["action"] = "y";
  b_swapped.attributes["action"] = "x";
  const std::string first = digest({a, b});
  EXPECT_EQ(digest({a, b}), first);
  EXPECT_NE(digest({b, a}), first) << "the order of the clips decides the batches";
  EXPECT_NE(digest({a_as_y, b_swapped}), first) << "the same motions, labels swapped";
  EXPECT_NE(digest({a, b_as_x}), first);
  Clip renamed = a;
  renamed.name = "c";
  EXPECT_EQ(digest({renamed, b}), first) << "a name decides nothing";
}

TEST(Batches, DependOnSeedAndStreamAlone) {
  const MotionDataset data = load(corpus().path);
  const auto padding = padding_of(data);
  const Batch a = draw_batch(data, 8, 30, padding, 5, 1), again = draw_batch(data, 8, 30, padding, 5, 1);
  EXPECT_TRUE(torch::equal(a.features, again.features) && torch::equal(a.mask, again.mask) && torch::equal(a.classes, again.classes));
  EXPECT_FALSE(torch::equal(a.features, draw_batch(data, 8, 30, padding, 5, 2).features));
  EXPECT_FALSE(torch::equal(a.features, draw_batch(data, 8, 30, padding, 6, 1).features));
}

TEST(Batches, CombinationsEquallyClipsWithinThemEqually) {
  const MotionDataset data = load(corpus().path);
  const Batch batch = draw_batch(data, 4000, 13, padding_of(data), 5, 1);
  EXPECT_EQ(batch.mask.min().item<float>(), 1);
  // One jump against nine walks: half of the draws each, five standard deviations wide.
  EXPECT_NEAR(batch.classes.to(torch::kDouble).mean().item<double>(), 0.5, 0.04);
}

// Every row is a stretch of a clip; all stretches occur.
TEST(Batches, WindowsFromAnywhere) {
  const TemporaryFolder folder;
  write_archive(folder / "a.h5", {labelled("a", 9, {{"action", "x"}})});
  const MotionDataset data = load(folder / "a.h5");
  const torch::Tensor clip = data.clips()[0].features;
  const Batch batch = draw_batch(data, 400, 6, padding_of(data), 1, 1);
  std::vector<int> counts(4);
  for (int row = 0; row < 400; ++row)
    for (int first = 0; first < 4; ++first) counts[static_cast<std::size_t>(first)] += torch::equal(batch.features[row], clip.narrow(0, first, 6));
  EXPECT_EQ(counts[0] + counts[1] + counts[2] + counts[3], 400);
  for (const int c : counts) EXPECT_NEAR(c, 100, 45);
}

TEST(Batches, ShortClipsArePaddedAndMasked) {
  const MotionDataset data = load(corpus().path);
  const auto padding = padding_of(data);
  const Batch batch = fixed_batch(data, {9, 0}, 30, padding);
  EXPECT_TRUE(torch::equal(batch.features[0].narrow(0, 0, 13), data.clips()[9].features));
  for (int t = 13; t < 30; ++t) EXPECT_TRUE(torch::equal(batch.features[0][t], padding));
  EXPECT_EQ(batch.mask[0].sum().item<float>(), 13);
  EXPECT_EQ(batch.mask[0][12].item<float>(), 1);
  EXPECT_EQ(batch.mask[0][13].item<float>(), 0);
  EXPECT_EQ(batch.mask[1].sum().item<float>(), 20);
  EXPECT_EQ(batch.classes[0][0].item<std::int64_t>(), 0);
}

using Rows = std::vector<std::int64_t>;
Rows values(const torch::Tensor& t) {
  const torch::Tensor c = t.contiguous();
  return {c.data_ptr<std::int64_t>(), c.data_ptr<std::int64_t>() + c.numel()};
}

Clip parts(const std::string& name, const Attributes& own, const std::vector<Segment>& segments) {
  Clip clip = labelled(name, 20, own);
  clip.segments = segments;
  return clip;
}

TEST(Segments, OverrideTheClipsAttributes) {
  const TemporaryFolder folder;
  const Segment walk{0, 8, {{"action", "walking"}}}, jog{8, 12, {{"action", "jogging"}}}, middle{5, 4, {{"action", "jogging"}}}, gap{8, 6, {{"action", "jogging"}}}, empty{3, 4, {{"action", ""}}};
  write_archive(folder / "a.h5", {labelled("a", 20, {{"action", "walking"}, {"gender", "male"}}), parts("b", {{"gender", "male"}}, {walk, jog}),
                                  parts("c", {{"action", "walking"}, {"gender", "male"}}, {middle}), parts("d", {{"gender", "male"}}, {walk, gap}),
                                  parts("e", {{"action", "jogging"}, {"gender", "male"}}, {empty})});
  const MotionDataset data = load(folder / "a.h5");
  EXPECT_EQ(data.vocabulary(), (Vocabulary{{"action", {"jogging", "walking"}}, {"gender", {"male"}}}));
  ASSERT_EQ(data.clips().size(), 4u);
  EXPECT_EQ(data.left_out(), 1u) << "d has no label from frame 14 on";
  EXPECT_EQ(data.fillable(), 0u);
  EXPECT_EQ(data.changing(), 2u);
  EXPECT_TRUE(data.clips()[0].spans.empty());
  EXPECT_TRUE(data.clips()[3].spans.empty()) << "an empty label overrides nothing";
  ASSERT_EQ(data.clips()[1].spans.size(), 2u);
  EXPECT_EQ(data.clips()[1].classes, (Classes{1, 0}));
  EXPECT_EQ(data.clips()[1].spans[1].first, 8);
  EXPECT_EQ(data.clips()[1].spans[1].classes, (Classes{0, 0}));
  ASSERT_EQ(data.clips()[2].spans.size(), 3u);
  EXPECT_EQ(data.clips()[2].spans[2].first, 9);
  EXPECT_EQ(data.combinations().at({0, 0}), (std::vector<std::size_t>{1, 2, 3}));
  EXPECT_EQ(data.combinations().at({1, 0}), (std::vector<std::size_t>{0, 1, 2}));

  const auto padding = padding_of(data);
  const Batch batch = fixed_batch(data, {0, 1, 2}, 24, padding);
  EXPECT_EQ(values(batch.classes), (Rows{1, 0, 1, 0, 1, 0}));
  ASSERT_TRUE(batch.frame_classes.defined());
  const torch::Tensor actions = batch.frame_classes.select(2, 0);
  Rows expected(24, 1);
  EXPECT_EQ(values(actions[0]), expected);
  std::fill(expected.begin() + 8, expected.end(), 0);  // past the end as at the end
  EXPECT_EQ(values(actions[1]), expected);
  expected.assign(24, 1);
  std::fill_n(expected.begin() + 5, 4, 0);
  EXPECT_EQ(values(actions[2]), expected);
  EXPECT_EQ(batch.frame_classes.select(2, 1).abs().max().item<std::int64_t>(), 0);
  // Words of three frames take their middle frame's: frame 8 is the last of word 2.
  const torch::Tensor words = word_classes(batch, 3);
  EXPECT_EQ(words.sizes(), (std::vector<std::int64_t>{3, 8, 2}));
  EXPECT_EQ(values(words.select(2, 0)[1]), (Rows{1, 1, 1, 0, 0, 0, 0, 0}));
  EXPECT_EQ(values(words.select(2, 0)[2]), (Rows{1, 1, 0, 1, 1, 1, 1, 1}));
  const Batch part = rows(batch, 1, 2);
  EXPECT_TRUE(torch::equal(part.frame_classes, batch.frame_classes.narrow(0, 1, 2)) && torch::equal(part.features, batch.features.narrow(0, 1, 2)));
  EXPECT_TRUE(torch::equal(part.classes, batch.classes.narrow(0, 1, 2)) && torch::equal(part.mask, batch.mask.narrow(0, 1, 2)));

  const Batch constant = fixed_batch(data, {0, 3}, 24, padding);
  EXPECT_FALSE(constant.frame_classes.defined());
  EXPECT_TRUE(torch::equal(word_classes(constant, 3), constant.classes));
  EXPECT_FALSE(rows(constant, 0, 1).frame_classes.defined());
}

// Windows begin with the combination that was drawn, wherever the clip has it, and carry the classes of their own frames.
TEST(Segments, WindowsBeginWithTheCombinationDrawn) {
  const TemporaryFolder folder;
  write_archive(folder / "a.h5", {parts("b", {}, {{0, 8, {{"action", "walking"}}}, {8, 12, {{"action", "jogging"}}}})});
  const MotionDataset data = load(folder / "a.h5");
  const torch::Tensor clip = data.clips()[0].features;
  const Batch batch = draw_batch(data, 600, 6, padding_of(data), 1, 1);
  EXPECT_NEAR(batch.classes.to(torch::kDouble).mean().item<double>(), 0.5, 0.1);
  std::vector<int> counts(15);
  for (int row = 0; row < 600; ++row) {
    int first = 0;
    while (!torch::equal(batch.features[row], clip.narrow(0, first, 6))) ASSERT_LT(++first, 15);
    ++counts[static_cast<std::size_t>(first)];
    for (int t = 0; t < 6; ++t) ASSERT_EQ(batch.frame_classes[row][t][0].item<std::int64_t>(), first + t < 8 ? 1 : 0) << first;
  }
  for (int first = 0; first < 15; ++first) EXPECT_NEAR(counts[static_cast<std::size_t>(first)], first < 8 ? 300.0 / 8 : 300.0 / 7, 30) << first;
  // A window longer than what follows: jogging is drawn as often, with a window from elsewhere.
  EXPECT_EQ(draw_batch(data, 20, 16, padding_of(data), 1, 1).classes.sum().item<std::int64_t>(), 20);
}

TEST(Segments, ChangeTheDigest) {
  const TemporaryFolder folder;
  const auto digest = [&](std::int64_t at) {
    write_archive(folder / "a.h5", {parts("b", {}, {{0, at, {{"action", "walking"}}}, {at, 20 - at, {{"action", "jogging"}}}})});
    return load(folder / "a.h5").digest();
  };
  EXPECT_NE(digest(8), digest(9));
  EXPECT_EQ(digest(8), digest(8));
}

// Clips w0, w1 walk, j0, j1 jog; u has no label, but probabilities.
struct Partly {
  TemporaryFolder folder;
  std::string path = folder / "p.h5";
  explicit Partly(const std::map<std::string, float>& p, const std::vector<Segment>& segments = {}) {
    std::vector<Clip> clips = {labelled("w0", 20, {{"action", "walking"}}), labelled("w1", 20, {{"action", "walking"}}), labelled("j0", 20, {{"action", "jogging"}}), labelled("j1", 20, {{"action", "jogging"}}), parts("u", {}, segments), labelled("none", 20, {})};
    clips[4].attribute_probability["action"] = p;
    auto header = testing::header_for(clips[0]);
    header.attribute_classes["action"] = {"jogging", "jumping", "walking"};
    store::ArchiveWriter writer(path, Overwrite::allow, header);
    for (const Clip& clip : clips) writer.add(clip);
    writer.finish();
  }
  MotionDataset load(Unlabelled unlabelled, const MotionDataset* like = nullptr) const { return MotionDataset(path, RotationRepresentation::quaternion, {}, like, unlabelled); }
};

TEST(Unlabelled, IsLeftOutUnlessFilled) {
  const Partly partly({{"jogging", 0.25f}, {"jumping", 0.05f}, {"walking", 0.7f}});
  const MotionDataset drop = partly.load(Unlabelled::drop), fill = partly.load(Unlabelled::fill);
  EXPECT_EQ(drop.clips().size(), 4u);
  EXPECT_EQ(drop.left_out(), 2u);
  EXPECT_EQ(drop.fillable(), 1u);
  EXPECT_EQ(drop.filled(), 0u);
  ASSERT_EQ(fill.clips().size(), 5u);
  EXPECT_EQ(fill.left_out(), 1u);
  EXPECT_EQ(fill.filled(), 1u);
  EXPECT_EQ(fill.vocabulary(), (Vocabulary{{"action", {"jogging", "walking"}}})) << "nobody jumps for sure";
  EXPECT_EQ(fill.clips()[4].classes, (Classes{1}));
  ASSERT_EQ(fill.clips()[4].spans.size(), 1u);
  EXPECT_EQ(fill.clips()[4].spans[0].classes, (Classes{kFilled}));
  ASSERT_EQ(fill.members().at({0}).size(), 3u);
  EXPECT_NEAR(fill.members().at({0})[2].weight, 0.25 / 0.95, 1e-6);
  EXPECT_NEAR(fill.members().at({1})[2].weight, 0.7 / 0.95, 1e-6);
  EXPECT_NE(drop.digest(), fill.digest());
  EXPECT_NE(Partly({{"jogging", 0.3f}, {"jumping", 0.0f}, {"walking", 0.7f}}).load(Unlabelled::fill).digest(), fill.digest()) << "the probabilities decide the batches";
  EXPECT_FALSE(fixed_batch(fill, {4}, 9, padding_of(fill)).frame_classes.defined());
  EXPECT_EQ(fixed_batch(fill, {4}, 9, padding_of(fill)).classes.item<std::int64_t>(), 1);
}

// Of the draws of jogging the share that u has is the probability that u jogs, against two clips that do for sure.
TEST(Unlabelled, ClassesAreDrawnFromTheProbabilities) {
  const Partly partly({{"jogging", 0.25f}, {"jumping", 0.0f}, {"walking", 0.75f}});
  const MotionDataset data = partly.load(Unlabelled::fill);
  const Batch batch = draw_batch(data, 6000, 20, padding_of(data), 3, 1);
  std::array<int, 2> as{}, of{};
  for (int row = 0; row < 6000; ++row) {
    const auto c = static_cast<std::size_t>(batch.classes[row].item<std::int64_t>());
    ++of[c];
    as[c] += torch::equal(batch.features[row], data.clips()[4].features);
  }
  EXPECT_NEAR(of[0], 3000, 200);
  EXPECT_NEAR(as[0], 3000 * 0.25 / 2.25, 85);
  EXPECT_NEAR(as[1], 3000 * 0.75 / 2.75, 130);
}

TEST(Unlabelled, AClassThatOnlyClassifiersSee) {
  const Partly partly({{"jogging", 0.1f}, {"jumping", 0.9f}, {"walking", 0.0f}});
  const MotionDataset data = partly.load(Unlabelled::fill);
  EXPECT_EQ(data.vocabulary().at("action"), (std::vector<std::string>{"jogging", "jumping", "walking"}));
  EXPECT_EQ(data.combinations().at({1}), (std::vector<std::size_t>{4}));
  EXPECT_EQ(data.members().at({2}).size(), 2u) << "a probability of 0 is no way to fill";
  // A validation set that has it is refused by a model that has not.
  const MotionDataset without = partly.load(Unlabelled::drop);
  Clip sure = labelled("x", 20, {});
  sure.attribute_probability["action"] = {{"jumping", 1.0f}};
  auto header = testing::header_for(sure);
  header.attribute_classes["action"] = {"jumping"};
  store::ArchiveWriter writer(partly.folder / "v.h5", Overwrite::allow, header);
  writer.add(sure);
  writer.finish();
  EXPECT_NE(refusal([&] { MotionDataset(partly.folder / "v.h5", RotationRepresentation::quaternion, {}, &without, Unlabelled::fill); }).find("v.h5:clip x: its probabilities of action are all of classes"), std::string::npos);
}

// Half a clip is labelled as jogging: the rest takes what is drawn, and the clip is a member of jogging either way.
TEST(Unlabelled, SpansBetweenLabels) {
  const Partly partly({{"jogging", 0.5f}, {"jumping", 0.0f}, {"walking", 0.5f}}, {{10, 10, {{"action", "jogging"}}}});
  const MotionDataset data = partly.load(Unlabelled::fill);
  ASSERT_EQ(data.clips()[4].spans.size(), 2u);
  EXPECT_EQ(data.clips()[4].spans[0].classes, (Classes{kFilled}));
  EXPECT_EQ(data.clips()[4].spans[1].classes, (Classes{0}));
  EXPECT_EQ(data.members().at({0}).size(), 4u);
  EXPECT_EQ(data.members().at({1}).size(), 3u);
  EXPECT_EQ(data.combinations().at({0}), (std::vector<std::size_t>{2, 3, 4}));
  const Batch batch = draw_batch(data, 400, 20, padding_of(data), 3, 1);
  int mixed = 0, whole = 0;
  for (int row = 0; row < 400; ++row) {
    if (!torch::equal(batch.features[row], data.clips()[4].features)) continue;
    const auto classes = values(batch.frame_classes[row].select(1, 0));
    EXPECT_EQ(classes[10], 0);
    EXPECT_EQ(classes[0], batch.classes[row].item<std::int64_t>());
    (classes[0] == 0 ? whole : mixed) += 1;
    EXPECT_EQ(classes[0], classes[9]);
  }
  EXPECT_GT(whole, 10);
  EXPECT_GT(mixed, 30);
}

TEST(Batches, PaddingIsTheIdentityPose) {
  const MotionDataset data = load(corpus().path);
  const torch::Tensor padding = padding_of(data);
  for (int c = 0; c < 84; ++c) {
    const auto i = static_cast<std::size_t>(c);
    EXPECT_NEAR(padding[c].item<double>() * data.deviation()[i] + data.mean()[i], c % 4 == 0 ? 1 : 0, 1e-6);
  }
  EXPECT_EQ(padding.narrow(0, 84, 6).abs().max().item<float>(), 0);
}

}  // namespace
}  // namespace mocap::train
