#include "libmodels/baselines/sampler.hpp"

#include <algorithm>
#include <numeric>

#include "libmocap/base/error.hpp"
#include "libmocap/base/parallel.hpp"
#include "libmodels/baselines/packed_network.hpp"

namespace mocap::baselines {
namespace {

using nn::View;

std::vector<float> values(const torch::Tensor& t) {
  const torch::Tensor c = t.detach().to(torch::kFloat).contiguous();
  return {c.data_ptr<float>(), c.data_ptr<float>() + c.numel()};
}

// Rows of clips generated side by side. A finished clip's place is taken by the last one.
class Chunk {
 public:
  Chunk(const BaselineConfig& config, const NetworkWeights<float>& weights, const std::vector<float>& mu, const std::vector<float>& sigma, const std::vector<const ClipRequest*>& requests, double scale)
      : c_(config), w_(weights) {
    const std::size_t n = requests.size(), d = static_cast<std::size_t>(w_.features), s = static_cast<std::size_t>(w_.state), h = static_cast<std::size_t>(w_.hidden);
    input_.resize(n * static_cast<std::size_t>(w_.input));
    state_.resize(n * s);
    y_.resize(n * d);
    gates_.resize(n * 8 * h);
    scratch_.resize(n * 6 * h);
    for (auto [layers, mlp] : {std::pair{&encoded_, &w_.encoder}, {&decoded_, &w_.decoder}})
      for (const auto& layer : mlp->layers) layers->emplace_back(n * static_cast<std::size_t>(layer.out()));
    for (std::size_t i = 0; i < n; ++i) {
      set_classes(i, requests[i]->schedule[0].classes);
      Random random(requests[i]->seed, requests[i]->stream);
      const std::size_t row = static_cast<std::size_t>(c_.combination(requests[i]->schedule[0].classes)) * s;
      for (std::size_t k = 0; k < s; ++k) state_[i * s + k] = mu[row + k] + static_cast<float>(scale) * sigma[row + k] * static_cast<float>(random.normal());
    }
    w_.start.forward(static_cast<int>(n), {state_.data(), w_.state}, {{input_.data(), w_.input}});
  }

  void set_classes(std::size_t clip, const std::vector<std::int64_t>& classes) {
    (void)c_.combination(classes);
    float* one_hot = &input_[clip * static_cast<std::size_t>(w_.input) + static_cast<std::size_t>(w_.features)];
    std::fill_n(one_hot, w_.input - w_.features, 0.0f);
    for (std::size_t a = 0; a < classes.size(); ++a) {
      one_hot[classes[a]] = 1;
      one_hot += c_.attribute_classes[a];
    }
  }

  // The next frame of every clip; what the frame after it follows from is laid down.
  void next(int clips) {
    const View<float> input{input_.data(), w_.input}, state{state_.data(), w_.state}, y{y_.data(), w_.features};
    float* gates_2 = gates_.data() + static_cast<std::ptrdiff_t>(clips) * 4 * w_.hidden;
    w_.frame(clips, {input, layers(encoded_, w_.encoder), state, state, gates_.data(), gates_2, scratch_.data(), layers(decoded_, w_.decoder), y});
    w_.feed_back(clips, y, input);
  }

  const float* frame(std::size_t clip) const { return &y_[clip * static_cast<std::size_t>(w_.features)]; }

  void move(std::size_t from, std::size_t to) {
    if (from == to) return;
    for (auto [rows, width] : {std::pair{&input_, w_.input}, {&state_, w_.state}, {&y_, w_.features}})
      std::copy_n(rows->begin() + static_cast<std::ptrdiff_t>(from) * width, width, rows->begin() + static_cast<std::ptrdiff_t>(to) * width);
  }

 private:
  static std::vector<View<float>> layers(std::vector<std::vector<float>>& memory, const nn::PackedMlp<float>& mlp) {
    std::vector<View<float>> all;
    for (std::size_t i = 0; i < memory.size(); ++i) all.push_back({memory[i].data(), mlp.layers[i].out()});
    return all;
  }

  const BaselineConfig& c_;
  const NetworkWeights<float>& w_;
  std::vector<float> input_, state_, y_, gates_, scratch_;
  std::vector<std::vector<float>> encoded_, decoded_;
};

}  // namespace

Sampler::Sampler(const Network& network)
    : config_(network.config()), packed_(network.pack(false)), initial_mu_(values(network.initial_mu)), initial_sigma_(values(network.initial_log_sigma.detach().exp())) {
  if (!packed_->single) throw Error(Exit::internal, {}, "sampler: parameters are double, expected float");
}

std::vector<std::vector<float>> Sampler::sample(const std::vector<ClipRequest>& requests, const SampleOptions& options) const {
  const auto features = static_cast<std::size_t>(config_.features());
  std::vector<std::vector<float>> clips(requests.size());
  const std::size_t chunk = static_cast<std::size_t>(std::max(1, options.chunk));
  parallel_for((requests.size() + chunk - 1) / chunk, options.threads, [&](std::size_t part) {
    std::vector<std::size_t> ids(std::min(chunk, requests.size() - part * chunk));
    std::iota(ids.begin(), ids.end(), part * chunk);
    std::erase_if(ids, [&](std::size_t id) { return requests[id].frames <= 0; });
    if (ids.empty()) return;
    std::vector<const ClipRequest*> own;
    for (const std::size_t id : ids) {
      const ClipRequest& r = requests[id];
      if (r.schedule.empty() || r.schedule[0].frame != 0) throw Error(Exit::internal, {}, "sampler: a clip has no classes at frame 0");
      own.push_back(&r);
      clips[id].reserve(static_cast<std::size_t>(r.frames) * features);
    }
    Chunk rows(config_, *packed_->single, initial_mu_, initial_sigma_, own, options.sigma_scale);
    for (std::int64_t t = 0; !ids.empty(); ++t) {
      if (t > 0)
        for (std::size_t i = 0; i < ids.size(); ++i)
          for (const auto& change : requests[ids[i]].schedule)
            if (change.frame == t) rows.set_classes(i, change.classes);
      rows.next(static_cast<int>(ids.size()));
      for (std::size_t i = ids.size(); i-- > 0;) {
        const float* frame = rows.frame(i);
        clips[ids[i]].insert(clips[ids[i]].end(), frame, frame + features);
        if (t + 1 < requests[ids[i]].frames) continue;
        rows.move(ids.size() - 1, i);
        ids[i] = ids.back();
        ids.pop_back();
      }
    }
  });
  return clips;
}

}  // namespace mocap::baselines
