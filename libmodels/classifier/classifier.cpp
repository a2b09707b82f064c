#include "libmodels/classifier/classifier.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "libmocap/base/error.hpp"
#include "libmocap/base/parallel.hpp"
#include "libmocap/store/model_file.hpp"
#include "libmodels/classifier/network.hpp"
#include "libmodels/nn/blas.hpp"
#include "libmodels/nn/mlp.hpp"
#include "libmodels/train/tensors.hpp"

namespace mocap::classifier {

struct Classifier::State {
  std::string file, attribute;
  std::vector<std::string> classes;
  std::set<std::string> sources;
  std::shared_ptr<const Skeleton> skeleton;
  double rate = 0;
  std::vector<float> mean, deviation;
  std::unique_ptr<Network> network;
  Eigen::MatrixXd score_weight;  // [C,F]
  Eigen::VectorXd score_bias;
};

Classifier::Classifier(std::unique_ptr<State> state) : state_(std::move(state)) {}
Classifier::~Classifier() = default;

std::unique_ptr<Classifier> Classifier::load(const std::string& path, std::string* file_sha256) {
  const store::ModelFile model = store::read_model(path, file_sha256);
  auto s = std::make_unique<State>();
  const std::string file = path == "-" ? "<stdin>" : path;
  s->file = file;
  const train::Described config = train::described(model, "classifier", file);
  NetworkConfig network;
  try {
    network = network_config_from_json(config.network);
  } catch (const Error& e) {
    throw e.in_file(file);
  }
  s->rate = config.frame_rate_hz;
  if (!(std::isfinite(s->rate) && s->rate > 0)) refuse({file, 0, "config"}, "no frame_rate_hz above 0, expected that of the training data");
  s->skeleton = model.skeleton;
  if (!s->skeleton || s->skeleton->joint_count() - 1 != network.joints) refuse({file, 0, "skeleton"}, "another number of joints than the network's");
  if (model.vocabulary.size() != 1) refuse({file, 0, "vocabulary"}, fmt::format("{} attributes, expected one", model.vocabulary.size()));
  s->attribute = model.vocabulary.begin()->first;
  s->classes = model.vocabulary.begin()->second;
  if (static_cast<int>(s->classes.size()) != network.classes) refuse({file, 0, "vocabulary/" + s->attribute}, fmt::format("{} classes, expected the {} of the network", s->classes.size(), network.classes));
  train::check_numbers(model, network.inputs(), network.parameter_count(), file);
  Random random(0, 0);
  s->network = std::make_unique<Network>(network, random);
  const auto parameters = nn::parameters_by_path(*s->network);
  train::load_weights(parameters, model.weights, file);
  for (const auto& [name, tensor] : parameters) {
    const torch::Tensor t = tensor.detach().contiguous();
    using RowMajor = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    if (name == "scores_weight") s->score_weight = Eigen::Map<const RowMajor>(t.data_ptr<float>(), t.size(0), t.size(1)).cast<double>();
    if (name == "scores_bias") s->score_bias = Eigen::Map<const Eigen::VectorXf>(t.data_ptr<float>(), t.size(0)).cast<double>();
  }
  s->mean = model.mean;
  s->deviation = model.deviation;
  s->sources.insert(model.train_sources.begin(), model.train_sources.end());
  return std::unique_ptr<Classifier>(new Classifier(std::move(s)));
}

const std::string& Classifier::attribute() const { return state_->attribute; }
const std::vector<std::string>& Classifier::classes() const { return state_->classes; }
const std::set<std::string>& Classifier::train_sources() const { return state_->sources; }
std::shared_ptr<const Skeleton> Classifier::skeleton() const { return state_->skeleton; }
double Classifier::frame_rate_hz() const { return state_->rate; }
const Network& Classifier::network() const { return *state_->network; }
const std::vector<float>& Classifier::mean() const { return state_->mean; }
const std::vector<float>& Classifier::deviation() const { return state_->deviation; }
int Classifier::feature_size() const { return state_->network->config().features(); }

Judged Classifier::judge(const std::vector<Clip>& clips, int threads) const {
  const State& s = *state_;
  Judged out;
  const auto n = static_cast<Eigen::Index>(clips.size());
  out.features.resize(n, feature_size());
  out.posteriors.resize(n, static_cast<Eigen::Index>(s.classes.size()));
  const Skeleton* checked = nullptr;
  for (const Clip& clip : clips) {
    const Where where{{}, 0, "clip " + clip.name};
    if (clip.skeleton.get() != checked && (!clip.skeleton || !clip.skeleton->same_as(*s.skeleton, 1e-5)))
      refuse(where, "another skeleton than the classifier's, expected the one it was trained on (" + s.file + ")", "canonicalize brings motion to one body");
    checked = clip.skeleton.get();
    if (std::abs(clip.frame_rate_hz - s.rate) > 1e-9 * s.rate)
      refuse(where, fmt::format("{} Hz, expected the {} Hz that the classifier {} was trained at", clip.frame_rate_hz, s.rate, s.file), "canonicalize --fps brings motion to one rate");
  }
  // One clip at a time: what stands beside it in a batch would change its last bits.
  parallel_for(clips.size(), threads, [&](std::size_t i) {
    nn::initialize_worker_thread();
    const torch::NoGradGuard no_grad;
    const torch::Tensor x = standardise(encode(clips[i]), s.mean, s.deviation).unsqueeze(0);
    const torch::Tensor pooled = s.network->features(x, {x.size(1)}).contiguous();
    const Eigen::VectorXd f = Eigen::Map<const Eigen::VectorXf>(pooled.data_ptr<float>(), pooled.size(1)).cast<double>();
    Eigen::VectorXd p = s.score_weight * f + s.score_bias;
    p = (p.array() - p.maxCoeff()).exp();
    out.features.row(static_cast<Eigen::Index>(i)) = f.transpose();
    out.posteriors.row(static_cast<Eigen::Index>(i)) = (p / p.sum()).transpose();
  });
  return out;
}

}  // namespace mocap::classifier
