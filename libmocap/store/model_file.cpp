#include "libmocap/store/model_file.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "libmocap/base/error.hpp"
#include "libmocap/base/sha256.hpp"
#include "libmocap/store/common_parts.hpp"
#include "libmocap/store/hdf5.hpp"

namespace mocap::store {
namespace {

constexpr const char* kScalar = "scalar";  // attribute of a dataset [1] that holds a tensor without axes

std::uint64_t elements(const Tensor& tensor) {
  std::uint64_t n = 1;
  for (const auto d : tensor.shape) n *= static_cast<std::uint64_t>(d);
  return n;
}

// Each part between slashes becomes a link; "." and "" would mean something else to HDF5, and a tensor is no group.
void require_tensor(const std::map<std::string, Tensor>& all, const std::string& path, const Tensor& tensor, const std::string& file) {
  const Where where{file, 0, path};
  const auto below = all.lower_bound(path + "/");
  if (below != all.end() && below->first.starts_with(path + "/")) throw Error(Exit::internal, where, "a parameter path that " + below->first + " continues");
  require_text(path, where);
  for (std::size_t begin = 0; begin <= path.size();) {
    const auto end = std::min(path.find('/', begin), path.size());
    const std::string part = path.substr(begin, end - begin);
    if (part.empty() || part == ".") throw Error(Exit::internal, where, "a parameter path with an empty part or '.'");
    begin = end + 1;
  }
  if (tensor.shape.size() > 8 || std::any_of(tensor.shape.begin(), tensor.shape.end(), [](auto d) { return d < 0; }) || elements(tensor) != tensor.values.size())
    throw Error(Exit::internal, where, std::to_string(tensor.values.size()) + " values, expected as many as the shape says");
}

void write_tensor(h5::Writer& out, const std::string& path, const Tensor& tensor) {
  const h5::Shape shape = tensor.shape.empty() ? h5::Shape{1} : h5::Shape(tensor.shape.begin(), tensor.shape.end());
  out.values(path, tensor.values, shape);
  if (tensor.shape.empty()) out.attribute_of(path, kScalar, std::int32_t{1});
}

std::map<std::string, Tensor> read_tensors(const h5::Reader& in, const std::string& group, std::uint64_t& budget) {
  std::map<std::string, Tensor> tensors;
  for (const auto& path : in.datasets(group)) {
    const h5::Dataset set = in.open(path);
    set.require(h5::Type::f32, h5::Shape(set.shape().size(), h5::kAny));
    const std::uint64_t bytes = set.elements() * sizeof(float);
    // Several links to one dataset could multiply it.
    if (bytes > budget) in.refuse(path, "more tensors than the file has bytes for");
    budget -= bytes;
    Tensor tensor;
    tensor.values.resize(set.elements());
    if (!tensor.values.empty()) set.read(0, set.shape()[0], tensor.values.data());
    if (set.int_attribute(kScalar).value_or(0) != 1) tensor.shape.assign(set.shape().begin(), set.shape().end());
    tensors.emplace(path.substr(group.size() + 1), std::move(tensor));
  }
  return tensors;
}

void hash_values(Sha256& hash, const std::vector<float>& values) {
  hash_number(hash, static_cast<double>(values.size()));
  hash.update(values.data(), values.size() * sizeof(float));
}

// What the network is: kind, configuration, skeleton, vocabulary, normalisation, and each weight's name, shape and values.
// Not what training left behind: with and without --weights-only the digest is the same.
std::string model_digest(const ModelFile& model) {
  Sha256 hash;
  hash_text(hash, model.kind);
  hash_text(hash, model.config);
  if (model.skeleton) hash_skeleton(hash, *model.skeleton);
  for (const auto& [attribute, classes] : model.vocabulary) {
    hash_text(hash, attribute);
    hash_number(hash, static_cast<std::int32_t>(classes.size()));
    for (const auto& c : classes) hash_text(hash, c);
  }
  hash_values(hash, model.mean);
  hash_values(hash, model.deviation);
  for (const auto& [path, tensor] : model.weights) {
    hash_text(hash, path);
    hash_number(hash, static_cast<std::int32_t>(tensor.shape.size()));
    for (const auto d : tensor.shape) hash_number(hash, static_cast<double>(d));
    hash_values(hash, tensor.values);
  }
  return to_hex(hash.finish());
}

void require_json(const std::string& text, const Where& where) {
  if (!nlohmann::json::accept(text)) refuse(where, "is not JSON");
}

ModelFile read_open(const h5::Reader& in) {
  const Complete complete = parse_complete(in, in.require_format(kModelFormat, kFormatVersion), "tensors");
  ModelFile model;
  const auto kind = in.text_attribute("kind");
  if (!kind || kind->empty()) in.refuse("attribute kind", "missing, expected the kind of model");
  model.kind = *kind;
  model.config = in.bytes("/config");
  require_json(model.config, {in.name(), 0, "config"});
  model.history = read_history(in);
  if (in.has("/skeleton")) model.skeleton = read_skeleton(in);
  std::uint64_t budget = in.file_bytes();
  model.weights = read_tensors(in, "/weights", budget);
  if (complete.count != model.weights.size())
    in.refuse("weights", std::to_string(model.weights.size()) + " tensors, expected " + std::to_string(complete.count) + " as the attribute complete says");
  if (in.has("/normalization")) {
    model.mean = in.values<float>("/normalization/mean", {h5::kAny});
    model.deviation = in.values<float>("/normalization/std", {model.mean.size()});
  }
  model.train_sources = in.strings("/data/train_sources", {h5::kAny});
  for (const auto& link : in.list("/vocabulary")) model.vocabulary.emplace(h5::unescape_link(link), in.strings("/vocabulary/" + link, {h5::kAny}));
  if (in.has("/training")) {
    model.has_training = true;
    model.training_state = in.bytes("/training/state");
    require_json(model.training_state, {in.name(), 0, "training/state"});
    model.training_tensors = read_tensors(in, "/training/tensors", budget);
  }
  if (model_digest(model) != complete.digest) in.refuse({}, "the content does not fit the digest of the attribute complete: the file is damaged");
  return model;
}

}  // namespace

void write_model(const std::string& path, Overwrite mode, const ModelFile& model) {
  const std::string file = path == "-" ? "<stdout>" : path;
  require_text(model.kind, {file, 0, "kind"});
  if (model.kind.empty() || !nlohmann::json::accept(model.config) || (model.has_training && !nlohmann::json::accept(model.training_state)))
    throw Error(Exit::internal, {file, 0, {}}, "a model without kind, or whose configuration or training state is not JSON");
  if (model.mean.size() != model.deviation.size()) throw Error(Exit::internal, {file, 0, "normalization"}, "means and deviations of different number");
  for (const auto& [name, tensor] : model.weights) require_tensor(model.weights, name, tensor, file);
  for (const auto& [name, tensor] : model.training_tensors) require_tensor(model.training_tensors, name, tensor, file);
  for (const auto& source : model.train_sources) from_hex(source);
  for (const auto& [attribute, classes] : model.vocabulary) {
    require_text(attribute, {file, 0, "vocabulary"});
    if (attribute.empty()) throw Error(Exit::internal, {file, 0, "vocabulary"}, "an attribute without a name");
    for (const auto& c : classes) require_text(c, {file, 0, "vocabulary " + attribute});
  }

  h5::Writer out(path, mode);
  out.attribute("format", kModelFormat);
  out.attribute("format_version", kFormatVersion);
  out.attribute("kind", model.kind);
  out.bytes("/config", model.config);
  write_history(out, model.history);
  if (model.skeleton) write_skeleton(out, *model.skeleton, file);
  out.group("/weights");
  for (const auto& [name, tensor] : model.weights) write_tensor(out, "/weights/" + name, tensor);
  if (!model.mean.empty()) {
    out.values("/normalization/mean", model.mean);
    out.values("/normalization/std", model.deviation);
  }
  out.strings("/data/train_sources", model.train_sources);
  for (const auto& [attribute, classes] : model.vocabulary) out.strings("/vocabulary/" + h5::escape_link(attribute), classes);
  if (model.has_training) {
    out.bytes("/training/state", model.training_state);
    out.group("/training/tensors");
    for (const auto& [name, tensor] : model.training_tensors) write_tensor(out, "/training/tensors/" + name, tensor);
  }
  out.finish(format_complete("tensors", {model.weights.size(), model_digest(model)}));
}

ModelFile read_model(const std::string& path, std::string* file_sha256) {
  const h5::Reader in(path, "model file");
  ModelFile model = read_open(in);
  if (file_sha256) *file_sha256 = in.file_sha256();
  return model;
}

std::vector<std::string> check_model(const std::string& path, bool full) {
  std::vector<std::string> defects;
  const h5::Reader in(path, "model file");
  const ModelFile model = read_open(in);
  const auto found = [&](const std::string& object, const std::string& what) { defects.push_back(Error(Exit::data, {in.name(), 0, object}, what).what()); };
  const auto finite = [&](const std::string& object, const std::vector<float>& values) {
    if (std::any_of(values.begin(), values.end(), [](float v) { return !std::isfinite(v); })) found(object, "a value that is not finite");
  };
  for (const auto& [name, tensor] : model.weights) finite("weights/" + name, tensor.values);
  finite("normalization/mean", model.mean);
  finite("normalization/std", model.deviation);
  if (std::any_of(model.deviation.begin(), model.deviation.end(), [](float v) { return v <= 0; })) found("normalization/std", "a deviation that is not above 0");
  for (const auto& source : model.train_sources) {
    try {
      from_hex(source);
    } catch (const Error& e) {
      found("data/train_sources", e.message());
    }
  }
  if (!full) return defects;
  for (const auto& [name, tensor] : model.training_tensors) finite("training/tensors/" + name, tensor.values);
  for (const auto& object : in.datasets("/")) {
    try {
      in.open(object).verify();
    } catch (const Error& e) {
      if (e.status() != Exit::data) throw;
      defects.push_back(e.what());
    }
  }
  return defects;
}

}  // namespace mocap::store
