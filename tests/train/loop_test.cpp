#include "libmodels/train/loop.hpp"

#include <fmt/core.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>

#include "libmocap/base/error.hpp"
#include "libmodels/nn/blas.hpp"
#include "libmodels/train/checkpoint.hpp"
#include "libmodels/train/signals.hpp"
#include "libmodels/train/tensors.hpp"
#include "tests/base/temporary_folder.hpp"
#include "tests/train/toy.hpp"

namespace mocap::train {
namespace {

namespace fs = std::filesystem;
using testing::put;
using testing::slurp;
using testing::TemporaryFolder;
using testing::Toy;
using testing::ToySettings;

LoopOptions options(const std::string& output) {
  LoopOptions o;
  o.output = output;
  o.history = {{"train-toy", "1", "c0ffee", {"train-toy"}, 3, {}}};
  return o;
}

LoopOptions resuming(const std::string& output) {
  LoopOptions o = options(output);
  o.resume = true;
  return o;
}

// Trains; stops after `stop` steps where it is not negative.
LoopResult run(Toy& toy, const LoopOptions& o, std::int64_t stop = -1) {
  clear_stop_request();
  if (stop == 0) request_stop();
  const auto result = train(toy, o, [&](const Progress& p) {
    if (p.step == stop) request_stop();
  });
  clear_stop_request();
  return result;
}
LoopResult run(const LoopOptions& o, std::int64_t stop = -1, ToySettings settings = {}) {
  Toy toy(settings);
  return run(toy, o, stop);
}

struct Refusal {
  Exit status = Exit::ok;
  std::string text, hint;
};
Refusal refusal(const std::function<void()>& body) {
  try {
    body();
  } catch (const Error& e) {
    clear_stop_request();
    return {e.status(), e.what(), e.hint()};
  }
  return {};
}

// The files of an uninterrupted training: what every other must end at.
struct Whole {
  TemporaryFolder folder;
  std::string model, log;
  Whole() {
    run(options(folder / "m.h5"));
    model = slurp(folder / "m.h5");
    log = slurp(folder / "m.h5.log.tsv");
  }
};
const Whole& whole() {
  static const Whole w;
  return w;
}

void expect_same_end(const TemporaryFolder& folder) {
  EXPECT_EQ(slurp(folder / "m.h5") == whole().model, true) << "model files differ";
  EXPECT_EQ(slurp(folder / "m.h5.log.tsv"), whole().log);
  EXPECT_EQ(folder.names().size(), 2u) << "something beside model and log is left";
}

// Stops at step 10 and again at 20, so that both checkpoints stand.
void leave_two_checkpoints(const TemporaryFolder& folder) {
  EXPECT_EQ(run(options(folder / "m.h5"), 10).step, 10);
  EXPECT_EQ(run(resuming(folder / "m.h5"), 20).step, 20);
  EXPECT_EQ(folder.names().size(), 3u);
}

TEST(Loop, LossFallsAndTheModelIsWhatWasTrained) {
  const TemporaryFolder folder;
  ToySettings settings;
  settings.steps = 300;
  Toy toy(settings);
  std::vector<double> losses;
  const auto result = train(toy, options(folder / "m.h5"), [&](const Progress& p) { losses.push_back(p.loss); });
  EXPECT_TRUE(result.finished);
  EXPECT_EQ(result.step, 300);
  ASSERT_EQ(losses.size(), 300u);
  EXPECT_GT(losses.front(), 1);
  EXPECT_LT(losses.back(), 1e-3);

  const auto file = store::read_model(folder / "m.h5");
  EXPECT_EQ(file.kind, "toy");
  EXPECT_EQ(file.history.back().tool, "train-toy");
  EXPECT_TRUE(file.has_training);
  EXPECT_EQ(nlohmann::json::parse(file.training_state).at("step"), 300);
  EXPECT_TRUE(file.training_tensors.contains("layer/weight/m") && file.training_tensors.contains("layer/bias/v"));
  EXPECT_TRUE(torch::equal(from_stored(file.weights.at("layer/weight")), toy.parameters()[0].second));
}

TEST(Loop, LogHasARowAStep) {
  std::istringstream log(whole().log);
  std::string line;
  std::getline(log, line);
  EXPECT_EQ(line, "step\tepoch\tlearning_rate\tgradient_norm\tloss\tsquare_error\tnonsense\tvalidation_loss");
  for (int step = 1; step <= 40; ++step) {
    ASSERT_TRUE(std::getline(log, line));
    EXPECT_EQ(line.substr(0, line.find('\t', line.find('\t') + 1)), fmt::format("{}\t{}", step, (step + 7) / 8));
    EXPECT_EQ(line.back() == '\t', step % 8 != 0) << "validation at the end of an epoch: " << line;
  }
  EXPECT_FALSE(std::getline(log, line));
}

TEST(Loop, SameBitsForAnyNumberOfThreads) {
  for (const int threads : {1, 2, 3, 8}) {
    const TemporaryFolder folder;
    auto o = options(folder / "m.h5");
    o.threads = threads;
    run(o);
    expect_same_end(folder);
  }
}

TEST(Loop, StoppedAndResumedEndsAtTheSameBits) {
  for (const std::int64_t stop : {0, 1, 7, 8, 23, 39}) {
    const TemporaryFolder folder;
    const auto stopped = run(options(folder / "m.h5"), stop);
    EXPECT_FALSE(stopped.finished);
    EXPECT_EQ(stopped.step, stop);
    EXPECT_FALSE(fs::exists(folder / "m.h5"));
    auto o = resuming(folder / "m.h5");
    o.threads = 2;
    EXPECT_TRUE(run(o).finished);
    expect_same_end(folder);
  }
}

TEST(Loop, StoppedManyTimes) {
  const TemporaryFolder folder;
  for (const std::int64_t stop : {3, 4, 5, 17, 30}) EXPECT_EQ(run(resuming(folder / "m.h5"), stop).step, stop);
  run(resuming(folder / "m.h5"));
  expect_same_end(folder);
}

TEST(Loop, AStopAfterTheLastStepFinishes) {
  const TemporaryFolder folder;
  EXPECT_TRUE(run(options(folder / "m.h5"), 40).finished);
  expect_same_end(folder);
}

// As after SIGKILL: the log has run ahead of the checkpoint.
TEST(Loop, TheLogIsCutBackToTheCheckpoint) {
  const TemporaryFolder folder;
  run(options(folder / "m.h5"), 10);
  put(folder / "m.h5.log.tsv", whole().log.substr(0, whole().log.size() - 50));
  run(resuming(folder / "m.h5"));
  expect_same_end(folder);
}

TEST(Loop, DroppedOptimizerStateChangesTheBits) {
  const TemporaryFolder folder;
  run(options(folder / "m.h5"), 10);
  auto checkpoint = store::read_model(folder / "m.h5.ckpt-1");
  for (auto& [name, tensor] : checkpoint.training_tensors) std::fill(tensor.values.begin(), tensor.values.end(), 0.0f);
  store::write_model(folder / "m.h5.ckpt-1", Overwrite::allow, checkpoint);
  run(resuming(folder / "m.h5"));
  EXPECT_FALSE(slurp(folder / "m.h5") == whole().model);
}

TEST(Loop, ChangedStepChangesTheBits) {
  const TemporaryFolder folder;
  run(options(folder / "m.h5"), 10);
  auto checkpoint = store::read_model(folder / "m.h5.ckpt-1");
  auto state = nlohmann::json::parse(checkpoint.training_state);
  state["step"] = 9;
  checkpoint.training_state = state.dump();
  store::write_model(folder / "m.h5.ckpt-1", Overwrite::allow, checkpoint);
  run(resuming(folder / "m.h5"));
  EXPECT_FALSE(slurp(folder / "m.h5") == whole().model);
}

void damage(const std::string& path, bool truncate) {
  std::string bytes = slurp(path);
  if (truncate)
    bytes.resize(bytes.size() / 2);
  else
    for (std::size_t i = bytes.size() / 4; i < bytes.size(); i += bytes.size() / 8) bytes[i] = static_cast<char>(bytes[i] ^ 0x5a);
  put(path, bytes);
}

TEST(Loop, ADamagedCheckpointIsReportedAndTheOtherTaken) {
  for (const int which : {1, 2})
    for (const bool truncate : {false, true}) {
      const TemporaryFolder folder;
      leave_two_checkpoints(folder);
      const std::string bad = folder / fmt::format("m.h5.ckpt-{}", which);
      damage(bad, truncate);
      std::vector<std::int64_t> steps;
      Toy toy;
      toy.after_prepare = [&](std::int64_t step) { steps.push_back(step); };
      ::testing::internal::CaptureStderr();
      run(toy, resuming(folder / "m.h5"));
      const std::string said = ::testing::internal::GetCapturedStderr();
      EXPECT_NE(said.find(bad), std::string::npos) << said;
      EXPECT_EQ(steps.front(), which == 2 ? 10 : 20);
      expect_same_end(folder);
    }
}

TEST(Loop, AStopAfterTheFallbackKeepsTheGoodCheckpoint) {
  const TemporaryFolder folder;
  leave_two_checkpoints(folder);
  damage(folder / "m.h5.ckpt-2", true);
  ::testing::internal::CaptureStderr();
  run(resuming(folder / "m.h5"), 25);
  ::testing::internal::GetCapturedStderr();
  EXPECT_EQ(nlohmann::json::parse(store::read_model(folder / "m.h5.ckpt-1").training_state).at("step"), 10);
  EXPECT_EQ(nlohmann::json::parse(store::read_model(folder / "m.h5.ckpt-2").training_state).at("step"), 25);
  run(resuming(folder / "m.h5"));
  expect_same_end(folder);
}

TEST(Loop, BothCheckpointsDamaged) {
  const TemporaryFolder folder;
  leave_two_checkpoints(folder);
  damage(folder / "m.h5.ckpt-1", true);
  damage(folder / "m.h5.ckpt-2", false);
  ::testing::internal::CaptureStderr();
  const auto r = refusal([&] { run(resuming(folder / "m.h5")); });
  ::testing::internal::GetCapturedStderr();
  EXPECT_EQ(r.status, Exit::data) << r.text;
  EXPECT_NE(r.text.find("ckpt-"), std::string::npos) << r.text;
  EXPECT_FALSE(fs::exists(folder / "m.h5"));
}

TEST(Loop, ACheckpointWithoutItsStateIsDamaged) {
  const TemporaryFolder folder;
  run(options(folder / "m.h5"), 10);
  const auto good = store::read_model(folder / "m.h5.ckpt-1");
  for (const char* state : {"[]", "3", "{}", R"({"step":"10","identity":{}})", R"({"step":-1,"identity":{}})", R"({"step":10,"identity":"x"})", R"({"step":1e30,"identity":{}})"}) {
    auto bad = good;
    bad.training_state = state;
    store::write_model(folder / "m.h5.ckpt-1", Overwrite::allow, bad);
    ::testing::internal::CaptureStderr();
    const auto r = refusal([&] { run(resuming(folder / "m.h5")); });
    ::testing::internal::GetCapturedStderr();
    EXPECT_EQ(r.status, Exit::data) << state << ": " << r.text;
  }
  auto bad = good;
  bad.training_tensors.erase("layer/bias/v");
  store::write_model(folder / "m.h5.ckpt-1", Overwrite::allow, bad);
  const auto r = refusal([&] { run(resuming(folder / "m.h5")); });
  EXPECT_EQ(r.status, Exit::data);
  EXPECT_NE(r.text.find("m.h5.ckpt-1:training/layer/bias/v"), std::string::npos) << r.text;
}

TEST(Loop, AnotherIdentityIsRefusedByItsKey) {
  const TemporaryFolder folder;
  run(options(folder / "m.h5"), 10);
  ToySettings changed;
  changed.rate = 0.25;
  auto r = refusal([&] { run(resuming(folder / "m.h5"), -1, changed); });
  EXPECT_EQ(r.status, Exit::usage);
  EXPECT_NE(r.text.find("m.h5.ckpt-1: was trained with optimizer/rate = 0.05, this command says 0.25"), std::string::npos) << r.text;
  changed = {};
  changed.seed = 4;
  r = refusal([&] { run(resuming(folder / "m.h5"), -1, changed); });
  EXPECT_NE(r.text.find("seed = 3, this command says 4"), std::string::npos) << r.text;
  EXPECT_TRUE(fs::exists(folder / "m.h5.ckpt-1"));
}

// One list a prefix of the other: each direction counts.
TEST(Loop, AnIdentityWithMoreOrLessIsAnother) {
  for (const auto& [before, after] : {std::pair{0, 2}, std::pair{2, 0}}) {
    const TemporaryFolder folder;
    Toy first, second;
    first.extra_stages = before;
    second.extra_stages = after;
    run(first, options(folder / "m.h5"), 5);
    const auto r = refusal([&] { run(second, resuming(folder / "m.h5")); });
    EXPECT_EQ(r.status, Exit::usage);
    EXPECT_NE(r.text.find("stages/1"), std::string::npos) << r.text;
  }
}

TEST(Loop, AnExistingOutputOrCheckpointIsRefused) {
  const TemporaryFolder folder;
  put(folder / "m.h5", "mine");
  EXPECT_EQ(refusal([&] { run(options(folder / "m.h5")); }).status, Exit::io);
  EXPECT_EQ(slurp(folder / "m.h5"), "mine");
  EXPECT_EQ(folder.names().size(), 1u) << "no work before the refusal";
  fs::remove(folder / "m.h5");

  run(options(folder / "m.h5"), 10);
  const auto r = refusal([&] { run(options(folder / "m.h5")); });
  EXPECT_EQ(r.status, Exit::io);
  EXPECT_NE(r.hint.find("--resume"), std::string::npos) << r.hint;
  EXPECT_TRUE(fs::exists(folder / "m.h5.ckpt-1"));

  auto o = options(folder / "m.h5");
  o.overwrite = Overwrite::allow;
  Toy toy;
  std::int64_t first = -1;
  toy.after_prepare = [&](std::int64_t step) { first = first < 0 ? step : first; };
  run(toy, o);
  EXPECT_EQ(first, 0);
  expect_same_end(folder);
}

TEST(Loop, ResumingWhatIsFinishedReturnsAtOnce) {
  const TemporaryFolder folder;
  run(options(folder / "m.h5"));
  Toy toy;
  toy.after_prepare = [](std::int64_t) { FAIL() << "trains again"; };
  const auto result = run(toy, resuming(folder / "m.h5"));
  EXPECT_TRUE(result.finished);
  EXPECT_EQ(result.step, 40);
  expect_same_end(folder);

  ToySettings changed;
  changed.seed = 4;
  EXPECT_EQ(refusal([&] { run(resuming(folder / "m.h5"), -1, changed); }).status, Exit::usage);
}

TEST(Loop, ResumingWhatIsNoModel) {
  const TemporaryFolder folder;
  put(folder / "m.h5", "mine");
  EXPECT_EQ(refusal([&] { run(resuming(folder / "m.h5")); }).status, Exit::data);
  EXPECT_EQ(slurp(folder / "m.h5"), "mine");
  fs::remove(folder / "m.h5");
  run(options(folder / "m.h5"), 10);
  fs::copy(folder / "m.h5.ckpt-1", folder / "m.h5");
  EXPECT_EQ(refusal([&] { run(resuming(folder / "m.h5")); }).status, Exit::io) << "a checkpoint is no finished model";
}

TEST(Loop, ResumingWithoutACheckpointStartsAfresh) {
  const TemporaryFolder folder;
  run(resuming(folder / "m.h5"));
  expect_same_end(folder);
}

TEST(Loop, DivergenceNamesStepTermAndCheckpoint) {
  const TemporaryFolder folder;
  ToySettings settings;
  settings.nan_at = 20;
  auto o = options(folder / "m.h5");
  auto r = refusal([&] { run(o, -1, settings); });
  EXPECT_EQ(r.status, Exit::data);
  EXPECT_NE(r.text.find("diverged at step 21: nonsense is not finite"), std::string::npos) << r.text;
  EXPECT_NE(r.hint.find("no checkpoint"), std::string::npos) << r.hint;
  EXPECT_FALSE(fs::exists(folder / "m.h5"));
  o.checkpoint_epochs = 1;
  r = refusal([&] { run(o, -1, settings); });
  EXPECT_NE(r.hint.find("m.h5.ckpt-2"), std::string::npos) << r.hint;
  EXPECT_EQ(nlohmann::json::parse(store::read_model(folder / "m.h5.ckpt-2").training_state).at("step"), 16);
  EXPECT_EQ(nlohmann::json::parse(store::read_model(folder / "m.h5.ckpt-1").training_state).at("step"), 8);
}

TEST(Loop, CheckpointsByEpochStandInTurnsAndGoInTheEnd) {
  const TemporaryFolder folder;
  auto o = options(folder / "m.h5");
  o.checkpoint_epochs = 2;
  std::vector<std::pair<std::int64_t, std::vector<std::int64_t>>> seen;
  Toy toy;
  toy.after_prepare = [&](std::int64_t step) {
    std::vector<std::int64_t> steps;
    for (const int which : {1, 2}) {
      const std::string path = folder / fmt::format("m.h5.ckpt-{}", which);
      steps.push_back(fs::exists(path) ? nlohmann::json::parse(store::read_model(path).training_state).at("step").get<std::int64_t>() : -1);
    }
    if (step == 15 || step == 16 || step == 39) seen.emplace_back(step, steps);
  };
  run(toy, o);
  const decltype(seen) expected = {{15, {-1, -1}}, {16, {16, -1}}, {39, {16, 32}}};
  EXPECT_EQ(seen, expected);
  expect_same_end(folder);
}

TEST(Loop, CheckpointsByTime) {
  const TemporaryFolder folder;
  auto o = options(folder / "m.h5");
  o.checkpoint_minutes = 1e-9;
  Toy toy;
  int with_two = 0;
  toy.after_prepare = [&](std::int64_t) { with_two += fs::exists(folder / "m.h5.ckpt-1") && fs::exists(folder / "m.h5.ckpt-2"); };
  run(toy, o);
  EXPECT_EQ(with_two, 38);
  expect_same_end(folder);
}

TEST(Loop, WeightsOnlyLeavesTheTrainingStateOut) {
  const TemporaryFolder folder;
  auto o = options(folder / "m.h5");
  o.weights_only = true;
  run(o);
  const auto file = store::read_model(folder / "m.h5");
  EXPECT_FALSE(file.has_training);
  EXPECT_TRUE(file.training_tensors.empty() && file.training_state.empty());
  const auto full = store::read_model(whole().folder / "m.h5");
  EXPECT_EQ(file.weights.at("layer/weight").values, full.weights.at("layer/weight").values);

  // What was trained otherwise is not taken for finished.
  EXPECT_TRUE(run(resuming(folder / "m.h5")).finished);
  ToySettings changed;
  changed.rate = 0.25;
  EXPECT_EQ(refusal([&] { run(resuming(folder / "m.h5"), -1, changed); }).status, Exit::usage);
}

TEST(Loop, StandardOutputIsRefused) { EXPECT_EQ(refusal([] { run(options("-")); }).status, Exit::usage); }

TEST(Loop, AFolderThatIsNotThere) {
  const TemporaryFolder folder;
  EXPECT_EQ(refusal([&] { run(options(folder / "absent/m.h5")); }).status, Exit::io);
}

// A folder in the way of a checkpoint stands for any failure to write it, also for root.
TEST(Loop, ACheckpointThatCannotBeWrittenIsAnOutputError) {
  const TemporaryFolder folder;
  Toy toy;
  toy.after_prepare = [&](std::int64_t step) {
    if (step == 3) fs::create_directories(folder / "m.h5.ckpt-1/in-the-way");
  };
  auto o = options(folder / "m.h5");
  o.checkpoint_epochs = 1;
  const auto r = refusal([&] { run(toy, o); });
  EXPECT_EQ(r.status, Exit::io) << r.text;
  EXPECT_NE(r.text.find("m.h5.ckpt-1"), std::string::npos) << r.text;
  for (const auto& name : folder.names()) EXPECT_EQ(name.find(".part-"), std::string::npos) << name;
}

TEST(Loop, ClippedGradientsWithOneShard) {
  const TemporaryFolder folder;
  ToySettings settings;
  settings.shards = 1;
  settings.limit = 0.01;
  settings.steps = 8;
  EXPECT_TRUE(run(options(folder / "m.h5"), -1, settings).finished);
}

}  // namespace
}  // namespace mocap::train
