#include "libmodels/generators/generator.hpp"

#include <fmt/core.h>
#include <gtest/gtest.h>

#include <functional>
#include <nlohmann/json.hpp>

#include "libmocap/base/error.hpp"
#include "libmodels/baselines/network.hpp"
#include "libmodels/motion_cell/network.hpp"
#include "libmodels/nn/blas.hpp"
#include "libmodels/nn/mlp.hpp"
#include "libmodels/train/tensors.hpp"
#include "tests/store/sample_clips.hpp"

namespace mocap::generators {
namespace {

using mocap::testing::TemporaryFolder;

struct OneThread : ::testing::Environment {
  void SetUp() override { nn::use_one_blas_thread(); }
};
const auto* const kEnvironment = ::testing::AddGlobalTestEnvironment(new OneThread);

motion_cell::MotionCellConfig small_network() {
  motion_cell::MotionCellConfig c;
  c.hidden = 24, c.width = 20, c.word = 12, c.latent = 8;
  c.attribute_classes = {2, 3};
  return c;
}

store::ModelFile random_model() {
  const auto network = small_network();
  const motion_cell::MotionCell cell(network, 5);
  store::ModelFile m;
  m.kind = "motion-cell";
  m.config = nlohmann::json{{"network", motion_cell::to_json(network)}, {"representation", "quaternion"}, {"frame_rate_hz", 30.0}, {"contacts", "preset:default"}, {"combinations", {{0, 0}, {0, 2}, {1, 0}, {1, 2}}}, {"default_frames", 45}}.dump();
  m.skeleton = canonical_body();
  m.weights = train::to_stored(nn::parameters_by_path(cell));
  m.mean.assign(90, 0.0f);
  m.deviation.assign(90, 0.2f);
  for (std::size_t c = 0; c < 84; c += 4) m.mean[c] = 1;
  m.mean[86] = 0.9f;
  m.vocabulary = {{"action", {"jump", "walk"}}, {"mood", {"glad", "plain", "sad"}}};
  return m;
}

store::ModelFile random_baseline(baselines::Arch arch) {
  store::ModelFile m = random_model();
  baselines::BaselineConfig c;
  c.arch = arch, c.hidden = 24, c.width = 20, c.narrow = 16, c.attribute_classes = {2, 3};
  m.kind = baselines::text(arch);
  auto json = nlohmann::json::parse(m.config);
  json["network"] = baselines::to_json(c);
  m.config = json.dump();
  m.weights = train::to_stored(nn::parameters_by_path(baselines::Network(c, m.mean, m.deviation, 5)));
  return m;
}
const baselines::Arch kBaselines[] = {baselines::Arch::quaternet, baselines::Arch::erd};

std::vector<ClipOrder> orders(std::size_t count, std::int64_t frames) {
  std::vector<ClipOrder> out;
  for (std::size_t i = 0; i < count; ++i)
    out.push_back({fmt::format("clip{}", i), {{"action", i % 2 ? "walk" : "jump"}, {"mood", i % 3 ? "sad" : "glad"}}, frames, i});
  return out;
}

void expect_same(const Clip& a, const Clip& b) {
  ASSERT_EQ(a.frames(), b.frames());
  for (std::size_t i = 0; i < a.rotations.size(); ++i) ASSERT_EQ(a.rotations[i].coeffs(), b.rotations[i].coeffs()) << i;
  for (std::size_t t = 0; t < a.frames(); ++t) ASSERT_EQ(a.root_position[t], b.root_position[t]) << t;
  EXPECT_EQ(a.contacts, b.contacts);
  EXPECT_EQ(a.attributes, b.attributes);
}

std::string refusal(const store::ModelFile& model) {
  try {
    (void)make_generator(model, "m.h5");
  } catch (const Error& e) {
    return (e.status() == Exit::data ? "" : "another status: ") + std::string(e.what());
  }
  return "none";
}

TEST(Generator, SurvivesTheModelFile) {
  const TemporaryFolder folder;
  const store::ModelFile model = random_model();
  store::write_model(folder / "m.h5", Overwrite::refuse, model);
  const auto direct = make_generator(model, "m"), read = make_generator(store::read_model(folder / "m.h5"), folder / "m.h5");
  EXPECT_EQ(read->kind(), "motion-cell");
  EXPECT_EQ(read->vocabulary(), model.vocabulary);
  EXPECT_EQ(read->frame_rate_hz(), 30);
  EXPECT_EQ(read->contacts_rule(), "preset:default");
  EXPECT_EQ(read->default_frames(), 45);
  ASSERT_EQ(read->combinations().size(), 4u);
  EXPECT_EQ(read->combinations()[1], (Attributes{{"action", "jump"}, {"mood", "sad"}}));
  EXPECT_TRUE(read->skeleton()->same_as(*canonical_body(), 1e-6));
  const auto a = direct->sample(orders(4, 20), {}), b = read->sample(orders(4, 20), {});
  for (std::size_t i = 0; i < 4; ++i) expect_same(a[i], b[i]);
}

TEST(Generator, AClipDoesNotDependOnItsCompany) {
  const auto generator = make_generator(random_model(), "m");
  SampleSettings one, two;
  two.threads = 2;
  const auto eight = generator->sample(orders(8, 31), one), twenty = generator->sample(orders(20, 31), two);
  for (std::size_t i = 0; i < 8; ++i) expect_same(eight[i], twenty[i]);
  expect_same(generator->sample({orders(8, 31)[7]}, two)[0], eight[7]);
  // A longer clip begins as the shorter one.
  const Clip longer = generator->sample({orders(8, 60)[7]}, one)[0];
  for (std::size_t i = 0; i < eight[7].rotations.size(); ++i) ASSERT_LT(longer.rotations[i].angularDistance(eight[7].rotations[i]), 1e-9);
}

TEST(Generator, ClipsAreWhatWasAskedFor) {
  const auto generator = make_generator(random_model(), "m");
  for (const std::int64_t frames : {1, 2, 3, 50}) {
    const auto clips = generator->sample(orders(3, frames), {});
    ASSERT_EQ(clips.size(), 3u);
    for (std::size_t i = 0; i < 3; ++i) {
      const Clip& c = clips[i];
      EXPECT_NO_THROW(c.validate());
      EXPECT_EQ(c.name, fmt::format("clip{}", i));
      EXPECT_EQ(c.frames(), static_cast<std::size_t>(frames));
      EXPECT_EQ(c.contacts.size(), c.frames());
      EXPECT_EQ(c.attributes.at("mood"), i % 3 ? "sad" : "glad");
      EXPECT_LT(c.root_position[0].head<2>().norm(), 1e-9) << "the first frame is above the origin";
      EXPECT_NEAR(std::atan2(c.rotations[0].z(), c.rotations[0].w()), 0, 1e-9) << "heading 0";
    }
  }
}

TEST(Generator, SeedStreamClassesAndNoiseMatter) {
  const auto generator = make_generator(random_model(), "m");
  const auto first = [&](const std::vector<ClipOrder>& o, std::uint64_t seed = 1, double noise = 1) {
    SampleSettings s;
    s.seed = seed;
    s.noise_scale = noise;
    return generator->sample(o, s)[0].rotations[40 * 22 + 5].coeffs().eval();
  };
  const auto order = orders(1, 45);
  const auto base = first(order);
  EXPECT_EQ(first(order), base);
  EXPECT_NE(first(order, 2), base);
  EXPECT_NE(first(order, 1, 0), base);
  auto other = order;
  other[0].stream = 9;
  EXPECT_NE(first(other), base);
  other = order;
  other[0].attributes["mood"] = "plain";
  EXPECT_NE(first(other), base);
}

TEST(Generator, AttributesChangeAsScheduled) {
  const auto generator = make_generator(random_model(), "m");
  EXPECT_EQ(generator->schedule_step(), 3);
  ClipOrder order = orders(1, 45)[0];  // jumps, glad
  const Clip plain = generator->sample({order}, {})[0];
  EXPECT_TRUE(plain.segments.empty());
  order.schedule = {{15, {{"action", "walk"}, {"mood", "glad"}}}, {30, {{"action", "jump"}, {"mood", "glad"}}}};
  const Clip changed = generator->sample({order}, {})[0];
  EXPECT_NO_THROW(changed.validate());
  ASSERT_EQ(changed.segments.size(), 3u);
  EXPECT_EQ(changed.segments[1].start, 15);
  EXPECT_EQ(changed.segments[1].length, 15);
  EXPECT_EQ(changed.segments[1].attributes, (Attributes{{"action", "walk"}, {"mood", "glad"}}));
  EXPECT_EQ(changed.segments[2].attributes.at("action"), "jump");
  EXPECT_EQ(changed.attributes, (Attributes{{"mood", "glad"}})) << "of the whole clip, what does not change";
  for (std::size_t i = 0; i < 15 * 22; ++i) ASSERT_LT(changed.rotations[i].angularDistance(plain.rotations[i]), 1e-9) << "the same up to the change";
  double far = 0;
  for (std::size_t i = 15 * 22; i < 45 * 22; ++i) far = std::max(far, changed.rotations[i].angularDistance(plain.rotations[i]));
  EXPECT_GT(far, 1e-4);
  // A change to what it was before changes nothing but the labels.
  order.schedule = {{15, order.attributes}};
  const Clip same = generator->sample({order}, {})[0];
  EXPECT_EQ(same.rotations.back().coeffs(), plain.rotations.back().coeffs());
  EXPECT_EQ(same.attributes, order.attributes);
  EXPECT_EQ(same.segments.size(), 2u);
  // Within a word, at the start or backwards: a bug of the caller.
  for (const std::int64_t frame : {1, 0, 16}) {
    order.schedule[0].frame = frame;
    EXPECT_THROW((void)generator->sample({order}, {}), Error) << frame;
  }
}

TEST(BaselineGenerator, AClipDoesNotDependOnItsCompanyOrTheFile) {
  for (const auto arch : kBaselines) {
    const TemporaryFolder folder;
    const store::ModelFile model = random_baseline(arch);
    store::write_model(folder / "m.h5", Overwrite::refuse, model);
    const auto generator = make_generator(model, "m"), read = make_generator(store::read_model(folder / "m.h5"), folder / "m.h5");
    EXPECT_EQ(read->kind(), baselines::text(arch));
    EXPECT_EQ(read->vocabulary(), model.vocabulary);
    EXPECT_EQ(read->combinations().size(), 4u);
    EXPECT_EQ(read->default_frames(), 45);
    SampleSettings two;
    two.threads = 2;
    const auto eight = generator->sample(orders(8, 31), {}), twenty = generator->sample(orders(20, 31), two);
    for (std::size_t i = 0; i < 8; ++i) expect_same(eight[i], twenty[i]);
    expect_same(read->sample({orders(8, 31)[7]}, two)[0], eight[7]);
    for (const auto& clip : eight) {
      EXPECT_NO_THROW(clip.validate());
      EXPECT_EQ(clip.contacts.size(), 31u);
      EXPECT_LT(clip.root_position[0].head<2>().norm(), 1e-9) << "the first frame is above the origin";
    }
    // Without noise the clips of a combination are one motion.
    SampleSettings mean;
    mean.noise_scale = 0;
    const auto a = generator->sample(orders(13, 9), mean), b = generator->sample(orders(13, 9), {});
    EXPECT_EQ(a[0].rotations[5].coeffs(), a[6].rotations[5].coeffs());
    EXPECT_NE(b[0].rotations[5].coeffs(), b[6].rotations[5].coeffs());
    EXPECT_NE(a[0].rotations[5].coeffs(), a[1].rotations[5].coeffs());
    auto unset = orders(1, 9);
    unset[0].attributes.erase("mood");
    EXPECT_THROW((void)generator->sample(unset, {}), Error);
  }
}

TEST(BaselineGenerator, DamagedFiles) {
  for (const auto arch : kBaselines) {
    EXPECT_EQ(refusal(random_baseline(arch)), "none");
    const auto expect = [&](const std::string& words, const std::function<void(store::ModelFile&, nlohmann::json&)>& change) {
      auto m = random_baseline(arch);
      auto json = nlohmann::json::parse(m.config);
      change(m, json);
      m.config = json.dump();
      const std::string what = refusal(m);
      EXPECT_EQ(what.rfind("m.h5:", 0), 0u) << words << ": " << what;
      EXPECT_NE(what.find(words), std::string::npos) << words << ": " << what;
    };
    const std::string kind = baselines::text(arch);
    expect("not the configuration of a " + kind + " network", [](auto&, auto& j) { j.erase("network"); });
    expect("no hidden, expected the sizes of a " + kind, [](auto&, auto& j) { j["network"].erase("hidden"); });
    expect("representation 'spin'", [](auto&, auto& j) { j["representation"] = "spin"; });
    expect("another number of values", [](auto&, auto& j) { j["representation"] = "rotation-matrix"; });
    expect("predicts quaternions", [](auto&, auto& j) { j["network"]["rotation_values"] = 9; });
    expect("default_frames", [](auto&, auto& j) { j["default_frames"] = 0; });
    expect("joints", [](auto&, auto& j) { j["network"]["joints"] = 20; });
    expect("does not have", [](auto&, auto& j) { j["combinations"] = {{0, 3}}; });
    expect("weights: ", [](auto&, auto& j) { j["network"]["hidden"] = 65536; });
    expect("weights: ", [](auto& m, auto&) { m.weights.clear(); });
    expect("weights/decoder/0/weight: a value", [](auto& m, auto&) { m.weights["decoder/0/weight"].values[3] = std::numeric_limits<float>::infinity(); });
    expect("weights/", [](auto& m, auto&) { std::swap(m.weights["decoder/0/weight"], m.weights["start/0/weight"]); });
    expect("normalization: 0 means and 0 deviations, expected 90", [](auto& m, auto&) { m.mean.clear(), m.deviation.clear(); });
    expect("vocabulary/mood", [](auto& m, auto&) { m.vocabulary["mood"].pop_back(); });
    // The other baseline's weights.
    expect("weights", [&](auto& m, auto&) { m.kind = arch == baselines::Arch::erd ? "quaternet" : "erd"; });
  }
}

TEST(Generator, AnotherKindNamesThoseThatGenerate) {
  auto m = random_model();
  m.kind = "classifier";
  EXPECT_EQ(refusal(m), "m.h5: a model of kind 'classifier', expected one that generates motion (motion-cell, quaternet, erd, lstm-gmm, cae-vae)");
}

TEST(Generator, DamagedConfigurations) {
  EXPECT_EQ(refusal(random_model()), "none");
  const auto with = [](const std::function<void(nlohmann::json&)>& change) {
    auto m = random_model();
    auto json = nlohmann::json::parse(m.config);
    change(json);
    m.config = json.dump();
    return refusal(m);
  };
  const auto expect = [&](const char* words, const std::function<void(nlohmann::json&)>& change) {
    const std::string what = with(change);
    EXPECT_EQ(what.rfind("m.h5:", 0), 0u) << words << ": " << what;
    EXPECT_NE(what.find(words), std::string::npos) << words << ": " << what;
  };
  for (const char* text : {"", "{", "[]", "3", "null", "{\"network\":{}}"}) {
    auto m = random_model();
    m.config = text;
    EXPECT_EQ(refusal(m).rfind("m.h5:config: not the configuration of a Motion Cell", 0), 0u) << text << ": " << refusal(m);
  }
  for (const char* key : {"network", "representation", "frame_rate_hz", "contacts", "combinations", "default_frames"}) expect("config", [&](auto& j) { j.erase(key); });
  expect("representation 'spin'", [](auto& j) { j["representation"] = "spin"; });
  expect("another number of values", [](auto& j) { j["representation"] = "rotation-matrix"; });
  expect("config", [](auto& j) { j["contacts"] = "preset:unheard-of"; });
  for (const auto& rate : std::vector<nlohmann::json>{0, -30, 1e300, nullptr, "30"}) expect("config", [&](auto& j) { j["frame_rate_hz"] = rate; });
  for (const auto& frames : std::vector<nlohmann::json>{0, -1, 1e300, 45.5, 1000001, ~std::uint64_t{0}, "45"}) expect("default_frames", [&](auto& j) { j["default_frames"] = frames; });
  expect("one for each attribute", [](auto& j) { j["combinations"] = {{0}}; });
  expect("does not have", [](auto& j) { j["combinations"] = {{0, 3}}; });
  expect("config", [](auto& j) { j["combinations"] = 7; });
  expect("joints", [](auto& j) { j["network"]["joints"] = 20; });
  expect("joints", [](auto& j) { j["network"].erase("joints"); });
  expect("hidden is -1", [](auto& j) { j["network"]["hidden"] = -1; });
  expect("hidden is array", [](auto& j) { j["network"]["hidden"] = nlohmann::json::array({1}); });
  expect("another number of values", [](auto& j) { j["network"]["root_values"] = 7; });
  expect("attribute_classes", [](auto& j) { j["network"]["attribute_classes"] = {70000, 70000}; });
  // Sizes that would take all memory, were they believed.
  for (const char* key : {"hidden", "width", "word", "latent", "control", "word_length"}) expect("weights: ", [&](auto& j) { j["network"][key] = 65536; });
  expect("weights: ", [](auto& j) { j["network"]["hidden"] = 25; });
}

TEST(Generator, DeepConfigurationsDoNotOverflowTheStack) {
  auto m = random_model();
  const std::string deep = std::string(2000000, '[') + std::string(2000000, ']');
  m.config = R"({"network":{"joints":)" + deep + R"(},"representation":"quaternion","frame_rate_hz":30,"contacts":"","combinations":[[0,0]],"default_frames":45})";
  EXPECT_NE(refusal(m).find("joints is array"), std::string::npos);
}

TEST(Generator, DamagedParts) {
  const auto with = [](const std::function<void(store::ModelFile&)>& change) {
    auto m = random_model();
    change(m);
    return refusal(m);
  };
  const auto expect = [&](const char* words, const std::function<void(store::ModelFile&)>& change) {
    EXPECT_EQ(with(change).rfind(words, 0), 0u) << words << ": " << with(change);
  };
  expect("m.h5:vocabulary/mood: ", [](auto& m) { m.vocabulary["mood"].pop_back(); });
  expect("m.h5:vocabulary: ", [](auto& m) { m.vocabulary.erase("mood"); });
  expect("m.h5:vocabulary: ", [](auto& m) { m.vocabulary["more"] = {"a"}; });
  expect("m.h5:skeleton: ", [](auto& m) { m.skeleton = mocap::testing::one_joint(); });
  expect("m.h5:skeleton: ", [](auto& m) { m.skeleton = nullptr; });
  expect("m.h5:normalization: 0 means and 0 deviations, expected 90", [](auto& m) { m.mean.clear(), m.deviation.clear(); });
  expect("m.h5:normalization: ", [](auto& m) { m.mean[3] = std::numeric_limits<float>::quiet_NaN(); });
  expect("m.h5:normalization: ", [](auto& m) { m.deviation[3] = std::numeric_limits<float>::infinity(); });
  expect("m.h5:normalization: ", [](auto& m) { m.deviation[3] = 0; });
  expect("m.h5:weights/decoder/0/weight: a value", [](auto& m) { m.weights["decoder/0/weight"].values[3] = std::numeric_limits<float>::quiet_NaN(); });
  expect("m.h5:weights: ", [](auto& m) { m.weights.clear(); });
  expect("m.h5:weights/", [](auto& m) { std::swap(m.weights["gru_1/weight_ih"], m.weights["decoder/0/weight"]); });
  expect("m.h5:weights/", [](auto& m) {
    auto node = m.weights.extract("decoder/0/weight");
    node.key() = "decoder/7/weight";
    m.weights.insert(std::move(node));
  });
}

TEST(Generator, ParameterCountOfSizes) {
  auto c = small_network();
  EXPECT_EQ(motion_cell::MotionCell::parameter_count(c), motion_cell::MotionCell(c, 1).parameter_count());
  c = motion_cell::MotionCellConfig::preset("small");
  EXPECT_EQ(motion_cell::MotionCell::parameter_count(c), motion_cell::MotionCell(c, 1).parameter_count());
  c.joints = 7, c.rotation_values = 9, c.word_length = 2, c.overlap = 1, c.control = 5, c.attribute_classes = {3};
  EXPECT_EQ(motion_cell::MotionCell::parameter_count(c), motion_cell::MotionCell(c, 1).parameter_count());
}

TEST(Generator, AttributesThatWereNotSetAreABug) {
  const auto generator = make_generator(random_model(), "m");
  auto o = orders(1, 9);
  o[0].attributes.erase("mood");
  EXPECT_THROW((void)generator->sample(o, {}), Error);
  o[0].attributes["mood"] = "furious";
  EXPECT_THROW((void)generator->sample(o, {}), Error);
}

}  // namespace
}  // namespace mocap::generators
