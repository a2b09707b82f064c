#include "libmodels/generators/lstm_gmm_generator.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "libmocap/base/error.hpp"
#include "libmocap/base/parallel.hpp"
#include "libmocap/clip/ground.hpp"
#include "libmocap/features/state.hpp"
#include "libmodels/lstm_gmm/model.hpp"
#include "libmodels/lstm_gmm/sampler.hpp"

namespace mocap::generators {
namespace {

class LstmGmmGenerator final : public Generator {
 public:
  LstmGmmGenerator(const store::ModelFile& file, const std::string& name) : model_(lstm_gmm::read(file, name)), sampler_(*model_.network) {}

  std::string kind() const override { return "lstm-gmm"; }
  const std::map<std::string, std::vector<std::string>>& vocabulary() const override { return vocabulary_; }
  const std::vector<Attributes>& combinations() const override { return combinations_; }
  std::shared_ptr<const Skeleton> skeleton() const override { return model_.reference.skeleton; }
  double frame_rate_hz() const override { return model_.reference.frame_rate_hz; }
  std::string contacts_rule() const override { return "model"; }
  std::int64_t default_frames() const override { return model_.default_frames; }
  bool starts_from_frames() const override { return true; }

  std::vector<Clip> sample(const std::vector<ClipOrder>& orders, const SampleSettings& settings) const override {
    const torch::Tensor starts = settings.init.empty() ? model_.starts : pairs_of(settings.init, settings.estimate_state);
    const std::int64_t kinds = starts.size(0), width = starts.size(2), state_size = model_.network->config().state();
    torch::Tensor states;
    if (settings.estimate_state) states = lstm_gmm::initial_state(*model_.network, starts.select(1, 0).contiguous(), starts.select(1, 1).contiguous());
    std::vector<lstm_gmm::ClipRequest> requests;
    for (const auto& order : orders) {
      const auto i = static_cast<std::int64_t>(order.stream % static_cast<std::uint64_t>(kinds));
      const float* first = starts.data_ptr<float>() + 2 * i * width;
      lstm_gmm::ClipRequest r{settings.seed, order.stream, order.frames, {first, first + width}, {}};
      if (states.defined()) r.state.assign(states.data_ptr<float>() + i * state_size, states.data_ptr<float>() + (i + 1) * state_size);
      requests.push_back(std::move(r));
    }
    const auto frames = sampler_.sample(requests, {settings.threads, 32, settings.noise_scale, settings.network_noise});
    std::vector<Clip> clips(orders.size());
    parallel_for(orders.size(), settings.threads, [&](std::size_t i) { clips[i] = to_clip(frames[i], orders[i]); });
    return clips;
  }

 private:
  // The first two frames of each clip, (K, 2, input). `both`: the second is needed.
  torch::Tensor pairs_of(const std::vector<Clip>& init, bool both) const {
    const auto& [skeleton, rate, mean, deviation] = model_.reference;
    const auto columns = static_cast<std::int64_t>(mean.size());
    torch::Tensor out = torch::zeros({static_cast<std::int64_t>(init.size()), 2, columns + 2});
    float* to = out.data_ptr<float>();
    for (const Clip& clip : init) {
      if (!clip.skeleton->same_as(*skeleton, 1e-5)) refuse({{}, 0, "clip " + clip.name}, "another skeleton than the model's, expected a clip to start from on its body");
      if (std::abs(clip.frame_rate_hz - rate) > 1e-6 * rate) refuse({{}, 0, "clip " + clip.name}, fmt::format("{} Hz, expected the model's {} Hz", clip.frame_rate_hz, rate));
      if (both && clip.frames() < 2) refuse({{}, 0, "clip " + clip.name}, "1 frame, expected 2, from which the network's state is found");
      auto contacts = clip.contacts;
      if (contacts.empty()) contacts = label_contacts(clip, contact_preset("default"));
      const features::FeatureMatrix x = features::encode_state(clip.frames() > 2 ? cut(clip, 0, 2) : clip);
      for (Eigen::Index t = 0; t < 2; ++t) {
        const Eigen::Index from = std::min(t, x.rows() - 1);
        for (std::int64_t c = 0; c < columns; ++c) *to++ = static_cast<float>((x(from, c) - mean[static_cast<std::size_t>(c)]) / deviation[static_cast<std::size_t>(c)]);
        for (const std::uint8_t down : contacts.at(static_cast<std::size_t>(from))) *to++ = down ? 1.0f : 0.0f;
      }
    }
    return out;
  }

  Clip to_clip(const std::vector<float>& rows, const ClipOrder& order) const {
    const auto& [skeleton, rate, mean, deviation] = model_.reference;
    const auto columns = static_cast<Eigen::Index>(mean.size());
    features::FeatureMatrix x(static_cast<Eigen::Index>(order.frames), columns);
    std::vector<std::array<std::uint8_t, 2>> contacts;
    const float* from = rows.data();
    for (Eigen::Index t = 0; t < x.rows(); ++t) {
      for (Eigen::Index c = 0; c < columns; ++c) x(t, c) = static_cast<double>(*from++) * deviation[static_cast<std::size_t>(c)] + mean[static_cast<std::size_t>(c)];
      contacts.push_back({static_cast<std::uint8_t>(from[0] > 0.5f), static_cast<std::uint8_t>(from[1] > 0.5f)});
      from += 2;
    }
    Clip clip = features::decode_state(x, skeleton, rate);
    clip.name = order.name;
    label_as_ordered(clip, order);
    clip.contacts = std::move(contacts);
    return clip;
  }

  lstm_gmm::Model model_;
  lstm_gmm::Sampler sampler_;
  std::map<std::string, std::vector<std::string>> vocabulary_;
  std::vector<Attributes> combinations_ = {{}};
};

}  // namespace

std::unique_ptr<Generator> make_lstm_gmm_generator(const store::ModelFile& model, const std::string& file) { return std::make_unique<LstmGmmGenerator>(model, file); }

}  // namespace mocap::generators
