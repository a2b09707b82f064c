// Training steps of both stages of the convolutional variational autoencoder against their bare convolutions and matrix products, and how fast motion is sampled. Everything alternates
// in one run and only ratios of neighbours count: bench_cae_vae [PAIRS]
#include <cstdlib>

#include "libmodels/cae_vae/codec.hpp"
#include "libmodels/generators/cae_vae_generator.hpp"
#include "libmodels/nn/blas.hpp"
#include "tests/bench/bare_products.hpp"
#include "tests/bench/stepper.hpp"
#include "tests/cae_vae/data.hpp"

namespace mocap {
namespace {

using namespace bench;

constexpr int kShards = 2, kThreads = 2, kMotions = 1000;

const cae_vae::WindowDataset& data() {
  static testing::TemporaryFolder folder;
  static const cae_vae::WindowDataset set = [] {
    std::vector<Clip> clips;
    for (std::uint64_t i = 0; i < 20; ++i) clips.push_back(testing::sample_clip(fmt::format("clip{}", i), 600, i));
    testing::write_archive(folder / "a.h5", clips);
    return cae_vae::WindowDataset(folder / "a.h5", 120, 60);
  }();
  return set;
}

// The convolutions of one shard's step: outputs, gradients of the weights, and of the second one its input's. The second stage encodes its windows anew: one convolution without gradients.
struct BareConvolutions {
  Tensor x, y, encoder, decoder;
  explicit BareConvolutions(std::int64_t rows)
      : x(torch::randn({rows, 58, 120})), y(torch::randn({rows, 32, 120})), encoder(torch::randn({32, 58, 15})), decoder(torch::randn({58, 32, 15})) {
    for (Tensor* t : {&y, &encoder, &decoder}) t->set_requires_grad(true);
  }
  void encode() {
    const torch::NoGradGuard no_grad;
    (void)torch::conv1d(x, encoder, {}, 1, 7);
  }
  void operator()() {
    const Tensor a = torch::conv1d(x, encoder, {}, 1, 7), b = torch::conv1d(y, decoder, {}, 1, 7);
    (void)torch::autograd::grad({a, b}, {encoder, decoder, y}, {torch::ones_like(a), torch::ones_like(b)});
  }
};

void training(int pairs) {
  const cae_vae::CaeVaeConfig c;
  cae_vae::TrainingConfig settings;
  settings.shards = kShards;
  settings.epochs = 1000;
  cae_vae::CaeVaeTraining model(c, settings, data(), nullptr);
  const std::int64_t rows = settings.batch / kShards;
  std::vector<BareConvolutions> convolutions;
  std::vector<BareProducts> products;
  Layers layers;
  chain(layers, {c.features(), c.hidden, 2 * c.latent});
  chain(layers, {c.latent, c.hidden, 2 * c.features()});
  for (int s = 0; s < kShards; ++s) {
    convolutions.emplace_back(rows);
    products.emplace_back(rows, 1, layers, Layers{});
  }
  nn::ShardedGradient executor(kShards, kThreads);
  const std::int64_t second = settings.epochs * model.steps_per_epoch();
  for (const bool autoencoder : {true, false}) {
    Stepper step(model, kShards, kThreads, autoencoder ? 0 : second);
    const double flop = autoencoder ? settings.batch * 120.0 * 2 * 58 * 32 * 15 * 5 : kShards * products[0].flop() + settings.batch * 120.0 * 2 * 58 * 32 * 15;
    fmt::print("{}: batch {}, {} shards on {} threads, {:.2f} GFLOP\n", autoencoder ? "autoencoder" : "variational autoencoder", settings.batch, kShards, kThreads, flop / 1e9);
    std::vector<double> bare, ours;
    for (int i = -2; i < pairs; ++i) {
      const double one = seconds([&] {
        executor.for_each(kShards, [&](int s) {
          if (autoencoder)
            convolutions[static_cast<std::size_t>(s)]();
          else
            convolutions[static_cast<std::size_t>(s)].encode(), products[static_cast<std::size_t>(s)].merged();
        });
      });
      const double other = seconds([&] { step(); });
      if (i >= 0) bare.push_back(one), ours.push_back(other);
    }
    print_row(autoencoder ? "bare convolutions" : "bare convolution and products", bare, bare, flop);
    print_row("training step", ours, bare, flop);
  }
}

void sampling(int pairs) {
  cae_vae::CaeVaeTraining model(cae_vae::CaeVaeConfig{}, cae_vae::TrainingConfig{}, data(), nullptr);
  const store::ModelFile file = cae_vae::model_file(model);
  const auto generator = generators::make_cae_vae_generator(file, "bench");
  std::vector<generators::ClipOrder> orders;
  std::vector<cae_vae::ClipRequest> requests;
  for (std::uint64_t i = 0; i < kMotions; ++i) {
    orders.push_back({fmt::format("m{}", i), {}, 120, i});
    requests.push_back({1, i, 120, {}});
  }
  const cae_vae::Codec codec(model.network());
  for (const int threads : {1, kThreads}) {
    generators::SampleSettings settings;
    settings.threads = threads;
    std::vector<double> decoded, made;
    for (int i = -1; i < pairs; ++i) {
      const double a = seconds([&] { (void)codec.sample(requests, {}, threads); }), b = seconds([&] { (void)generator->sample(orders, settings); });
      if (i >= 0) decoded.push_back(kMotions * 120 / a), made.push_back(kMotions * 120 / b);
    }
    for (const auto& [name, rates] : {std::pair{"features", &decoded}, {"clips with rotations and contacts", &made}}) {
      const Spread s = spread(*rates);
      fmt::print("{} motions of 120 frames, {} threads, {:<34} {:9.0f} frames/s ({:.0f} .. {:.0f})\n", kMotions, threads, name, s.median, s.low, s.high);
    }
  }
}

}  // namespace
}  // namespace mocap

int main(int argc, char** argv) {
  const int pairs = argc > 1 ? std::max(1, std::atoi(argv[1])) : 9;
  mocap::nn::use_one_blas_thread();
  fmt::print("{}\n", mocap::nn::compute_libraries());
  mocap::training(pairs);
  mocap::sampling(pairs);
}
