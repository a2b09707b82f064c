#include "libmodels/cae_vae/codec.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "libmocap/base/error.hpp"
#include "libmocap/base/parallel.hpp"
#include "libmocap/features/motegi.hpp"
#include "libmodels/nn/blas.hpp"

namespace mocap::cae_vae {
namespace {

using torch::Tensor;

constexpr std::int64_t kColumns = features::kMotegiColumns;
constexpr std::int64_t kPiece = 64;  // windows decoded at a time
constexpr int kPasses = 2;           // through the latent space, of a window that goes on
enum Draw : std::uint64_t { kLatent = 201 };

Tensor window_of(const float* x, std::int64_t frames) { return torch::from_blob(const_cast<float*>(x), {1, frames, kColumns}, torch::kFloat32); }

// `next` over the last `overlap` frames of `motion`, then behind it.
void append_blended(std::vector<float>& motion, const std::vector<float>& next, std::int64_t overlap) {
  const std::size_t shared = static_cast<std::size_t>(overlap * kColumns), begin = motion.size() - shared;
  for (std::int64_t t = 0; t < overlap; ++t) {
    const float u = (static_cast<float>(t) + 0.5F) / static_cast<float>(overlap), w = u * u * (3 - 2 * u);
    for (std::int64_t c = 0; c < kColumns; ++c) {
      const auto k = static_cast<std::size_t>(t * kColumns + c);
      motion[begin + k] += w * (next[k] - motion[begin + k]);
    }
  }
  motion.insert(motion.end(), next.begin() + static_cast<std::ptrdiff_t>(shared), next.end());
}

}  // namespace

Decoder::Decoder(const Network& network) : config_(network.config()) {
  const torch::NoGradGuard no_grad;
  const auto& vae = *network.vae;
  const std::int64_t f = config_.filters, half = config_.window / 2, h = config_.hidden;
  hidden_.pack(vae.decoder_weight[0].data_ptr<float>(), config_.latent, config_.hidden, config_.latent, vae.decoder_bias[0].data_ptr<float>(), false);
  // Means alone, frame by frame instead of filter by filter, and back in the units of the first stage.
  const auto by_frame = [&](const Tensor& t) { return t.narrow(0, 0, f * half).reshape({f, half, -1}); };
  const Tensor deviation = network.scale_deviation.view({f, 1, 1}), mean = network.scale_mean.view({f, 1, 1});
  const Tensor weight = (by_frame(vae.decoder_weight[1]) * deviation).transpose(0, 1).contiguous();
  const Tensor bias = (by_frame(vae.decoder_bias[1]) * deviation + mean).transpose(0, 1).contiguous();
  features_.pack(weight.data_ptr<float>(), h, static_cast<int>(f * half), config_.hidden, bias.data_ptr<float>(), false);
  frames_.pack(network.cae->decoder_kernel(), network.cae->decoder_bias());
}

void Decoder::operator()(const float* z, std::int64_t count, float* x) const {
  const std::int64_t f = config_.filters, half = config_.window / 2, h = config_.hidden, window = config_.window, edge = config_.kernel / 2;
  std::vector<float> hidden(static_cast<std::size_t>(std::min(count, kPiece) * h)), features(static_cast<std::size_t>(std::min(count, kPiece) * f * half));
  const bool linear = config_.upsampling == Upsampling::linear;
  std::vector<float> padded(static_cast<std::size_t>((window + 2 * edge) * f), 0.0F);
  for (std::int64_t begin = 0; begin < count; begin += kPiece) {
    const std::int64_t rows = std::min(kPiece, count - begin);
    hidden_.forward(static_cast<int>(rows), {z + begin * config_.latent, config_.latent}, {hidden.data(), h});
    for (std::int64_t i = 0; i < rows * h; ++i) hidden[static_cast<std::size_t>(i)] = std::max(0.0F, hidden[static_cast<std::size_t>(i)]);
    features_.forward(static_cast<int>(rows), {hidden.data(), h}, {features.data(), f * half});
    for (std::int64_t r = 0; r < rows; ++r) {
      const float* own = features.data() + r * half * f;
      for (std::int64_t t = 0; t < window; ++t) {
        const std::int64_t at = t / 2, other = std::clamp<std::int64_t>(t % 2 == 0 ? at - 1 : at + 1, 0, half - 1);
        float* to = padded.data() + (edge + t) * f;
        for (std::int64_t c = 0; c < f; ++c) to[c] = linear ? 0.75F * own[at * f + c] + 0.25F * own[other * f + c] : own[at * f + c];
      }
      frames_.forward(window, padded.data(), x + (begin + r) * window * kColumns);
    }
  }
}

Latent Codec::encode(const float* x) const {
  const torch::NoGradGuard no_grad;
  const Tensor z = network_.vae->posterior(network_.standardised(network_.cae->encode(window_of(x, network_.config().window)))).mean.contiguous();
  return {z.data_ptr<float>(), z.data_ptr<float>() + z.numel()};
}

std::vector<float> Codec::through_autoencoder(const float* x) const {
  const torch::NoGradGuard no_grad;
  const Tensor y = network_.cae->decode(network_.cae->encode(window_of(x, network_.config().window))).contiguous();
  return {y.data_ptr<float>(), y.data_ptr<float>() + y.numel()};
}

Latent Codec::draw(Random& random, const Drawing& drawing) const {
  Latent z(static_cast<std::size_t>(network_.config().latent));
  if (drawing.prior) {
    const Eigen::VectorXd drawn = drawing.prior->draw(random, drawing.scale);
    std::copy(drawn.begin(), drawn.end(), z.begin());
    return z;
  }
  for (float& v : z) v = static_cast<float>(drawing.scale * random.normal());
  return z;
}

Latent Codec::draw(std::uint64_t seed, std::uint64_t stream, const Drawing& drawing) const {
  Random random(seed, stream_of(kLatent, stream));
  return draw(random, drawing);
}

std::vector<float> Codec::decode(const Latent& z) const {
  std::vector<float> x(static_cast<std::size_t>(network_.config().window * kColumns));
  decoder_(z.data(), 1, x.data());
  return x;
}

std::vector<float> Codec::long_motion(const ClipRequest& request, const Drawing& drawing) const {
  const std::int64_t window = network_.config().window, overlap = window / 2, latent = network_.config().latent;
  const auto shared = static_cast<std::size_t>(overlap * kColumns), size = static_cast<std::size_t>(window * kColumns);
  Random random(request.seed, stream_of(kLatent, request.stream));
  const Latent drawn = draw(random, drawing);
  std::vector<float> motion = decode(request.latent.value_or(drawn));
  std::vector<float> z(static_cast<std::size_t>(kCandidates * latent)), x(static_cast<std::size_t>(kCandidates) * size);
  while (motion.size() < static_cast<std::size_t>(request.frames * kColumns)) {
    for (int k = 0; k < kCandidates; ++k) {
      const Latent candidate = draw(random, drawing);
      std::copy(candidate.begin(), candidate.end(), z.begin() + k * latent);
    }
    decoder_(z.data(), kCandidates, x.data());
    const float* last = motion.data() + (motion.size() - shared);
    double least = std::numeric_limits<double>::infinity();
    std::size_t best = 0;
    for (std::size_t k = 0; k < kCandidates; ++k) {
      double sum = 0;
      for (std::size_t i = 0; i < shared; ++i) sum += std::pow(static_cast<double>(x[k * size + i] - last[i]), 2);
      if (sum < least) least = sum, best = k;
    }
    std::vector<float> next(x.begin() + static_cast<std::ptrdiff_t>(best * size), x.begin() + static_cast<std::ptrdiff_t>((best + 1) * size));
    for (int pass = 0; pass < kPasses; ++pass) {
      std::copy(last, last + shared, next.begin());
      next = decode(encode(next.data()));
    }
    append_blended(motion, next, overlap);
  }
  motion.resize(static_cast<std::size_t>(request.frames * kColumns));
  return motion;
}

std::vector<std::vector<float>> Codec::sample(const std::vector<ClipRequest>& requests, const Drawing& drawing, int threads) const {
  const std::int64_t window = network_.config().window, latent = network_.config().latent;
  std::vector<std::vector<float>> out(requests.size());
  std::vector<std::size_t> single, longer;  // single: a window is enough
  for (std::size_t i = 0; i < requests.size(); ++i) {
    if (requests[i].latent && static_cast<std::int64_t>(requests[i].latent->size()) != latent) throw Error(Exit::internal, {}, "cae-vae: a latent of another size than the network's");
    (requests[i].frames <= window ? single : longer).push_back(i);
  }
  constexpr auto kAtOnce = static_cast<std::size_t>(kPiece);
  parallel_for((single.size() + kAtOnce - 1) / kAtOnce, threads, [&](std::size_t piece) {
    nn::initialize_worker_thread();
    const std::size_t begin = piece * kAtOnce, rows = std::min(kAtOnce, single.size() - begin), size = static_cast<std::size_t>(window * kColumns);
    std::vector<float> z, x(rows * size);
    for (std::size_t r = 0; r < rows; ++r) {
      const ClipRequest& request = requests[single[begin + r]];
      const Latent own = request.latent ? *request.latent : draw(request.seed, request.stream, drawing);
      z.insert(z.end(), own.begin(), own.end());
    }
    decoder_(z.data(), static_cast<std::int64_t>(rows), x.data());
    for (std::size_t r = 0; r < rows; ++r) {
      const auto first = x.begin() + static_cast<std::ptrdiff_t>(r * size);
      out[single[begin + r]].assign(first, first + requests[single[begin + r]].frames * kColumns);
    }
  });
  parallel_for(longer.size(), threads, [&](std::size_t i) {
    nn::initialize_worker_thread();
    out[longer[i]] = long_motion(requests[longer[i]], drawing);
  });
  return out;
}

std::vector<float> Codec::reconstruct(const float* x, std::int64_t frames, bool latent) const {
  const std::int64_t window = network_.config().window;
  if (frames < window) throw Error(Exit::internal, {}, "cae-vae: a motion shorter than a window");
  const auto again = [&](const float* from) { return latent ? decode(encode(from)) : through_autoencoder(from); };
  std::vector<float> motion = again(x);
  for (std::int64_t first = window / 2; static_cast<std::int64_t>(motion.size()) < frames * kColumns; first += window / 2) {
    first = std::min(first, frames - window);
    append_blended(motion, again(x + first * kColumns), static_cast<std::int64_t>(motion.size()) / kColumns - first);
  }
  return motion;
}

}  // namespace mocap::cae_vae
