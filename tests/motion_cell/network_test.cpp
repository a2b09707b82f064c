#include "libmodels/motion_cell/network.hpp"

#include <gtest/gtest.h>
#include <torch/torch.h>

#include <cstring>
#include <set>

#include "libmocap/base/error.hpp"
#include "libmodels/motion_cell/packed_cell.hpp"
#include "libmodels/nn/blas.hpp"
#include "libmodels/nn/sharded.hpp"
#include "tests/motion_cell/reference.hpp"

namespace mocap::motion_cell {
namespace {

using torch::Tensor;

struct OneThread : testing::Environment {
  void SetUp() override { nn::use_one_blas_thread(); }
};
const auto* const kEnvironment = testing::AddGlobalTestEnvironment(new OneThread);

MotionCellConfig tiny() {
  MotionCellConfig c;
  c.joints = 2, c.rotation_values = 3, c.root_values = 1, c.hidden = 10, c.width = 9, c.word = 6, c.latent = 5,
  c.control = 3;
  c.attribute_classes = {3, 2};
  return c;
}

MotionCellConfig tiny_single_layer() {
  MotionCellConfig c = tiny();
  c.single_layer = true;
  c.word_length = 1;
  return c;
}

// A scalar that depends on every output with different weights.
Tensor scalar(const CellOutput& out) {
  const auto weights = [](const Tensor& t) {
    return torch::linspace(-1, 2, t.numel(), t.options()).reshape(t.sizes());
  };
  return (out.y * weights(out.y)).sum() + (out.kl * weights(out.kl)).sum() +
         (out.words.square() * weights(out.words)).sum();
}

double relative_difference(const Tensor& a, const Tensor& b) {
  return ((a - b).abs().max() / b.abs().max().clamp_min(1e-300)).item<double>();
}

void expect_equals_reference(double replace_share, bool changing, const MotionCellConfig& config = tiny()) {
  MotionCell cell(config, 4);
  cell.to(torch::kDouble);
  const CellInput in = random_input(cell.config(), 4, 7, replace_share, changing, torch::kDouble);
  const CellOutput ours = cell.forward(in), theirs = reference_forward(cell, in);
  EXPECT_LT((ours.y - theirs.y).abs().max().item<double>(), 1e-12);
  EXPECT_LT(((ours.kl - theirs.kl) / theirs.kl).abs().max().item<double>(), 1e-12);
  EXPECT_LT((ours.words - theirs.words).abs().max().item<double>(), 1e-12);
  const auto parameters = cell.parameters();
  const auto names = nn::parameters_by_path(cell);
  const auto a = torch::autograd::grad({scalar(ours)}, parameters),
             b = torch::autograd::grad({scalar(theirs)}, parameters);
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_LT(relative_difference(a[i], b[i]), 1e-9) << names[i].first;
}

TEST(MotionCell, EqualsAlgorithm1TeacherForcing) { expect_equals_reference(-1, false); }
TEST(MotionCell, EqualsAlgorithm1OwnOutputs) { expect_equals_reference(0.5, false); }
TEST(MotionCell, EqualsAlgorithm1OwnOutputsOnly) { expect_equals_reference(1, false); }
TEST(MotionCell, EqualsAlgorithm1ChangingAttributes) {
  expect_equals_reference(-1, true);
  expect_equals_reference(0.5, true);
}

TEST(MotionCell, OverlappingWordsEqualAlgorithm1) {
  for (const int overlap : {1, 2, 3}) {
    MotionCellConfig c = tiny();
    c.overlap = overlap;
    expect_equals_reference(0.5, overlap == 2, c);
    EXPECT_EQ(MotionCell::parameter_count(c), MotionCell(c, 4).parameter_count());
    EXPECT_EQ(config_from_json(to_json(c)), c);
  }
  MotionCellConfig c = tiny();
  c.overlap = 4;  // of words of three frames
  EXPECT_THROW(c.validate(), Error);
  c = tiny_single_layer();
  c.overlap = 1;
  EXPECT_THROW(c.validate(), Error);
  nlohmann::json old = to_json(tiny());
  old.erase("overlap");
  EXPECT_EQ(config_from_json(old).overlap, 0);
  for (const nlohmann::json& bad : {nlohmann::json(-1), nlohmann::json(1.5), nlohmann::json("2"), nlohmann::json(4000000000)}) {
    old["overlap"] = bad;
    EXPECT_THROW(config_from_json(old), Error) << bad;
  }
}

TEST(MotionCell, SingleLayerEqualsAlgorithm1) {
  for (const double own : {-1.0, 0.5, 1.0}) expect_equals_reference(own, false, tiny_single_layer());
  expect_equals_reference(0.5, true, tiny_single_layer());
}

TEST(MotionCell, SingleLayerHasNeitherEncoderNorDecoderOfWords) {
  const MotionCell cell(tiny_single_layer(), 4);
  EXPECT_EQ(cell.word_encoder, nullptr);
  EXPECT_EQ(cell.word_decoder, nullptr);
  EXPECT_EQ(MotionCell::parameter_count(cell.config()), cell.parameter_count());
  EXPECT_FALSE(cell.decoder->activate_last()) << "frames have both signs";
  for (const auto& [path, tensor] : nn::parameters_by_path(cell)) EXPECT_FALSE(path.starts_with("word_encoder") || path.starts_with("word_decoder")) << path;
  const CellInput in = random_input(cell.config(), 2, 3, -1);
  EXPECT_TRUE(torch::equal(cell.autoencode(in.x), in.x));
}

TEST(MotionCell, GradientsAgainstFiniteDifferences) {
  MotionCell cell(tiny(), 4);
  cell.to(torch::kDouble);
  const CellInput in = random_input(cell.config(), 3, 4, 0.5, false, torch::kDouble);
  const auto parameters = nn::parameters_by_path(cell);
  const auto gradients = torch::autograd::grad({scalar(cell.forward(in))}, cell.parameters());
  const torch::NoGradGuard guard;
  for (std::size_t p = 0; p < parameters.size(); ++p) {
    const std::int64_t entry = parameters[p].second.numel() / 2;
    double* value = parameters[p].second.view({-1}).data_ptr<double>() + entry;
    const double before = *value, step = 1e-5;
    *value = before + step;
    const double up = scalar(cell.forward(in)).item<double>();
    *value = before - step;
    const double down = scalar(cell.forward(in)).item<double>();
    *value = before;
    const double numeric = (up - down) / (2 * step);
    EXPECT_NEAR(gradients[p].reshape({-1})[entry].item<double>(), numeric, 2e-6 * std::max(1.0, std::abs(numeric)))
        << parameters[p].first;
  }
}

TEST(MotionCell, NoReplacementEqualsTeacherForcing) {
  const MotionCell cell(tiny(), 4);
  CellInput in = random_input(cell.config(), 4, 5, 0);
  const Tensor masked = cell.forward(in).y;
  in.replace = Tensor();
  EXPECT_TRUE(torch::equal(cell.forward(in).y, masked));
}

TEST(MotionCell, PaperSizesAndNames) {
  const MotionCell cell(MotionCellConfig::preset("paper"), 1);
  EXPECT_EQ(cell.config().features(), 90);
  // Table 1 counted by hand, and mu and log sigma of the initial state for 8 combinations.
  EXPECT_EQ(cell.parameter_count(), 3844934 + 2 * 8 * 1024);
  std::set<std::string> names;
  for (const auto& [path, tensor] : nn::parameters_by_path(cell)) names.insert(path);
  for (const char* name : {"word_encoder/0/weight", "word_decoder/2/bias", "posterior_sigma/4/weight",
                           "prior_mu/0/bias", "decoder/2/weight", "control_features/0/weight", "gru_1/weight_ih",
                           "gru_2/bias_hh", "initial_state/mu", "initial_state/log_sigma"})
    EXPECT_TRUE(names.contains(name)) << name;
  EXPECT_EQ(MotionCell(MotionCellConfig::preset("small"), 1).config().hidden, 256);
  EXPECT_NEAR(cell.initial_log_sigma.exp().mean().item<double>(), 0.5, 1e-6);
}

TEST(MotionCell, SeedDecidesEverything) {
  const MotionCell a(tiny(), 4), b(tiny(), 4), c(tiny(), 5);
  const CellInput in = random_input(a.config(), 2, 3, -1);
  EXPECT_TRUE(torch::equal(a.forward(in).y, b.forward(in).y));
  EXPECT_FALSE(torch::equal(a.forward(in).y, c.forward(in).y));
}

TEST(MotionCell, AutoencodeIsEncoderThenDecoder) {
  const MotionCell cell(tiny(), 4);
  const CellInput in = random_input(cell.config(), 2, 3, -1);
  const Tensor y = cell.autoencode(in.x);
  const Tensor one = plain(*cell.word_decoder, plain(*cell.word_encoder, in.x[1].slice(0, 3, 6).reshape({1, -1})));
  EXPECT_LT((y[1].slice(0, 3, 6).reshape({1, -1}) - one).abs().max().item<double>(), 1e-5);
  MotionCellConfig overlapping = tiny();
  overlapping.overlap = 2;
  EXPECT_EQ(MotionCell(overlapping, 4).autoencode(in.x).sizes(), in.x.sizes());
}

TEST(MotionCell, WrongShapesAndClassesAreRefused) {
  const MotionCell cell(tiny(), 4);
  const CellInput good = random_input(cell.config(), 2, 3, 0.5);
  const auto refused = [&](auto change) {
    CellInput in = good;
    change(in);
    EXPECT_THROW((void)cell.forward(in), Error);
  };
  refused([](CellInput& in) { in.x = in.x.slice(1, 0, 8); });
  refused([](CellInput& in) { in.x = in.x.slice(1, 0, 0); });
  refused([](CellInput& in) { in.x = Tensor(); });
  refused([](CellInput& in) { in.x = in.x.slice(2, 0, 5); });
  refused([](CellInput& in) { in.classes = in.classes.slice(1, 0, 1); });
  refused([](CellInput& in) { in.classes = in.classes + 7; });
  refused([](CellInput& in) { in.posterior_noise = Tensor(); });
  refused([](CellInput& in) { in.initial_noise = in.initial_noise.slice(0, 0, 1); });
  refused([](CellInput& in) { in.replace = in.replace.slice(0, 0, 2); });
}

std::vector<Tensor> sharded_gradients(const MotionCell& cell, const CellInput& in, int shards, int threads) {
  nn::ShardedGradient executor(shards, threads);
  const auto packed = cell.pack();
  return executor
      .compute(cell.parameters(),
               [&](int s) -> nn::ShardedGradient::Share {
                 const auto [first, last] = nn::shard_range(in.x.size(0), shards, s);
                 const CellOutput out =
                     cell.forward({in.x.slice(0, first, last), in.classes.slice(0, first, last),
                                   in.posterior_noise.slice(1, first, last), in.initial_noise.slice(0, first, last),
                                   in.replace.defined() ? in.replace.slice(1, first, last) : Tensor()},
                                  packed);
                 return {out.y.square().sum() + out.kl.sum(), {}};
               })
      .gradients;
}

TEST(MotionCell, ShardsGiveTheSameBitsOnAnyThreadsAndInstructionSet) {
  MotionCellConfig c = tiny();
  c.hidden = 40, c.width = 33;
  const MotionCell cell(c, 4);
  const CellInput in = random_input(c, 9, 5, 0.5);
  const auto whole = sharded_gradients(cell, in, 1, 1), expected = sharded_gradients(cell, in, 4, 1);
  for (int repeat = 0; repeat < 5; ++repeat) {
    const auto again = sharded_gradients(cell, in, 4, 3);
    for (std::size_t i = 0; i < expected.size(); ++i) ASSERT_TRUE(torch::equal(again[i], expected[i])) << i;
  }
  for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_LT(relative_difference(expected[i], whole[i]), 1e-4) << i;
  if (nn::best_isa() == nn::Isa::avx512) {
    nn::limit_isa(nn::Isa::avx2);
    const auto narrow = sharded_gradients(cell, in, 4, 2);
    nn::limit_isa(nn::Isa::avx512);
    for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_TRUE(torch::equal(narrow[i], expected[i])) << i;
  }
}

TEST(MotionCell, StalePackedWeightsAreTheCallersFault) {
  // pack() is a snapshot: a step that changes parameters needs a new one.
  MotionCell cell(tiny(), 4);
  const CellInput in = random_input(cell.config(), 2, 3, -1);
  const auto packed = cell.pack();
  const Tensor before = cell.forward(in, packed).y;
  {
    const torch::NoGradGuard guard;
    cell.gru_1->weight_hh.mul_(2);
  }
  EXPECT_TRUE(torch::equal(cell.forward(in, packed).y, before));
  EXPECT_FALSE(torch::equal(cell.forward(in).y, before));
}

TEST(Config, JsonRoundTripAndRefusals) {
  MotionCellConfig c = tiny();
  EXPECT_EQ(config_from_json(to_json(c)), c);
  EXPECT_EQ(config_from_json(nlohmann::json::parse(to_json(MotionCellConfig::preset("paper")).dump())),
            MotionCellConfig::preset("paper"));
  const auto message = [](nlohmann::json json) -> std::string {
    try {
      (void)config_from_json(json);
    } catch (const Error& e) {
      EXPECT_EQ(e.status(), Exit::data);
      return e.message();
    }
    return "";
  };
  const auto with = [&](const char* key, nlohmann::json value) {
    nlohmann::json json = to_json(c);
    json[key] = std::move(value);
    return json;
  };
  nlohmann::json missing = to_json(c);
  missing.erase("latent");
  EXPECT_EQ(message(missing), "no latent, expected the sizes of a motion cell");
  EXPECT_EQ(message(with("hidden", 0)), "hidden is 0, expected a whole number in 1..65536");
  EXPECT_EQ(message(with("hidden", 1e12)), "hidden is 1000000000000.0, expected a whole number in 1..65536");
  EXPECT_EQ(message(with("width", "x")), "width is \"x\", expected a whole number in 1..65536");
  EXPECT_EQ(message(with("attribute_classes", 3)), "attribute_classes is number, expected a list of sizes");
  EXPECT_EQ(message(with("attribute_classes", nlohmann::json::array())),
            "attribute_classes is empty, expected at least one attribute");
  EXPECT_FALSE(message(with("attribute_classes", {1000, 1000})).empty());
  EXPECT_FALSE(message(nlohmann::json::array()).empty());
  EXPECT_EQ(config_from_json(to_json(tiny_single_layer())), tiny_single_layer());
  EXPECT_EQ(message(with("single_layer", true)), "word_length is 3 with single_layer, expected 1");
  EXPECT_EQ(message(with("single_layer", 1)), "single_layer is neither true nor false");
  nlohmann::json older = to_json(c);
  older.erase("single_layer");
  EXPECT_EQ(config_from_json(older), c);
  EXPECT_THROW(MotionCellConfig::preset("huge"), Error);
}

}  // namespace
}  // namespace mocap::motion_cell
