// What `sample` asks of a trained model, and the list of the kinds that offer it.
#pragma once
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "libmocap/clip/clip.hpp"
#include "libmocap/clip/position_fit.hpp"
#include "libmocap/store/model_file.hpp"

namespace mocap::generators {

struct AttributeChange {
  std::int64_t frame = 0;
  Attributes attributes;  // as in ClipOrder, all of them
};

struct ClipOrder {            // one clip to make
  std::string name;
  Attributes attributes;      // one known value for each attribute of the vocabulary
  std::int64_t frames = 0;
  std::uint64_t stream = 0;   // of its random numbers: equal (seed, stream) give equal clips, alone or in company
  // Of a generator with a latent space: element `axis` (from 1) of the drawn latent is replaced by that quantile of its distribution, N(0, 1).
  struct OnAxis {
    int axis = 1;
    double quantile = 0.5;
  };
  std::optional<OnAxis> axis = {};
  std::optional<double> between = {};  // likewise: 0 is the first window of SampleSettings::between, 1 the second, by their places in the latent space
  std::vector<AttributeChange> schedule = {};  // attributes from later frames on; ascending, above 0, multiples of Generator::schedule_step()
};

// How far rotations found for joint positions are from them, over all clips of a call.
struct FitReport {
  double sum_mm = 0, worst_mm = 0;  // sum over frames and joints
  double points = 0;
  std::string worst_clip, worst_joint;
  double mean_mm() const { return points > 0 ? sum_mm / points : 0; }
  void add(const PositionFit& fit, const std::string& clip, const Skeleton& skeleton, const std::vector<int>& joints);
};

// How far into a generator with a latent space a clip goes before it comes back.
enum class Through { positions, autoencoder, both };

struct SampleSettings {
  std::uint64_t seed = 1;
  int threads = 1;
  double noise_scale = 1;
  // For generators that start from frames; clip `stream` takes init[stream % size].
  std::vector<Clip> init = {};      // clips to start from; empty: what the model brings along
  bool estimate_state = true;       // find the hidden state before the first frame (Wang, Chai, Xia 2018, eq. 26) instead of 0
  double network_noise = 0;         // deviation of noise on the network's input, standardised (their 5.1)
  // For generators with a latent space.
  bool standard_normal = false;    // draw latents from N(0, I) instead of from where the training data lie
  std::vector<Clip> between = {};  // two clips, of each the first window
  Through through = Through::both;
  FitReport* fit = nullptr;        // where given, receives what models of positions lose to bones that keep their length
};

class Generator {
 public:
  virtual ~Generator() = default;
  virtual std::string kind() const = 0;
  virtual const std::map<std::string, std::vector<std::string>>& vocabulary() const = 0;
  // Combinations of values that occurred in training, one value for each attribute, in a fixed order.
  virtual const std::vector<Attributes>& combinations() const = 0;
  virtual std::shared_ptr<const Skeleton> skeleton() const = 0;
  virtual double frame_rate_hz() const = 0;
  virtual std::string contacts_rule() const = 0;  // of the archive it was trained on; "model" where the model labels contacts itself
  virtual std::int64_t default_frames() const = 0;
  virtual std::int64_t schedule_step() const { return 1; }  // frames: attributes can change at multiples of it
  virtual bool starts_from_frames() const { return false; }
  virtual int latent_dimensions() const { return 0; }  // of a latent space that a whole motion has a place in; 0: none
  // Of a generator with a latent space: each clip through it and back, as long as it was and where it was. Error(data) for clips shorter than a window, of another body or rate.
  virtual std::vector<Clip> reconstruct(const std::vector<Clip>& originals, const SampleSettings& settings) const;
  // Clips in the order asked for, labelled by label_as_ordered, first frame above the origin with heading 0 (+X), contacts labelled by the rule or the model.
  virtual std::vector<Clip> sample(const std::vector<ClipOrder>& orders, const SampleSettings& settings) const = 0;
};

// Puts the attributes ordered on a clip: where they change, a segment for each stretch with all of them, and on the clip those that stay the same.
void label_as_ordered(Clip& clip, const ClipOrder& order);

// The generator a model file holds. Error(data) for kinds that generate nothing, naming those that do.
std::unique_ptr<Generator> make_generator(const store::ModelFile& model, const std::string& file);

}  // namespace mocap::generators
