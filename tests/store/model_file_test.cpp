#include "libmocap/store/model_file.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <numeric>

#include "libmocap/base/error.hpp"
#include "libmocap/skeleton/canonical_body.hpp"
#include "tests/store/sample_clips.hpp"

namespace mocap {
namespace {

using store::ModelFile;
using store::read_model;
using store::Tensor;
using store::write_model;
using testing::refusal;
using testing::slurp;
using testing::TemporaryFolder;

const TemporaryFolder& folder() {
  static const TemporaryFolder f;
  return f;
}

Tensor counting(std::vector<std::int64_t> shape) {
  Tensor t{std::move(shape), {}};
  t.values.resize(static_cast<std::size_t>(std::accumulate(t.shape.begin(), t.shape.end(), std::int64_t{1}, std::multiplies<>())));
  std::iota(t.values.begin(), t.values.end(), 0.0f);
  return t;
}

ModelFile sample_model() {
  ModelFile m;
  m.kind = "motion-cell";
  m.config = R"({"hidden":512})";
  m.history = {{"train-vrnn", "1", "c0ffee", {"train-vrnn", "--steps=3"}, 7, {}}};
  m.skeleton = canonical_body();
  m.weights = {{"word_encoder/0/weight", counting({3, 5})}, {"word_encoder/0/bias", counting({3})}, {"scale", counting({})}, {"none", counting({0, 4})}};
  m.mean = {1, 2};
  m.deviation = {3, 4};
  m.train_sources = {std::string(64, 'a'), std::string(64, 'b')};
  m.vocabulary = {{"action", {"walking", "jogging"}}, {"how/style", {"läuft", ""}}};
  m.has_training = true;
  m.training_state = R"({"step":3})";
  m.training_tensors = {{"adam/m/word_encoder/0/weight", counting({3, 5})}};
  return m;
}

void expect_same(const std::map<std::string, Tensor>& a, const std::map<std::string, Tensor>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (const auto& [name, tensor] : a) {
    ASSERT_TRUE(b.contains(name)) << name;
    EXPECT_EQ(tensor.shape, b.at(name).shape) << name;
    EXPECT_EQ(tensor.values, b.at(name).values) << name;
  }
}

TEST(ModelFile, GivesBackWhatWasWritten) {
  const ModelFile model = sample_model();
  const std::string path = folder() / "m.h5";
  write_model(path, Overwrite::refuse, model);
  const ModelFile back = read_model(path);
  EXPECT_EQ(back.kind, model.kind);
  EXPECT_EQ(back.config, model.config);
  EXPECT_EQ(back.history.at(0).argv, model.history[0].argv);
  ASSERT_TRUE(back.skeleton);
  EXPECT_TRUE(back.skeleton->same_as(*model.skeleton));
  expect_same(model.weights, back.weights);
  EXPECT_EQ(back.mean, model.mean);
  EXPECT_EQ(back.deviation, model.deviation);
  EXPECT_EQ(back.train_sources, model.train_sources);
  EXPECT_EQ(back.vocabulary, model.vocabulary);
  EXPECT_TRUE(back.has_training);
  EXPECT_EQ(back.training_state, model.training_state);
  expect_same(model.training_tensors, back.training_tensors);
  EXPECT_EQ(store::check_model(path, true), std::vector<std::string>{});
  EXPECT_EQ(store::probe(path), "mocap-model");
}

TEST(ModelFile, GoesWithoutTrainingSkeletonAndStatistics) {
  ModelFile model;
  model.kind = "classifier";
  model.config = "{}";
  const std::string path = folder() / "bare.h5";
  write_model(path, Overwrite::refuse, model);
  const ModelFile back = read_model(path);
  EXPECT_FALSE(back.has_training);
  EXPECT_FALSE(back.skeleton);
  EXPECT_TRUE(back.weights.empty());
  EXPECT_TRUE(back.mean.empty());
  EXPECT_EQ(store::check_model(path, true), std::vector<std::string>{});
}

TEST(ModelFile, HoldsManyAndLargeTensors) {
  ModelFile model = sample_model();
  for (int i = 0; i < 300; ++i) model.weights["layer" + std::to_string(i) + "/weight"] = counting({2, 2});
  model.weights["wide"] = counting({3, 700000});
  model.weights["tall"] = counting({700000, 3});
  const std::string path = folder() / "large.h5";
  write_model(path, Overwrite::refuse, model);
  expect_same(model.weights, read_model(path).weights);
}

TEST(ModelFile, EqualContentGivesEqualBytes) {
  const std::string one = folder() / "one.h5", two = folder() / "two.h5";
  write_model(one, Overwrite::refuse, sample_model());
  write_model(two, Overwrite::refuse, sample_model());
  EXPECT_EQ(slurp(one), slurp(two));
}

TEST(ModelFile, NamesTheDamagedTensor) {
  const std::string path = folder() / "damaged.h5";
  ModelFile model = sample_model();
  model.weights["word_encoder/0/weight"].values[7] = 1234.5f;
  write_model(path, Overwrite::refuse, model);
  // Shuffled: byte 2 of the values lies in one run; the two high bytes of 1234.5 (0x449a5000) stand out at index 7 of it.
  std::string bytes = slurp(path);
  const auto at = bytes.find(std::string("\x44\x41\x41\x41\x41", 5));
  ASSERT_NE(at, std::string::npos);
  bytes[at] = '\x45';
  testing::put(path, bytes);
  EXPECT_EQ(refusal([&] { read_model(path); }), path + ":weights/word_encoder/0/weight: checksum mismatch: the file is damaged");
}

TEST(ModelFile, RefusesOtherFiles) {
  const std::string archive = folder() / "archive.h5", text = folder() / "text";
  testing::write_archive(archive, {testing::sample_clip("a", 2, 1)});
  testing::put(text, "weights");
  EXPECT_NE(refusal([&] { read_model(archive); }).find("'mocap-motion', expected 'mocap-model': not a model file"), std::string::npos);
  EXPECT_NE(refusal([&] { read_model(text); }).find("not an HDF5 file, expected a model file"), std::string::npos);
  EXPECT_NE(refusal([&] { store::ArchiveReader reader(folder() / "m.h5"); }), "");
}

TEST(ModelFile, FindsWhatIsNotFinite) {
  ModelFile model = sample_model();
  model.weights["scale"].values[0] = std::numeric_limits<float>::quiet_NaN();
  model.deviation[1] = 0;
  const std::string path = folder() / "nan.h5";
  write_model(path, Overwrite::refuse, model);
  const auto defects = store::check_model(path, false);
  ASSERT_EQ(defects.size(), 2u);
  EXPECT_EQ(defects[0], path + ":weights/scale: a value that is not finite");
  EXPECT_EQ(defects[1], path + ":normalization/std: a deviation that is not above 0");
}

TEST(ModelFile, RefusesToWriteWhatItCouldNotRead) {
  const auto writing = [&](const auto& change) {
    ModelFile model = sample_model();
    change(model);
    return refusal([&] { write_model(folder() / "never.h5", Overwrite::refuse, model); });
  };
  EXPECT_NE(writing([](ModelFile& m) { m.weights["a"] = {{2}, {1}}; }).find("1 values"), std::string::npos);
  EXPECT_NE(writing([](ModelFile& m) { m.weights["a//b"] = counting({1}); }).find("empty part"), std::string::npos);
  EXPECT_NE(writing([](ModelFile& m) { m.weights["scale/x"] = counting({1}); }).find("continues"), std::string::npos);
  EXPECT_NE(writing([](ModelFile& m) { m.config = "{"; }).find("JSON"), std::string::npos);
  EXPECT_NE(writing([](ModelFile& m) { m.train_sources = {"x"}; }).find("SHA-256"), std::string::npos);
  EXPECT_NE(writing([](ModelFile& m) { m.mean.pop_back(); }).find("different number"), std::string::npos);
}

TEST(ModelFile, H5pySeesTheContract) {
  const std::string path = folder() / "contract.h5";
  write_model(path, Overwrite::refuse, sample_model());
  const int status = testing::python("check_contract.py", "model " + path);
  if (status < 0) GTEST_SKIP() << "python3-h5py is not installed";
  EXPECT_EQ(status, 0);
}

}  // namespace
}  // namespace mocap
