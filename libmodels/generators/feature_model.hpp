// What every generator of pose features shares: the part of a model file beside the network, checked, and the way from
// standardised features back to clips.
#pragma once
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "libmocap/clip/ground.hpp"
#include "libmocap/features/motion_cell.hpp"
#include "libmodels/generators/generator.hpp"

namespace mocap::generators {

class FeatureGenerator : public Generator {
 public:
  // What a network's sizes say about the rest of the file.
  struct NetworkSizes {
    int joints = 0, rotation_values = 0, root_values = 0;
    std::vector<int> attribute_classes;
    std::int64_t parameters = 0;
  };

  std::string kind() const override { return kind_; }
  const std::map<std::string, std::vector<std::string>>& vocabulary() const override { return vocabulary_; }
  const std::vector<Attributes>& combinations() const override { return combinations_; }
  std::shared_ptr<const Skeleton> skeleton() const override { return skeleton_; }
  double frame_rate_hz() const override { return rate_; }
  std::string contacts_rule() const override { return contacts_; }
  std::int64_t default_frames() const override { return default_frames_; }

 protected:
  // Reads /config (keys representation, frame_rate_hz, contacts, combinations, default_frames, and what `read_network`
  // takes from `network`) and checks skeleton, normalisation, vocabulary, combinations and the number of weights against
  // it, before any network is built: a few numbers in a small file must not ask for all memory. Error(data) naming the
  // part. `what`: the model in words, for messages.
  FeatureGenerator(const store::ModelFile& model, const std::string& file, const std::string& what, const std::function<NetworkSizes(const nlohmann::json& network)>& read_network);

  // One class for each attribute, in vocabulary order. Error(internal) where one is not set to a known value.
  std::vector<std::int64_t> classes_of(const Attributes& attributes) const;
  // (frames, features) standardised, row-major -> the clip, named, labelled, contacts by the model's rule.
  Clip to_clip(const std::vector<float>& standardised, const ClipOrder& order) const;

  const std::vector<float>& mean() const { return mean_; }
  const std::vector<float>& deviation() const { return deviation_; }

 private:
  std::string kind_;
  std::map<std::string, std::vector<std::string>> vocabulary_;
  std::vector<Attributes> combinations_;
  std::shared_ptr<const Skeleton> skeleton_;
  std::vector<float> mean_, deviation_;
  features::RotationRepresentation representation_{};
  double rate_ = 30;
  std::string contacts_;
  const ContactPreset* preset_ = nullptr;
  std::int64_t default_frames_ = 0;
};

}  // namespace mocap::generators
