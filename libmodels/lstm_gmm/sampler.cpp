#include "libmodels/lstm_gmm/sampler.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "libmocap/base/error.hpp"
#include "libmocap/base/parallel.hpp"
#include "libmocap/base/random.hpp"

namespace mocap::lstm_gmm {

using nn::View;

struct Sampler::Weights {
  nn::PackedMlp<float> encoder, decoder;
  nn::PackedLstm<float> lstm_1, lstm_2;
};

// Clips generated side by side. A finished clip's place is taken by the last one.
class Sampler::Rows {
 public:
  Rows(const LstmGmmConfig& config, const Weights& weights, const std::vector<const ClipRequest*>& requests, const SampleOptions& options) : c_(config), w_(weights), o_(options) {
    const std::size_t n = requests.size();
    const auto of = [n](int width) { return std::vector<float>(n * static_cast<std::size_t>(width)); };
    frame_ = of(c_.input());
    input_ = of(c_.input());
    state_ = of(c_.state());
    encoded_ = of(c_.width);
    hidden_ = of(c_.width);
    gates_ = of(4 * c_.hidden);
    y_ = of(c_.outputs());
    for (std::size_t i = 0; i < n; ++i) {
      requests_.push_back(requests[i]);
      random_.emplace_back(requests[i]->seed, requests[i]->stream);
      std::copy_n(requests[i]->first.begin(), c_.input(), row(frame_, i, c_.input()));
      if (!requests[i]->state.empty()) std::copy_n(requests[i]->state.begin(), c_.state(), row(state_, i, c_.state()));
    }
  }

  const float* frame(std::size_t clip) { return row(frame_, clip, c_.input()); }

  // Every clip's next frame, number t, takes the place of the one before.
  void next(int clips, std::size_t t) {
    std::copy_n(frame_.begin(), static_cast<std::ptrdiff_t>(clips) * c_.input(), input_.begin());
    if (o_.input_noise > 0)
      for (std::size_t i = 0; i < static_cast<std::size_t>(clips); ++i) {
        float* x = row(input_, i, c_.input());
        for (int k = 0; k < c_.features; ++k) x[k] += static_cast<float>(o_.input_noise * random_[i].normal());
      }
    const View<float> s{state_.data(), c_.state()}, encoded{encoded_.data(), c_.width}, hidden{hidden_.data(), c_.width}, y{y_.data(), c_.outputs()};
    w_.encoder.forward(clips, {input_.data(), c_.input()}, {encoded});
    for (const auto& [lstm, in, at] : {std::tuple{&w_.lstm_1, encoded, 0}, std::tuple{&w_.lstm_2, s, 2 * c_.hidden}}) {
      const View<float> h = s.from_column(at), m = s.from_column(at + c_.hidden);
      lstm->forward(clips, in, h, m, h, m, gates_.data());
    }
    w_.decoder.forward(clips, s.from_column(2 * c_.hidden), {hidden, y});
    const auto width = static_cast<std::size_t>(c_.input()), drawn = static_cast<std::size_t>(1 + c_.features);
    for (std::size_t i = 0; i < static_cast<std::size_t>(clips); ++i) {
      const ClipRequest& r = *requests_[i];
      if (t * width <= r.given.size())
        std::copy_n(r.given.begin() + static_cast<std::ptrdiff_t>((t - 1) * width), width, row(frame_, i, c_.input()));
      else
        draw(row(y_, i, c_.outputs()), row(input_, i, c_.input()), random_[i], r.draws.empty() ? nullptr : r.draws.data() + (t - 1) * drawn, row(frame_, i, c_.input()));
    }
  }

  void move(std::size_t from, std::size_t to) {
    if (from == to) return;
    for (auto [rows, width] : {std::pair{&frame_, c_.input()}, {&state_, c_.state()}}) std::copy_n(row(*rows, from, width), width, row(*rows, to, width));
    random_[to] = random_[from];
    requests_[to] = requests_[from];
  }

 private:
  static float* row(std::vector<float>& rows, std::size_t i, int width) { return rows.data() + i * static_cast<std::size_t>(width); }

  void draw(const float* y, const float* seen, Random& random, const float* draws, float* x) const {
    const int m = c_.mixtures, d = c_.features;
    int component = static_cast<int>(std::max_element(y, y + m) - y);
    if (o_.sigma_scale > 0) {
      const double most = y[component];
      double sum = 0;
      for (int i = 0; i < m; ++i) sum += std::exp(y[i] - most);
      double left = (draws ? 0.5 * std::erfc(-draws[0] / std::numbers::sqrt2) : random.uniform()) * sum;
      for (component = 0; component < m - 1; ++component)
        if ((left -= std::exp(y[component] - most)) < 0) break;
    }
    const auto carry = static_cast<float>(c_.carry);
    const float *mean = y + m + component * d, *sigma = y + m + (m + component) * d, *contacts = y + m + 2 * m * d;
    for (int k = 0; k < d; ++k) {
      x[k] = mean[k] + carry * seen[k];
      if (o_.sigma_scale > 0) x[k] += static_cast<float>(o_.sigma_scale * std::exp(std::max<double>(kLeastLogSigma, sigma[k])) * (draws ? draws[1 + k] : random.normal()));
    }
    for (int k = 0; k < c_.contacts; ++k) x[d + k] = contacts[k] > 0 ? 1.0f : 0.0f;
  }

  const LstmGmmConfig& c_;
  const Weights& w_;
  const SampleOptions& o_;
  std::vector<const ClipRequest*> requests_;
  std::vector<Random> random_;
  std::vector<float> frame_, input_, state_, encoded_, hidden_, gates_, y_;
};

Sampler::Sampler(const Network& n) : config_(n.config()) {
  if (n.lstm_1->weight_ih.scalar_type() != torch::kFloat) throw Error(Exit::internal, {}, "sampler: parameters are double, expected float");
  weights_.reset(new Weights{n.encoder->pack<float>(0, false), n.decoder->pack<float>(0, false), n.lstm_1->pack<float>(false), n.lstm_2->pack<float>(false)});
}

Sampler::~Sampler() = default;

std::vector<std::vector<float>> Sampler::sample(const std::vector<ClipRequest>& requests, const SampleOptions& options) const {
  const auto width = static_cast<std::size_t>(config_.input());
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
      if (r.first.size() != width || (!r.state.empty() && r.state.size() != static_cast<std::size_t>(config_.state())))
        throw Error(Exit::internal, {}, fmt::format("sampler: a start of {} and {} values, expected {} and {}", r.first.size(), r.state.size(), width, config_.state()));
      const auto drawn = static_cast<std::size_t>(r.frames - 1) * static_cast<std::size_t>(1 + config_.features);
      if (r.given.size() % width != 0 || (!r.draws.empty() && r.draws.size() != drawn))
        throw Error(Exit::internal, {}, fmt::format("sampler: {} values given and {} drawn, expected frames of {} and {}", r.given.size(), r.draws.size(), width, drawn));
      own.push_back(&r);
      clips[id].reserve(static_cast<std::size_t>(r.frames) * width);
    }
    Rows rows(config_, *weights_, own, options);
    for (std::int64_t t = 0; !ids.empty(); ++t) {
      if (t > 0) rows.next(static_cast<int>(ids.size()), static_cast<std::size_t>(t));
      for (std::size_t i = ids.size(); i-- > 0;) {
        const float* frame = rows.frame(i);
        clips[ids[i]].insert(clips[ids[i]].end(), frame, frame + width);
        if (t + 1 < requests[ids[i]].frames) continue;
        rows.move(ids.size() - 1, i);
        ids[i] = ids.back();
        ids.pop_back();
      }
    }
  });
  return clips;
}

}  // namespace mocap::lstm_gmm
