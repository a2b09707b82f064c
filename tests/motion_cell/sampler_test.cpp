#include "libmodels/motion_cell/sampler.hpp"

#include <gtest/gtest.h>
#include <torch/torch.h>

#include <algorithm>
#include <cmath>

#include "libmocap/base/error.hpp"
#include "libmodels/nn/packed_matrix.hpp"
#include "tests/motion_cell/reference.hpp"

namespace mocap::motion_cell {
namespace {

using torch::Tensor;

MotionCellConfig middle() {
  MotionCellConfig c;
  c.joints = 5, c.hidden = 48, c.width = 40, c.word = 24, c.latent = 20, c.overlap = 2, c.attribute_classes = {3, 2};
  return c;
}

ClipRequest request(std::uint64_t stream, std::int64_t frames, std::vector<std::int64_t> classes = {1, 0}) {
  return {9, stream, frames, {{0, std::move(classes)}}};
}

// Algorithm 2 for one clip in plain operations, the noise drawn in the documented order.
Tensor algorithm2(const MotionCell& cell, const ClipRequest& r, double sigma_scale) {
  const torch::NoGradGuard guard;
  const MotionCellConfig& c = cell.config();
  Random random(r.seed, r.stream);
  std::vector<std::int64_t> classes;
  Tensor h;
  std::vector<Tensor> frames;
  Tensor ahead;
  for (std::int64_t n = 0; n * c.word_length < r.frames; ++n) {
    for (const auto& change : r.schedule)
      if (change.word == n) classes = change.classes;
    if (n == 0) {
      const std::int64_t row = classes[0] * c.attribute_classes[1] + classes[1];
      h = cell.initial_mu.slice(0, row, row + 1) +
          cell.initial_log_sigma.slice(0, row, row + 1).exp() * nn::normal_tensor({1, 2 * c.hidden}, random);
    }
    const Tensor one_hot = torch::zeros({1, c.attribute_total()});
    one_hot[0][classes[0]] = 1;
    one_hot[0][c.attribute_classes[0] + classes[1]] = 1;
    const Tensor a = plain(*cell.control_features, one_hot), ha = torch::cat({h, a}, 1);
    const Tensor sigma = torch::nn::functional::softplus(plain(*cell.prior_sigma, ha)) + kSigmaFloor;
    const Tensor z = plain(*cell.latent_features,
                           plain(*cell.prior_mu, ha) + sigma_scale * sigma * nn::normal_tensor({1, c.latent}, random));
    const Tensor w = plain(*cell.decoder, torch::cat({z, h, a}, 1));
    const Tensor h1 = plain(*cell.gru_1, torch::cat({plain(*cell.word_features, w), z}, 1), h.slice(1, 0, c.hidden));
    h = torch::cat({h1, plain(*cell.gru_2, h1, h.slice(1, c.hidden))}, 1);
    const Tensor written = (c.single_layer ? w : plain(*cell.word_decoder, w)).reshape({c.word_length + c.overlap, c.features()});
    Tensor word = written.narrow(0, 0, c.word_length).clone();
    for (int k = 0; k < c.overlap && n > 0; ++k) word[k] = (k + 1.0) / (c.overlap + 1) * word[k] + (1 - (k + 1.0) / (c.overlap + 1)) * ahead[k];
    ahead = written.narrow(0, c.word_length, c.overlap);
    frames.push_back(word);
  }
  return torch::cat(frames).slice(0, 0, r.frames);
}

double difference(const std::vector<float>& ours, const Tensor& theirs) {
  EXPECT_EQ(static_cast<std::int64_t>(ours.size()), theirs.numel());
  return (torch::tensor(ours) - theirs.reshape({-1})).abs().max().item<double>();
}

TEST(Sampler, EqualsAlgorithm2) {
  const MotionCell cell(middle(), 2);
  const Sampler sampler(cell);
  ClipRequest changing = request(3, 31);
  changing.schedule.push_back({4, {2, 1}});
  changing.schedule.push_back({7, {0, 0}});
  for (const double scale : {1.0, 0.5, 0.0})
    for (const ClipRequest& r : {request(1, 30), request(2, 1, {2, 1}), changing}) {
      const auto clip = sample_clips(sampler, {r}, {.sigma_scale = scale});
      EXPECT_LT(difference(clip[0], algorithm2(cell, r, scale)), 1e-5) << scale << " " << r.frames;
    }
}

TEST(Sampler, WordsOfEveryOverlapEqualAlgorithm2) {
  for (const int overlap : {0, 1, 3}) {
    MotionCellConfig config = middle();
    config.overlap = overlap;
    const MotionCell cell(config, 2);
    EXPECT_LT(difference(sample_clips(Sampler(cell), {request(1, 17)})[0], algorithm2(cell, request(1, 17), 1)), 1e-5) << overlap;
  }
}

TEST(Sampler, SingleLayerEqualsAlgorithm2) {
  MotionCellConfig config = middle();
  config.single_layer = true;
  config.word_length = 1;
  config.overlap = 0;
  const MotionCell cell(config, 2);
  const Sampler sampler(cell);
  ClipRequest changing = request(3, 17);
  changing.schedule.push_back({4, {2, 1}});
  for (const ClipRequest& r : {request(1, 10), changing}) EXPECT_LT(difference(sample_clips(sampler, {r})[0], algorithm2(cell, r, 1)), 1e-5);
  const auto both = sample_clips(sampler, {request(1, 10), changing}, {.threads = 2, .chunk = 2});
  EXPECT_EQ(both[1], sample_clips(sampler, {changing})[0]);
}

TEST(Sampler, EqualsTheTrainingPathFedWithItsOwnWords) {
  // Teacher forcing on words the sampler made, with the posterior noise that reproduces its z, must reproduce the words
  // where the posterior equals the prior: here both see only the state, since f_w(w)'s columns are cleared.
  const MotionCell cell(middle(), 2);
  const MotionCellConfig& c = cell.config();
  {
    const torch::NoGradGuard guard;
    for (const auto& [posterior, prior] :
         {std::pair{cell.posterior_mu, cell.prior_mu}, {cell.posterior_sigma, cell.prior_sigma}})
      for (int layer = 0; layer < posterior->layer_count(); ++layer) {
        if (layer == 0) {
          posterior->weight(0).zero_();
          posterior->weight(0).slice(1, c.word).copy_(prior->weight(0));
        } else {
          posterior->weight(layer).copy_(prior->weight(layer));
        }
        posterior->bias(layer).copy_(prior->bias(layer));
      }
  }
  const Sampler sampler(cell);
  const ClipRequest r = request(5, 24);
  const auto clip = sample_clips(sampler, {r});
  Random random(r.seed, r.stream);
  CellInput in;
  in.x = torch::zeros({1, 24, c.features()});
  in.classes = torch::tensor({{std::int64_t{1}, std::int64_t{0}}});
  in.initial_noise = nn::normal_tensor({1, 2 * c.hidden}, random);
  in.posterior_noise = nn::normal_tensor({8, 1, c.latent}, random);
  in.replace = torch::ones({8, 1}, torch::kBool);
  const torch::NoGradGuard guard;
  const CellOutput out = cell.forward(in);
  EXPECT_LT(difference(clip[0], out.y[0]), 1e-5);
  EXPECT_LT(out.kl.abs().max().item<double>(), 1e-4);
}

TEST(Sampler, ClipsDoNotDependOnBatchChunkThreadsOrInstructionSet) {
  const MotionCell cell(middle(), 2);
  const Sampler sampler(cell);
  std::vector<ClipRequest> requests;
  for (int i = 0; i < 23; ++i) requests.push_back(request(i, (i * 7) % 40, {i % 3, i % 2}));
  requests[4].schedule.push_back({3, {0, 1}});
  const auto expected = sample_clips(sampler, requests, {.threads = 1, .chunk = 32});
  for (std::size_t i = 0; i < requests.size(); ++i)
    ASSERT_EQ(expected[i].size(), requests[i].frames * static_cast<std::size_t>(cell.config().features()));
  for (const int chunk : {1, 5, 23})
    for (const int threads : {1, 3})
      EXPECT_EQ(sample_clips(sampler, requests, {.threads = threads, .chunk = chunk}), expected);
  std::reverse(requests.begin(), requests.end());
  auto reversed = sample_clips(sampler, requests);
  std::reverse(reversed.begin(), reversed.end());
  EXPECT_EQ(reversed, expected);
  if (nn::best_isa() == nn::Isa::avx512) {
    std::reverse(requests.begin(), requests.end());
    nn::limit_isa(nn::Isa::avx2);
    EXPECT_EQ(sample_clips(sampler, requests), expected);
    nn::limit_isa(nn::Isa::avx512);
  }
}

TEST(Sampler, StreamsAndSeedsDiffer) {
  const MotionCell cell(middle(), 2);
  const Sampler sampler(cell);
  const auto clips = sample_clips(sampler, {request(1, 9), request(2, 9), request(1, 9)});
  EXPECT_EQ(clips[0], clips[2]);
  EXPECT_NE(clips[0], clips[1]);
}

TEST(Sampler, SigmaScaleZeroLeavesOnlyTheInitialState) {
  const MotionCell cell(middle(), 2);
  const Sampler sampler(cell);
  std::vector<std::int64_t> classes{0, 0};
  SampleStream a(sampler, {Random(1, 1)}, classes, 0), b(sampler, {Random(1, 1)}, classes, 1);
  std::vector<float> fa(cell.config().word_features()), fb(fa.size());
  a.next(fa.data());
  b.next(fb.data());
  EXPECT_NE(fa, fb);
}

TEST(Sampler, WrongClassesAreRefused) {
  const MotionCell cell(middle(), 2);
  const Sampler sampler(cell);
  EXPECT_THROW(sample_clips(sampler, {request(1, 9, {3, 0})}), Error);
  EXPECT_THROW(sample_clips(sampler, {request(1, 9, {0})}), Error);
  EXPECT_THROW(sample_clips(sampler, {ClipRequest{1, 1, 9, {}}}), Error);
  SampleStream stream(sampler, {Random(1, 1)}, std::vector<std::int64_t>{0, 0});
  EXPECT_THROW(stream.set_classes(0, std::vector<std::int64_t>{0, 2}), Error);
}

}  // namespace
}  // namespace mocap::motion_cell
