#include "libmodels/generators/cae_vae_generator.hpp"

#include <fmt/core.h>

#include <unsupported/Eigen/SpecialFunctions>

#include "libmocap/base/error.hpp"
#include "libmocap/base/parallel.hpp"
#include "libmocap/clip/ground.hpp"
#include "libmocap/clip/position_fit.hpp"
#include "libmocap/features/motegi.hpp"
#include "libmodels/cae_vae/codec.hpp"
#include "libmodels/cae_vae/model.hpp"
#include "libmodels/nn/blas.hpp"

namespace mocap::generators {
namespace {

class CaeVaeGenerator final : public Generator {
 public:
  CaeVaeGenerator(const store::ModelFile& file, const std::string& name)
      : model_(cae_vae::read(file, name)), codec_(*model_.network), joints_(features::motegi_joints(*model_.reference.skeleton)), fitter_(model_.reference.skeleton, joints_, model_.natural), preset_(contact_preset(model_.contacts_rule.substr(7))) {}

  std::string kind() const override { return "cae-vae"; }
  const std::map<std::string, std::vector<std::string>>& vocabulary() const override { return vocabulary_; }
  const std::vector<Attributes>& combinations() const override { return combinations_; }
  std::shared_ptr<const Skeleton> skeleton() const override { return model_.reference.skeleton; }
  double frame_rate_hz() const override { return model_.reference.frame_rate_hz; }
  std::string contacts_rule() const override { return model_.contacts_rule; }
  std::int64_t default_frames() const override { return model_.network->config().window; }
  int latent_dimensions() const override { return model_.network->config().latent; }

  std::vector<Clip> sample(const std::vector<ClipOrder>& orders, const SampleSettings& settings) const override {
    const cae_vae::Drawing drawing{settings.standard_normal ? nullptr : &model_.prior, settings.noise_scale};
    std::vector<cae_vae::Latent> ends;
    for (const Clip& clip : settings.between) ends.push_back(codec_.encode(rows_of(clip, features::motegi_positions(clip)).data_ptr<float>()));
    std::vector<cae_vae::ClipRequest> requests;
    for (const auto& order : orders) {
      requests.push_back({settings.seed, order.stream, order.frames, {}});
      if (order.between) {
        if (ends.size() != 2) throw Error(Exit::internal, {}, "a place between windows that were not given");
        cae_vae::Latent z = ends[0];
        for (std::size_t k = 0; k < z.size(); ++k) z[k] += static_cast<float>(*order.between) * (ends[1][k] - z[k]);
        requests.back().latent = std::move(z);
      } else if (order.axis) {
        cae_vae::Latent z = codec_.draw(settings.seed, order.stream, drawing);
        z.at(static_cast<std::size_t>(order.axis->axis - 1)) = static_cast<float>(Eigen::numext::ndtri(order.axis->quantile));
        requests.back().latent = std::move(z);
      }
    }
    const auto rows = codec_.sample(requests, drawing, settings.threads);
    std::vector<Clip> clips(orders.size());
    std::vector<PositionFit> fits(settings.fit ? orders.size() : 0);
    parallel_for(orders.size(), settings.threads, [&](std::size_t i) {
      clips[i] = to_clip(rows[i].data(), orders[i].frames, {}, settings.fit ? &fits[i] : nullptr);
      clips[i].name = orders[i].name;
      label_as_ordered(clips[i], orders[i]);
    });
    add(settings.fit, fits, clips);
    return clips;
  }

  std::vector<Clip> reconstruct(const std::vector<Clip>& originals, const SampleSettings& settings) const override {
    std::vector<Clip> clips(originals.size());
    std::vector<PositionFit> fits(settings.fit ? originals.size() : 0);
    parallel_for(originals.size(), settings.threads, [&](std::size_t i) {
      nn::initialize_worker_thread();
      const auto frames = static_cast<std::int64_t>(originals[i].frames());
      const auto positions = features::motegi_positions(originals[i]);
      const torch::Tensor x = rows_of(originals[i], positions);
      clips[i] = without_frames(originals[i]);
      std::vector<float> rows;
      if (settings.through == Through::positions)
        rows.assign(x.data_ptr<float>(), x.data_ptr<float>() + x.numel());
      else
        rows = codec_.reconstruct(x.data_ptr<float>(), frames, settings.through == Through::both);
      Clip made = to_clip(rows.data(), frames, features::motegi_placement(positions), settings.fit ? &fits[i] : nullptr);
      clips[i].rotations = std::move(made.rotations);
      clips[i].root_position = std::move(made.root_position);
      clips[i].contacts = std::move(made.contacts);
      clips[i].segments = originals[i].segments;
    });
    add(settings.fit, fits, clips);
    return clips;
  }

 private:
  // (T, 58) standardised.
  torch::Tensor rows_of(const Clip& clip, const features::FeatureMatrix& positions) const {
    const Where where{{}, 0, "clip " + clip.name};
    train::check_alike(*clip.skeleton, clip.frame_rate_hz, model_.reference, where, "the model");
    const auto window = static_cast<std::size_t>(model_.network->config().window);
    if (clip.frames() < window) refuse(where, fmt::format("{} frames, expected the {} of the model's window at least", clip.frames(), window));
    return cae_vae::standardised(features::encode_motegi(positions, clip.frame_rate_hz), model_.reference);
  }

  // Above the origin, or at `start`.
  Clip to_clip(const float* rows, std::int64_t frames, const std::optional<features::MotegiPlacement>& start, PositionFit* fit) const {
    const auto& reference = model_.reference;
    const auto positions = features::decode_motegi(cae_vae::restored(rows, frames, reference), reference.frame_rate_hz, start.value_or(features::MotegiPlacement{0, 0, 0, model_.floor_m}));
    PositionFit found = fitter_(positions, reference.frame_rate_hz);
    Clip clip = std::move(found.clip);
    if (!start) {  // the features' heading is that of shoulders and hip, a clip's that of its pelvis
      const Quaternion turn = yaw_rotation(-yaw_of(clip.rotations[0]));
      for (std::size_t t = 0; t < clip.frames(); ++t) {
        clip.root_position[t] = turn * clip.root_position[t];
        clip.frame(t)[0] = turn * clip.frame(t)[0];
      }
      make_sign_continuous(clip);
    }
    clip.contacts = label_contacts(clip, preset_);
    if (fit) *fit = std::move(found);
    return clip;
  }

  void add(FitReport* report, const std::vector<PositionFit>& fits, const std::vector<Clip>& clips) const {
    for (std::size_t i = 0; i < fits.size(); ++i) report->add(fits[i], clips[i].name, *model_.reference.skeleton, joints_);
  }

  cae_vae::Model model_;
  cae_vae::Codec codec_;
  std::vector<int> joints_;
  PositionFitter fitter_;
  const ContactPreset& preset_;
  std::map<std::string, std::vector<std::string>> vocabulary_;
  std::vector<Attributes> combinations_ = {{}};
};

}  // namespace

std::unique_ptr<Generator> make_cae_vae_generator(const store::ModelFile& model, const std::string& file) { return std::make_unique<CaeVaeGenerator>(model, file); }

}  // namespace mocap::generators
