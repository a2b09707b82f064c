#include "libmodels/classifier/training.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "libmocap/base/error.hpp"
#include "libmocap/base/random.hpp"
#include "libmocap/base/sha256.hpp"
#include "libmodels/nn/mlp.hpp"
#include "libmodels/nn/sharded.hpp"

namespace mocap::classifier {
namespace {

using Json = nlohmann::json;

enum Draw : std::uint64_t { kBatch = 1, kNoise = 2, kWeights = 3 };

Json to_json(const TrainingConfig& c) {
  return Json{{"epochs", c.epochs},     {"batch", c.batch},   {"window", c.window}, {"shards", c.shards},       {"noise", c.noise}, {"gradient_limit", c.gradient_limit}, {"learning_rate", c.learning_rate},
              {"seed", c.seed},         {"half", c.half},     {"half_seed", c.half_seed}};
}

std::string source_of(const store::ClipInfo& clip) {
  if (!clip.source.sha256.empty()) return "s" + clip.source.sha256;
  return clip.source.path.empty() ? "n" + clip.name : "p" + clip.source.path;
}

}  // namespace

Half parse_half(const std::string& name) {
  for (const Half half : {Half::all, Half::a, Half::b})
    if (name == text(half)) return half;
  refuse_usage("half '" + name + "', expected A, B or all");
}

std::string text(Half half) { return half == Half::a ? "A" : half == Half::b ? "B" : "all"; }

std::vector<Half> halves(const std::vector<std::string>& sources, const std::vector<std::string>& labels, std::uint64_t seed) {
  std::map<std::string, std::string> label_of;  // the smallest label of a source's clips, so that their order does not matter
  for (std::size_t i = 0; i < sources.size(); ++i) {
    const auto [at, fresh] = label_of.emplace(sources[i], labels[i]);
    if (!fresh) at->second = std::min(at->second, labels[i]);
  }
  std::map<std::string, std::vector<std::pair<std::string, std::string>>> by_label;  // label -> (rank, source)
  for (const auto& [source, label] : label_of) {
    Sha256 rank;
    rank.update(std::to_string(seed) + "\n" + source);
    by_label[label].emplace_back(to_hex(rank.finish()), source);
  }
  std::map<std::string, Half> half_of;
  std::size_t dealt = 0;  // runs on over the classes, so that classes of odd size do not all give A one more
  for (auto& [label, ranked] : by_label) {
    std::sort(ranked.begin(), ranked.end());
    for (const auto& [rank, source] : ranked) half_of[source] = dealt++ % 2 == 0 ? Half::a : Half::b;
  }
  std::vector<Half> out;
  for (const auto& source : sources) out.push_back(half_of.at(source));
  return out;
}

Data::Data(const std::string& path, const std::string& attribute, Half half, std::uint64_t half_seed, const Data* like) : attribute_(attribute) {
  const store::ArchiveReader reader(path);
  header_ = reader.header();
  file_sha256_ = reader.file_sha256();
  const std::string& name = reader.name();
  const int joints = header_.skeleton->joint_count() - 1;
  if (joints < 1) refuse({name, 0, "skeleton"}, "1 joint, expected a root and at least one more");
  if (like) {
    if (!header_.skeleton->same_as(*like->header_.skeleton, 1e-5)) refuse({name, 0, "skeleton"}, "another skeleton than the training data's");
    if (header_.frame_rate_hz != like->header_.frame_rate_hz)
      refuse({name, 0, {}}, fmt::format("{} Hz, expected {} Hz as in the training data", header_.frame_rate_hz, like->header_.frame_rate_hz));
  }
  std::vector<std::size_t> labelled;
  std::vector<std::string> labels;
  for (std::size_t i = 0; i < reader.size(); ++i) {
    const auto at = reader.info(i).attributes.find(attribute);
    if (at == reader.info(i).attributes.end() || at->second.empty()) continue;
    labelled.push_back(i);
    labels.push_back(at->second);
  }
  left_out_ = reader.size() - labelled.size();
  if (labelled.empty()) {
    std::string known;
    for (const auto& one : header_.attributes) known += (known.empty() ? "" : ", ") + one;
    refuse({name, 0, {}}, "no clip has an attribute '" + attribute + "', expected labels to learn from" + (known.empty() ? "" : " (there are " + known + ")"));
  }
  if (like) {
    classes_ = like->classes_;
  } else {
    const std::set<std::string> found(labels.begin(), labels.end());
    classes_.assign(found.begin(), found.end());
    if (classes_.size() < 2) refuse({name, 0, {}}, fmt::format("all labelled clips have {}={}, expected at least two classes", attribute, classes_[0]));
  }
  // Of all clips and by all their attributes, so that a source is in one half whatever attribute is learnt: a classifier of one attribute on half
  // A and one of another on half B share none.
  std::vector<std::string> every_source, every_label;
  for (std::size_t i = 0; i < reader.size(); ++i) {
    every_source.push_back(source_of(reader.info(i)));
    std::string label;
    for (const auto& [key, value] : reader.info(i).attributes)
      if (key != "subject") label += key + "=" + value + "\n";
    every_label.push_back(std::move(label));
  }
  const std::vector<Half> half_of = halves(every_source, every_label, half_seed);
  Statistics statistics(joints);
  std::vector<features::FeatureMatrix> encoded;
  std::set<std::string> digests;
  Sha256 digest;
  digest.update(reader.digest() + "\n" + attribute);
  members_.resize(classes_.size());
  for (std::size_t k = 0; k < labelled.size(); ++k) {
    if (half != Half::all && half_of[labelled[k]] != half) continue;
    const auto& info = reader.info(labelled[k]);
    const auto at = std::find(classes_.begin(), classes_.end(), labels[k]);
    if (at == classes_.end()) refuse({name, 0, "clip " + info.name}, "attribute " + attribute + " is '" + labels[k] + "', which the training data does not know");
    Item item;
    item.name = info.name;
    item.label = at - classes_.begin();
    if (!info.source.sha256.empty()) digests.insert(info.source.sha256);
    try {
      encoded.push_back(encode(reader.read(labelled[k])));
    } catch (const Error& e) {
      throw e.in_file(name);
    }
    statistics.add(encoded.back());
    digest.update("\n" + info.digest + "\t" + labels[k]);
    members_[static_cast<std::size_t>(item.label)].push_back(items_.size());
    items_.push_back(std::move(item));
  }
  for (std::size_t c = 0; c < classes_.size(); ++c)
    if (!like && members_[c].empty())
      refuse({name, 0, {}}, fmt::format("no source of {}={} is in half {}, expected more sources of each class", attribute, classes_[c], text(half)), "train on --half all");
  digest_ = to_hex(digest.finish());
  sources_.assign(digests.begin(), digests.end());
  mean_ = like ? like->mean_ : statistics.mean();
  deviation_ = like ? like->deviation_ : statistics.deviation();
  for (std::size_t i = 0; i < items_.size(); ++i) items_[i].features = standardise(encoded[i], mean_, deviation_);
  for (auto& of_class : members_)
    std::stable_sort(of_class.begin(), of_class.end(), [&](std::size_t a, std::size_t b) { return items_[a].features.size(0) > items_[b].features.size(0); });
}

std::int64_t Data::frames() const {
  std::int64_t n = 0;
  for (const auto& item : items_) n += item.features.size(0);
  return n;
}

ClassifierTraining::ClassifierTraining(TrainingConfig config, const Data& data, const Data* validation) : config_(std::move(config)), data_(data), validation_(validation) {
  const auto positive = [](const char* name, double v) {
    if (!(std::isfinite(v) && v > 0)) refuse_usage(fmt::format("{} is {}, expected a number above 0", name, v));
  };
  positive("epochs", static_cast<double>(config_.epochs));
  positive("batch", static_cast<double>(config_.batch));
  positive("window", static_cast<double>(config_.window));
  positive("learning rate", config_.learning_rate.rate);
  positive("gradient limit", config_.gradient_limit);
  if (config_.shards < 1 || config_.shards > config_.batch) refuse_usage(fmt::format("{} shards of a batch of {}, expected between 1 and the batch", config_.shards, config_.batch));
  if (config_.window > (1 << 20) / config_.batch) refuse_usage(fmt::format("{} clips of {} frames in a batch, expected at most {} frames in all", config_.batch, config_.window, 1 << 20));
  longest_ = config_.window;
  for (const auto& members : data.members()) longest_ = std::min(longest_, data.items()[members[(members.size() - 1) / 2]].features.size(0));
  shortest_ = std::max<std::int64_t>(1, static_cast<std::int64_t>(std::ceil(0.4 * static_cast<double>(longest_))));
  NetworkConfig network;
  network.joints = data.header().skeleton->joint_count() - 1;
  network.classes = static_cast<int>(data.classes().size());
  Random random(config_.seed, stream_of(kWeights, 0));
  network_ = std::make_unique<Network>(network, random);
}

std::int64_t ClassifierTraining::steps_per_epoch() const {
  const std::int64_t rows = std::max(static_cast<std::int64_t>(data_.items().size()), data_.frames() / longest_);
  return (rows + config_.batch - 1) / config_.batch;
}

store::ModelFile ClassifierTraining::describe() const {
  store::ModelFile file;
  file.kind = "classifier";
  const auto& header = data_.header();
  file.config = Json{{"network", classifier::to_json(network_->config())},
                     {"training", to_json(config_)},
                     {"attribute", data_.attribute()},
                     {"representation", "quaternion"},
                     {"frame_rate_hz", header.frame_rate_hz},
                     {"crops", {{"shortest", shortest_}, {"longest", longest_}}}}
                    .dump();
  file.skeleton = header.skeleton;
  file.mean = data_.mean();
  file.deviation = data_.deviation();
  file.train_sources = data_.sources();
  file.vocabulary = {{data_.attribute(), data_.classes()}};
  return file;
}

std::string ClassifierTraining::identity() const {
  return Json{{"kind", "classifier"},
              {"data", data_.digest()},
              {"validation", validation_ ? validation_->digest() : ""},
              {"network", classifier::to_json(network_->config())},
              {"training", to_json(config_)}}
      .dump();
}

train::NamedTensors ClassifierTraining::parameters() {
  train::NamedTensors named = nn::parameters_by_path(*network_);
  return named;
}

Rows ClassifierTraining::draw(std::int64_t step) const {
  Random random(config_.seed, stream_of(kBatch, static_cast<std::uint64_t>(step)));
  Rows rows;
  std::vector<std::pair<const Data::Item*, std::int64_t>> places;
  rows.labels = torch::empty({config_.batch}, torch::kInt64);
  std::int64_t widest = 0;
  for (std::int64_t b = 0; b < config_.batch; ++b) {
    const std::int64_t length = shortest_ + static_cast<std::int64_t>(random.below(static_cast<std::uint64_t>(longest_ - shortest_ + 1)));
    const auto& members = data_.members()[random.below(data_.members().size())];
    std::size_t fit = 0;  // longest first: at least half of them
    while (fit < members.size() && data_.items()[members[fit]].features.size(0) >= length) ++fit;
    const Data::Item& item = data_.items()[members[random.below(fit)]];
    places.emplace_back(&item, static_cast<std::int64_t>(random.below(static_cast<std::uint64_t>(item.features.size(0) - length + 1))));
    rows.lengths.push_back(length);
    rows.labels[b] = item.label;
    widest = std::max(widest, length);
  }
  rows.x = torch::zeros({config_.batch, widest, network_->config().inputs()}, torch::kFloat32);
  for (std::int64_t b = 0; b < config_.batch; ++b) {
    const auto& [item, first] = places[static_cast<std::size_t>(b)];
    const std::int64_t length = rows.lengths[static_cast<std::size_t>(b)];
    rows.x[b].narrow(0, 0, length).copy_(item->features.narrow(0, first, length));
  }
  return rows;
}

void ClassifierTraining::prepare(std::int64_t step) {
  rows_ = draw(step);
  if (config_.noise > 0) {
    Random random(config_.seed, stream_of(kNoise, static_cast<std::uint64_t>(step)));
    rows_.x += config_.noise * nn::normal_tensor(rows_.x.sizes(), random);
  }
}

torch::Tensor ClassifierTraining::shard_loss(int shard, train::LossTerms& terms) {
  const auto [first, last] = nn::shard_range(config_.batch, config_.shards, shard);
  const std::vector<std::int64_t> lengths(rows_.lengths.begin() + first, rows_.lengths.begin() + last);
  const torch::Tensor labels = rows_.labels.narrow(0, first, last - first);
  const torch::Tensor scores = network_->scores(network_->features(rows_.x.narrow(0, first, last - first), lengths));
  const torch::Tensor loss = torch::nll_loss(torch::log_softmax(scores, 1), labels, {}, at::Reduction::Sum) / static_cast<double>(config_.batch);
  const double right = scores.detach().argmax(1).eq(labels).sum().item<double>();
  terms = {{"cross_entropy", loss.item<double>()}, {"accuracy", right / static_cast<double>(config_.batch)}};
  return loss;
}

std::optional<double> ClassifierTraining::validation_loss() {
  if (!validation_) return std::nullopt;
  const torch::NoGradGuard no_grad;
  const std::size_t n = validation_->items().size(), used = std::min<std::size_t>(n, 512);
  double sum = 0;
  for (std::size_t i = 0; i < used; ++i) {
    const Data::Item& item = validation_->items()[i * n / used];
    const torch::Tensor scores = network_->scores(network_->features(item.features.unsqueeze(0), {item.features.size(0)}));
    sum -= torch::log_softmax(scores, 1)[0][item.label].item<double>();
  }
  return sum / static_cast<double>(used);
}

}  // namespace mocap::classifier
