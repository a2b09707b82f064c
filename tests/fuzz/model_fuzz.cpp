#include <fstream>
#include <iterator>

#include "libmocap/skeleton/canonical_body.hpp"
#include "libmocap/store/model_file.hpp"
#include "tests/fuzz/target.hpp"

namespace mocap::fuzz {

std::vector<std::string> seeds() {
  static const std::vector<std::string> made = [] {
    store::ModelFile model;
    model.kind = "denoiser";
    model.config = R"({"network": {"joints": 21}, "frame_rate_hz": 30.0})";
    model.skeleton = canonical_body();
    model.weights = {{"a/weight", {{2, 3}, {1, 2, 3, 4, 5, 6}}}, {"a/bias", {{2}, {0, -1}}}};
    model.mean = {1, 2};
    model.deviation = {1, 0.5F};
    model.train_sources = {std::string(64, 'a')};
    model.vocabulary = {{"action", {"running", "walking"}}};
    std::vector<std::string> out;
    for (const bool training : {false, true}) {
      model.has_training = training;
      model.training_tensors = {{"a/bias/m", {{2}, {0, 0}}}};
      model.training_state = R"({"step": 3, "identity": {"kind": "denoiser"}})";
      const std::string path = scratch("seed.h5");
      store::write_model(path, Overwrite::allow, model);
      std::ifstream in(path, std::ios::binary);
      out.emplace_back(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
    }
    return out;
  }();
  return made;
}

std::vector<std::string> words() { return {"\x89HDF\r\n\x1a\n", "OHDR", "OCHK", "FRHP", "BTHD", "mocap-model", "/weights", "/config", "complete", "{\"a\":", "[[[["}; }

void one(std::string_view bytes) {
  const std::string& path = as_file(bytes);
  const store::ModelFile model = store::read_model(path);
  if (!store::check_model(path, true).empty()) return;
  const std::string copy = scratch("copy.h5");
  store::write_model(copy, Overwrite::allow, model);
  const store::ModelFile again = store::read_model(copy);
  require(again.kind == model.kind && again.config == model.config && again.mean == model.mean && again.vocabulary == model.vocabulary && again.training_state == model.training_state, "a model read, written and read has its parts");
  require(again.weights.size() == model.weights.size(), "and its weights");
}

}  // namespace mocap::fuzz
