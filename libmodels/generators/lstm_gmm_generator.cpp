#include "libmodels/generators/lstm_gmm_generator.hpp"

#include <algorithm>
#include <map>

#include "libmocap/base/error.hpp"
#include "libmocap/base/parallel.hpp"
#include "libmocap/clip/ground.hpp"
#include "libmocap/features/state.hpp"
#include "libmodels/lstm_gmm/model.hpp"
#include "libmodels/lstm_gmm/sampler.hpp"
#include "libmodels/nn/blas.hpp"

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
    const std::int64_t kinds = starts.size(0), width = starts.size(2);
    const auto start_of = [&](const ClipOrder& order) { return static_cast<std::int64_t>(order.stream % static_cast<std::uint64_t>(kinds)); };
    std::map<std::int64_t, std::vector<float>> states;  // of the starts that are used
    for (const auto& order : orders) states[start_of(order)];
    if (settings.estimate_state) estimate(starts, states, settings.threads);
    std::vector<lstm_gmm::ClipRequest> requests;
    for (const auto& order : orders) {
      const float* first = starts.data_ptr<float>() + 2 * start_of(order) * width;
      requests.push_back({settings.seed, order.stream, order.frames, {first, first + width}, states.at(start_of(order))});
    }
    const auto frames = sampler_.sample(requests, {settings.threads, 32, settings.noise_scale, settings.network_noise});
    std::vector<Clip> clips(orders.size());
    parallel_for(orders.size(), settings.threads, [&](std::size_t i) { clips[i] = to_clip(frames[i], orders[i]); });
    return clips;
  }

 private:
  // The state of a start does not depend on the others, so they are found side by side in any portions.
  void estimate(const torch::Tensor& starts, std::map<std::int64_t, std::vector<float>>& states, int threads) const {
    constexpr std::size_t kPortion = 16;
    const std::int64_t size = model_.network->config().state();
    std::vector<std::pair<std::int64_t, std::vector<float>*>> wanted;
    for (auto& [start, state] : states) wanted.emplace_back(start, &state);
    parallel_for((wanted.size() + kPortion - 1) / kPortion, threads, [&](std::size_t part) {
      nn::initialize_worker_thread();
      const std::size_t first = part * kPortion, count = std::min(kPortion, wanted.size() - first);
      std::vector<std::int64_t> rows;
      for (std::size_t i = 0; i < count; ++i) rows.push_back(wanted[first + i].first);
      const torch::Tensor own = starts.index_select(0, torch::tensor(rows, torch::kLong));
      const torch::Tensor found = lstm_gmm::initial_state(*model_.network, own.select(1, 0).contiguous(), own.select(1, 1).contiguous());
      for (std::size_t i = 0; i < count; ++i) {
        const float* values = found.data_ptr<float>() + static_cast<std::int64_t>(i) * size;
        wanted[first + i].second->assign(values, values + size);
      }
    });
  }

  // The first two frames of each clip, (K, 2, input). `both`: the second is needed.
  torch::Tensor pairs_of(const std::vector<Clip>& init, bool both) const {
    std::vector<torch::Tensor> pairs;
    for (const Clip& clip : init) {
      const Where where{{}, 0, "clip " + clip.name};
      train::check_alike(*clip.skeleton, clip.frame_rate_hz, model_.reference, where, "the model");
      if (both && clip.frames() < 2) refuse(where, "1 frame, expected 2, from which the network's state is found");
      const Clip start = clip.frames() > 2 ? cut(clip, 0, 2) : clip;
      // Two frames are too few to label: whether a foot is down is read from all that was given.
      auto contacts = clip.contacts.empty() ? label_contacts(clip, contact_preset("default")) : clip.contacts;
      if (contacts.empty()) refuse(where, "no contacts and no feet to label them of, expected contacts");
      const torch::Tensor rows = train::standardised(features::encode_state(start), contacts, model_.reference);
      pairs.push_back(rows.size(0) == 2 ? rows : rows.repeat({2, 1}));
    }
    return torch::stack(pairs).contiguous();
  }

  Clip to_clip(const std::vector<float>& rows, const ClipOrder& order) const {
    auto [features, contacts] = train::raw_states(rows.data(), order.frames, model_.reference);
    Clip clip = features::decode_state(features, model_.reference.skeleton, model_.reference.frame_rate_hz);
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
