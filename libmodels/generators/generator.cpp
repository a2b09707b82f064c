#include "libmodels/generators/generator.hpp"

#include "libmocap/base/error.hpp"
#include "libmodels/generators/baseline_generator.hpp"
#include "libmodels/generators/cae_vae_generator.hpp"
#include "libmodels/generators/lstm_gmm_generator.hpp"
#include "libmodels/generators/motion_cell_generator.hpp"

namespace mocap::generators {
namespace {

// One line a kind: a new model is known to `sample` once it stands here.
struct Entry {
  const char* kind;
  std::unique_ptr<Generator> (*make)(const store::ModelFile&, const std::string&);
};
constexpr Entry kKinds[] = {{"motion-cell", make_motion_cell_generator}, {"quaternet", make_baseline_generator}, {"erd", make_baseline_generator}, {"lstm-gmm", make_lstm_gmm_generator}, {"cae-vae", make_cae_vae_generator}};

}  // namespace

void FitReport::add(const PositionFit& fit, const std::string& clip, const Skeleton& skeleton, const std::vector<int>& joints) {
  const auto frames = static_cast<double>(fit.frames);
  for (std::size_t j = 0; j < fit.joints.size(); ++j) {
    sum_mm += fit.joints[j].mean_mm * frames;
    points += frames;
    if (fit.joints[j].worst_mm > worst_mm) worst_mm = fit.joints[j].worst_mm, worst_clip = clip, worst_joint = skeleton.joint_names[static_cast<std::size_t>(joints[j])];
  }
}

std::vector<Clip> Generator::reconstruct(const std::vector<Clip>&, const SampleSettings&) const { throw Error(Exit::internal, {}, "a generator of kind " + kind() + " has no latent space"); }

void label_as_ordered(Clip& clip, const ClipOrder& order) {
  clip.attributes = order.attributes;
  clip.segments.clear();
  if (order.schedule.empty()) return;
  const auto frames = static_cast<std::int64_t>(clip.frames());
  const auto add = [&](std::int64_t from, std::int64_t to, const Attributes& attributes) {
    if (from >= std::min(to, frames)) return;
    clip.segments.push_back({from, std::min(to, frames) - from, attributes});
    std::erase_if(clip.attributes, [&](const auto& item) {
      const auto at = attributes.find(item.first);
      return at == attributes.end() || at->second != item.second;
    });
  };
  add(0, order.schedule[0].frame, order.attributes);
  for (std::size_t k = 0; k < order.schedule.size(); ++k) add(order.schedule[k].frame, k + 1 < order.schedule.size() ? order.schedule[k + 1].frame : frames, order.schedule[k].attributes);
}

std::unique_ptr<Generator> make_generator(const store::ModelFile& model, const std::string& file) {
  std::string known;
  for (const auto& entry : kKinds) {
    if (model.kind == entry.kind) return entry.make(model, file);
    known += (known.empty() ? "" : ", ") + std::string(entry.kind);
  }
  refuse({file, 0, {}}, "a model of kind '" + model.kind + "', expected one that generates motion (" + known + ")");
}

}  // namespace mocap::generators
