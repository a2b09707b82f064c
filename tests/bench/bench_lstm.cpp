// Training steps of the mixture generator and of the refiner against their bare matrix products, and the speed of one stream of motion through both. Everything alternates in one
// run and only ratios of neighbours count: bench_lstm [PAIRS]
#include <cstdlib>

#include "libmodels/generators/lstm_gmm_generator.hpp"
#include "libmodels/lstm_gmm/training.hpp"
#include "libmodels/nn/blas.hpp"
#include "libmodels/nn/sharded.hpp"
#include "libmodels/refiner/model.hpp"
#include "libmodels/refiner/training.hpp"
#include "libmodels/train/tensors.hpp"
#include "tests/bench/bare_products.hpp"
#include "tests/bench/stepper.hpp"
#include "tests/store/sample_clips.hpp"

namespace mocap {
namespace {

using namespace bench;

constexpr int kShards = 2, kThreads = 2;

train::Reference reference() {
  const auto columns = static_cast<std::size_t>(features::state_columns(*canonical_body()));
  return {canonical_body(), 30, std::vector<float>(columns, 0), std::vector<float>(columns, 1)};
}

const train::StateDataset& data() {
  static const train::StateDataset set("bench", {testing::with_contacts(testing::sample_clip("a", 600, 5)), testing::with_contacts(testing::sample_clip("b", 600, 6))}, reference());
  return set;
}

lstm_gmm::LstmGmmTraining generator(const std::string& preset) { return {lstm_gmm::LstmGmmConfig::preset(preset), {.shards = kShards}, data(), nullptr}; }
refiner::RefinerTraining refinement(const std::string& preset) { return {refiner::RefinerConfig::preset(preset), {.shards = kShards}, data(), data(), nlohmann::json::object()}; }

// The products of an LSTM are those of all its gates at once: input and state side by side.
void training(const std::string& preset, int pairs) {
  auto model = generator(preset);
  const auto& c = model.network().config();
  Layers outside, recurrent;
  chain(outside, {c.input(), c.width});
  chain(outside, {c.hidden, c.width, c.outputs()});
  chain(recurrent, {c.width + 2 * c.hidden, 4 * c.hidden});
  chain(recurrent, {3 * c.hidden, 4 * c.hidden});
  std::vector<BareProducts> bare;
  for (int s = 0; s < kShards; ++s) bare.emplace_back(model.config().batch / kShards, static_cast<int>(model.config().window), outside, recurrent);
  const double flop = kShards * bare[0].flop();
  fmt::print("generator, preset {}: {} parameters, batch {} x {} frames, {} shards on {} threads, {:.1f} GFLOP in matrix products\n", preset, c.parameter_count(), model.config().batch, model.config().window, kShards,
             kThreads, flop / 1e9);
  Stepper step(model, kShards, kThreads);
  nn::ShardedGradient executor(kShards, kThreads);
  std::vector<double> t_naive, t_merged, t_ours;
  for (int i = -1; i < pairs; ++i) {
    const double naive = seconds([&] { executor.for_each(kShards, [&](int s) { bare[static_cast<std::size_t>(s)].naive(); }); });
    const double ours = seconds([&] { step(); });
    const double merged = seconds([&] { executor.for_each(kShards, [&](int s) { bare[static_cast<std::size_t>(s)].merged(); }); });
    if (i < 0) continue;  // the first round warms caches and memory up
    t_naive.push_back(naive), t_merged.push_back(merged), t_ours.push_back(ours);
  }
  print_row("bare products, a frame at a time", t_naive, t_naive, flop);
  print_row("bare products, merged over frames", t_merged, t_naive, flop);
  print_row("training step", t_ours, t_naive, flop);
}

void refiner_training(const std::string& preset, int pairs) {
  auto model = refinement(preset);
  Stepper step(model, kShards, kThreads);
  std::vector<double> times;
  for (int i = 0; i < 8 * pairs; ++i) times.push_back(seconds([&] { step(); }));
  const Spread t = spread(times);
  fmt::print("refiner, preset {}: an update, median {:.1f} ms ({:.1f} .. {:.1f})\n", preset, 1e3 * t.median, 1e3 * t.low, 1e3 * t.high);
}

store::ModelFile file_of(train::Trainable& training) {
  store::ModelFile file = training.describe();
  for (const auto& [name, tensor] : training.parameters()) file.weights[name] = train::to_stored(tensor);
  return file;
}

void streaming(const std::string& preset, int repeats) {
  auto one = generator(preset);
  auto other = refinement(preset);
  const auto model = generators::make_lstm_gmm_generator(file_of(one), "bench");
  const refiner::Model refiner = refiner::read(file_of(other), "bench");
  generators::SampleSettings settings;
  settings.threads = 1;
  constexpr std::int64_t kFrames = 900;
  std::vector<double> generated, refined, both;
  for (int i = -1; i < repeats; ++i) {
    std::vector<Clip> clips;
    const double a = seconds([&] { clips = model->sample({{"stream", {}, kFrames, 1}}, settings); });
    const double b = seconds([&] { (void)refiner::refine(refiner, clips[0]); });
    if (i < 0) continue;
    generated.push_back(kFrames / a), refined.push_back(kFrames / b), both.push_back(kFrames / (a + b));
  }
  for (const auto& [name, rates] : {std::pair{"generated", &generated}, {"refined", &refined}, {"generated and refined", &both}}) {
    const Spread s = spread(*rates);
    fmt::print("one stream of {} frames, preset {}, one thread, {:<22} {:8.0f} frames/s ({:.0f} .. {:.0f})\n", kFrames, preset, name, s.median, s.low, s.high);
  }
}

}  // namespace
}  // namespace mocap

int main(int argc, char** argv) {
  const int pairs = argc > 1 ? std::max(1, std::atoi(argv[1])) : 9;
  mocap::nn::use_one_blas_thread();
  fmt::print("{}\n", mocap::nn::compute_libraries());
  for (const char* preset : {"small", "paper"}) {
    mocap::training(preset, pairs);
    mocap::refiner_training(preset, pairs);
    mocap::streaming(preset, pairs);
  }
}
