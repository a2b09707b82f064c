#include "libmodels/motion_cell/sampler.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>

#include "libmocap/base/error.hpp"
#include "libmocap/base/parallel.hpp"
#include "libmodels/motion_cell/packed_cell.hpp"
#include "libmodels/nn/pointwise.hpp"

namespace mocap::motion_cell {
namespace {

using nn::Start;
using nn::View;

std::vector<float> values(const torch::Tensor& t) {
  const torch::Tensor c = t.detach().to(torch::kFloat).contiguous();
  return {c.data_ptr<float>(), c.data_ptr<float>() + c.numel()};
}

// Parts of the scratch memory, rows x columns each.
class Arena {
 public:
  Arena(std::vector<float>& memory, std::int64_t rows) : memory_(memory), rows_(rows) {}
  View<float> take(std::int64_t columns) {
    const View<float> part{memory_.data() + used_, columns};
    used_ += rows_ * columns;
    if (used_ > static_cast<std::int64_t>(memory_.size()))
      throw Error(Exit::internal, {}, "sampler: scratch memory is too small");
    return part;
  }

 private:
  std::vector<float>& memory_;
  std::int64_t rows_, used_ = 0;
};

// What SampleStream::next takes for one clip: first layers, hidden layers, prior and z, GRU input and word, GRU gates.
std::size_t scratch_columns(const CellWeights<float>& w, const MotionCellConfig& c) {
  std::size_t hidden_layers = 0;
  for (const auto* mlp :
       {&w.prior_mu, &w.prior_sigma, &w.latent_features, &w.decoder, &w.word_features, &w.word_decoder})
    hidden_layers += mlp->layers.empty() ? 0 : mlp->layers.size() - 1;
  return (c.overlap > 0 ? static_cast<std::size_t>(c.written()) : 0) + (3 + hidden_layers) * w.width + 3 * static_cast<std::size_t>(w.latent) + 2 * static_cast<std::size_t>(w.word) +
         static_cast<std::size_t>(w.word_features.layers[0].in()) + 6 * static_cast<std::size_t>(w.hidden);
}

}  // namespace

Sampler::Sampler(const MotionCell& cell)
    : config_(cell.config()),
      packed_(cell.pack(false)),
      initial_mu_(values(cell.initial_mu)),
      initial_sigma_(values(cell.initial_log_sigma.detach().exp())) {
  if (!packed_->single) throw Error(Exit::internal, {}, "sampler: parameters are double, expected float");
}

SampleStream::SampleStream(const Sampler& sampler, std::vector<Random> noise, std::span<const std::int64_t> classes,
                           double sigma_scale)
    : sampler_(&sampler), noise_(std::move(noise)), sigma_scale_(static_cast<float>(sigma_scale)) {
  const CellWeights<float>& w = *sampler.packed_->single;
  const std::size_t clips = noise_.size(), attributes = sampler.config_.attribute_classes.size(),
                    states = 2 * static_cast<std::size_t>(w.hidden);
  if (classes.size() != clips * attributes) throw Error(Exit::internal, {}, "sampler: classes do not match the clips");
  constant_.resize(clips * 3 * w.width);
  state_.resize(clips * states);
  scratch_.resize(clips * scratch_columns(w, sampler.config_));
  ahead_.resize(clips * static_cast<std::size_t>(sampler.config_.overlap * sampler.config_.features()));
  for (std::size_t clip = 0; clip < clips; ++clip) {
    const auto own = classes.subspan(clip * attributes, attributes);
    set_classes(static_cast<int>(clip), own);
    const std::size_t row = static_cast<std::size_t>(sampler.config_.combination(own)) * states;
    for (std::size_t i = 0; i < states; ++i)
      state_[clip * states + i] =
          sampler.initial_mu_[row + i] + sampler.initial_sigma_[row + i] * static_cast<float>(noise_[clip].normal());
  }
}

void SampleStream::set_classes(int clip, std::span<const std::int64_t> classes) {
  const CellWeights<float>& w = *sampler_->packed_->single;
  const MotionCellConfig& c = sampler_->config_;
  (void)c.combination(classes);
  std::vector<float> one_hot(c.attribute_total()), control(w.control);
  std::int64_t offset = 0;
  for (std::size_t i = 0; i < classes.size(); ++i) {
    one_hot[offset + classes[i]] = 1;
    offset += c.attribute_classes[i];
  }
  w.control_features.forward(1, {one_hot.data(), c.attribute_total()}, {{control.data(), w.control}});
  w.first_control.forward(1, {control.data(), w.control},
                          {constant_.data() + static_cast<std::ptrdiff_t>(clip) * 3 * w.width, 3 * w.width});
}

void SampleStream::next(float* frames, std::int64_t clip_stride) {
  const CellWeights<float>& w = *sampler_->packed_->single;
  const int B = clips(), P = w.width, H = w.hidden, E = w.word, Z = w.latent;
  Arena arena(scratch_, B);
  const View<float> h{state_.data(), 2 * H};

  const View<float> first = arena.take(3 * P);
  std::copy_n(constant_.data(), static_cast<std::ptrdiff_t>(B) * 3 * P, first.data);
  w.first_state.forward(B, h, first, Start::accumulate);
  nn::elu(B, 2 * P, first.data, first.ld);
  const auto hidden_layers = [&](std::size_t count) {
    std::vector<View<float>> layers;
    for (std::size_t i = 0; i < count; ++i) layers.push_back(arena.take(P));
    return layers;
  };
  auto prior_mu = hidden_layers(w.prior_mu.layers.size() - 1),
       prior_sigma = hidden_layers(w.prior_sigma.layers.size() - 1);
  const View<float> mu = arena.take(Z), sigma = arena.take(Z), z = arena.take(Z);
  prior_mu.push_back(mu);
  prior_sigma.push_back(sigma);
  w.prior_mu.forward(B, first, prior_mu);
  w.prior_sigma.forward(B, first.from_column(P), prior_sigma);
  nn::softplus(static_cast<std::int64_t>(B) * Z, sigma.data, static_cast<float>(kSigmaFloor), sigma.data);
  for (int b = 0; b < B; ++b)
    for (int i = b * Z; i < (b + 1) * Z; ++i)
      z.data[i] = mu.data[i] + sigma_scale_ * sigma.data[i] * static_cast<float>(noise_[b].normal());

  const View<float> input = arena.take(2 * E), latent = input.from_column(E), word = arena.take(w.word_features.layers[0].in());
  auto fz = hidden_layers(w.latent_features.layers.size() - 1);
  fz.push_back(latent);
  w.latent_features.forward(B, z, fz);
  const View<float> decoder_first = first.from_column(2 * P);
  w.decoder_latent.forward(B, latent, decoder_first, Start::accumulate);
  nn::elu(B, P, decoder_first.data, decoder_first.ld);
  auto dec = hidden_layers(w.decoder.layers.size() - 1);
  dec.push_back(word);
  w.decoder.forward(B, decoder_first, dec);
  auto fw = hidden_layers(w.word_features.layers.size() - 1);
  fw.push_back(input);
  w.word_features.forward(B, word, fw);
  const View<float> gates = arena.take(6 * H);
  // The new states overwrite the old: each cell has read its own by then.
  w.gru_1.forward(B, input, h, h, nullptr, gates.data);
  w.gru_2.forward(B, h, h.from_column(H), h.from_column(H), nullptr, gates.data);
  if (w.word_decoder.layers.empty()) {  // the word is the frame
    for (int b = 0; b < B; ++b) std::copy_n(word.data + b * word.ld, word.ld, frames + b * clip_stride);
    return;
  }
  auto out = hidden_layers(w.word_decoder.layers.size() - 1);
  const MotionCellConfig& c = sampler_->config_;
  if (c.overlap == 0) {
    out.push_back({frames, clip_stride});
    w.word_decoder.forward(B, word, out);
    return;
  }
  const View<float> written = arena.take(c.written());
  out.push_back(written);
  w.word_decoder.forward(B, word, out);
  const int D = c.features(), own = c.word_features(), shared = c.overlap * D;
  for (int b = 0; b < B; ++b) {
    const float* from = written.data + b * written.ld;
    float *before = ahead_.data() + static_cast<std::ptrdiff_t>(b) * shared, *to = frames + b * clip_stride;
    std::copy_n(from, own, to);
    if (!first_)
      for (int i = 0; i < shared; ++i) to[i] = before[i] + static_cast<float>(fade_in(i / D, c.overlap)) * (from[i] - before[i]);
    std::copy_n(from + own, shared, before);
  }
  first_ = false;
}

void SampleStream::remove(int clip) {
  const int last = clips() - 1;
  const auto move_row = [&](std::vector<float>& rows) {
    const std::ptrdiff_t width = static_cast<std::ptrdiff_t>(rows.size()) / (last + 1);
    if (clip != last) std::copy_n(rows.begin() + last * width, width, rows.begin() + clip * width);
    rows.resize(last * width);
  };
  move_row(constant_);
  move_row(state_);
  move_row(ahead_);
  noise_[clip] = noise_[last];
  noise_.pop_back();
}

std::vector<std::vector<float>> sample_clips(const Sampler& sampler, const std::vector<ClipRequest>& requests,
                                             const SampleOptions& options) {
  const MotionCellConfig& c = sampler.config();
  const std::int64_t word_values = c.word_features();
  std::vector<std::vector<float>> clips(requests.size());
  const std::size_t chunk = static_cast<std::size_t>(std::max(1, options.chunk)),
                    chunks = (requests.size() + chunk - 1) / chunk;
  parallel_for(chunks, options.threads, [&](std::size_t k) {
    std::vector<std::size_t> ids(std::min(chunk, requests.size() - k * chunk));
    std::iota(ids.begin(), ids.end(), k * chunk);
    std::erase_if(ids, [&](std::size_t id) { return requests[id].frames <= 0; });
    std::vector<Random> noise;
    std::vector<std::int64_t> classes;
    for (const std::size_t id : ids) {
      const ClipRequest& r = requests[id];
      if (r.schedule.empty() || r.schedule[0].word != 0)
        throw Error(Exit::internal, {}, "sampler: a clip has no classes at word 0");
      (void)c.combination(r.schedule[0].classes);
      noise.emplace_back(r.seed, r.stream);
      classes.insert(classes.end(), r.schedule[0].classes.begin(), r.schedule[0].classes.end());
      clips[id].reserve(static_cast<std::size_t>((r.frames + c.word_length - 1) / c.word_length * word_values));
    }
    SampleStream stream(sampler, std::move(noise), classes, options.sigma_scale);
    std::vector<float> frames(ids.size() * static_cast<std::size_t>(word_values));
    for (std::int64_t word = 0; !ids.empty(); ++word) {
      if (word > 0)
        for (std::size_t i = 0; i < ids.size(); ++i)
          for (const auto& change : requests[ids[i]].schedule)
            if (change.word == word) stream.set_classes(static_cast<int>(i), change.classes);
      stream.next(frames.data());
      for (std::size_t i = ids.size(); i-- > 0;) {
        const std::size_t id = ids[i];
        clips[id].insert(clips[id].end(), frames.begin() + i * word_values, frames.begin() + (i + 1) * word_values);
        if ((word + 1) * c.word_length < requests[id].frames) continue;
        clips[id].resize(static_cast<std::size_t>(requests[id].frames * c.features()));
        stream.remove(static_cast<int>(i));
        ids[i] = ids.back();
        ids.pop_back();
      }
    }
  });
  return clips;
}

}  // namespace mocap::motion_cell
