#include "libmodels/generators/generator.hpp"

#include "libmocap/base/error.hpp"
#include "libmodels/generators/baseline_generator.hpp"
#include "libmodels/generators/motion_cell_generator.hpp"

namespace mocap::generators {
namespace {

// One line a kind: a new model is known to `sample` once it stands here.
struct Entry {
  const char* kind;
  std::unique_ptr<Generator> (*make)(const store::ModelFile&, const std::string&);
};
constexpr Entry kKinds[] = {{"motion-cell", make_motion_cell_generator}, {"quaternet", make_baseline_generator}, {"erd", make_baseline_generator}};

}  // namespace

std::unique_ptr<Generator> make_generator(const store::ModelFile& model, const std::string& file) {
  std::string known;
  for (const auto& entry : kKinds) {
    if (model.kind == entry.kind) return entry.make(model, file);
    known += (known.empty() ? "" : ", ") + std::string(entry.kind);
  }
  refuse({file, 0, {}}, "a model of kind '" + model.kind + "', expected one that generates motion (" + known + ")");
}

}  // namespace mocap::generators
