// Training of an attribute classifier (Ghorbani et al. 2020, sections 3.4 and 4.2): cross-entropy, Adam 0.005, 30 epochs, half of the data.
//
// A row of a batch: a length, uniform between `shortest` and `longest` whatever the class; a class, uniform; a clip of that class that is
// long enough, uniform; a place in it, uniform. Duration is then independent of the class (in mocap data it often gives the action away).
// longest is the smallest, over the classes, of the median length of a class's clips, at most `window`; shortest is 0.4 of it. Clips below
// `shortest` are not trained on. Noise of deviation `noise` is added to the standardised inputs. An epoch is as many rows as there are
// clips, or as windows of `longest` frames fill the data, whichever is more. The rate falls exponentially to `final_factor` of itself over
// the training (0.04: by a factor of 0.9 an epoch over 30). The paper gives neither the decay nor noise nor batch.
#pragma once
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "libmocap/store/archive.hpp"
#include "libmodels/classifier/network.hpp"
#include "libmodels/train/schedule.hpp"
#include "libmodels/train/trainable.hpp"

namespace mocap::classifier {

// Two classifiers of opposite halves have seen no source file in common: one may serve in a generator's loss, the other judge it.
enum class Half { all, a, b };
Half parse_half(const std::string& name);  // "all", "A", "B"; Error(usage)
std::string text(Half half);

// Which half each source belongs to: sources (by SHA-256 of the file; path, else name, where there is none) in an order that (seed, source)
// decides, dealt out in turns within the class of their first clip. Depends on sources and labels, not on the order of the clips. [N]
std::vector<Half> halves(const std::vector<std::string>& sources, const std::vector<std::string>& labels, std::uint64_t seed);

// The clips of an archive that an attribute labels, as the network sees them.
class Data {
 public:
  struct Item {
    std::string name;
    torch::Tensor features;  // (T, 2D) standardised
    std::int64_t label = 0;
  };
  // `like`: classes and statistics are those of other data (validation). Error(data): no clip with the attribute, fewer than two classes, a
  // class without a source in the half, one joint; with `like` another skeleton or rate, or a class that the training data does not have.
  Data(const std::string& path, const std::string& attribute, Half half, std::uint64_t half_seed, const Data* like = nullptr);

  const std::vector<Item>& items() const { return items_; }
  const std::string& attribute() const { return attribute_; }
  const std::vector<std::string>& classes() const { return classes_; }
  const std::vector<std::vector<std::size_t>>& members() const { return members_; }  // items of each class, longest first
  const std::vector<float>& mean() const { return mean_; }
  const std::vector<float>& deviation() const { return deviation_; }
  const store::ArchiveHeader& header() const { return header_; }
  const std::vector<std::string>& sources() const { return sources_; }  // sorted SHA-256
  const std::string& digest() const { return digest_; }
  const std::string& file_sha256() const { return file_sha256_; }
  std::int64_t frames() const;
  std::size_t left_out() const { return left_out_; }  // clips without the label

 private:
  store::ArchiveHeader header_;
  std::string attribute_, digest_, file_sha256_;
  std::vector<Item> items_;
  std::vector<std::string> classes_, sources_;
  std::vector<std::vector<std::size_t>> members_;
  std::vector<float> mean_, deviation_;
  std::size_t left_out_ = 0;
};

struct TrainingConfig {
  std::int64_t epochs = 30, batch = 32, window = 120;
  int shards = 2;
  double noise = 0.05, gradient_limit = 5;
  train::LearningRate learning_rate{0.005, 0, 0.04, 0};
  std::uint64_t seed = 1;
  std::string half = "all";
  std::uint64_t half_seed = 1;
};

struct Rows {
  torch::Tensor x;                    // (B, T, 2D), zeros past a row's length
  std::vector<std::int64_t> lengths;  // [B]
  torch::Tensor labels;               // (B) int64
};

class ClassifierTraining final : public train::Trainable {
 public:
  // `validation` may be null. Both must outlive the object. Error(usage) for settings out of range.
  ClassifierTraining(TrainingConfig config, const Data& data, const Data* validation);

  store::ModelFile describe() const override;
  std::string identity() const override;
  train::NamedTensors parameters() override;
  std::int64_t steps() const override { return config_.epochs * steps_per_epoch(); }
  std::int64_t steps_per_epoch() const override;
  double learning_rate(std::int64_t step) const override { return config_.learning_rate.at(step, steps()); }
  double gradient_limit() const override { return config_.gradient_limit; }
  int shards() const override { return config_.shards; }
  void prepare(std::int64_t step) override;
  torch::Tensor shard_loss(int shard, train::LossTerms& terms) override;
  std::optional<double> validation_loss() override;  // mean cross-entropy of whole clips, at most 512 spread over the set

  const Network& network() const { return *network_; }
  std::int64_t shortest() const { return shortest_; }
  std::int64_t longest() const { return longest_; }
  Rows draw(std::int64_t step) const;  // the batch of a step; depends on (seed, step) alone

 private:
  TrainingConfig config_;
  const Data& data_;
  const Data* validation_;
  std::int64_t shortest_ = 1, longest_ = 1;
  std::unique_ptr<Network> network_;
  Rows rows_;
};

}  // namespace mocap::classifier
