// A trained attribute classifier: what labels motion, and what generated motion is judged by (Ghorbani et al. 2020, sections 3.4 and 5.2).
//
// Clips go through libmodels/classifier/network.hpp one at a time, whole: no clip's result depends on the others, on their order or on `threads`.
// Errors of judge(): Error(data) naming the clip for another skeleton (1e-5 m) or rate than the training data's, for features that are not finite,
// joint translations and 0 frames. Cost: 0.6 ms a clip of 136 frames on one core, reading included. Float weights; features and posteriors are
// the doubles they give.
#pragma once
#include <Eigen/Core>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "libmocap/clip/clip.hpp"

namespace mocap::classifier {

class Network;

struct Judged {
  Eigen::MatrixXd features;    // [N,F] last layer before the class scores, double
  Eigen::MatrixXd posteriors;  // [N,C] softmax, double
};

class Classifier {
 public:
  // `file_sha256`, where given, receives the digest of the file's bytes. Error(data) for another kind, and for a model that is damaged or does not fit itself.
  static std::unique_ptr<Classifier> load(const std::string& path, std::string* file_sha256 = nullptr);
  ~Classifier();
  const std::string& attribute() const;
  const std::vector<std::string>& classes() const;
  const std::set<std::string>& train_sources() const;  // SHA-256 of the source files seen in training
  std::shared_ptr<const Skeleton> skeleton() const;
  double frame_rate_hz() const;
  int feature_size() const;                             // F <= 64
  // What judge() puts its clips through: the network, and the statistics that its inputs are standardised by. [2D]
  const Network& network() const;
  const std::vector<float>& mean() const;
  const std::vector<float>& deviation() const;
  Judged judge(const std::vector<Clip>& clips, int threads) const;  // rows in the order of the clips; equal bits for any threads

 private:
  struct State;
  explicit Classifier(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace mocap::classifier
