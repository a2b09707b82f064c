#include "libmodels/train/dataset.hpp"

#include <fmt/core.h>
#include <gtest/gtest.h>

#include <cmath>

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
