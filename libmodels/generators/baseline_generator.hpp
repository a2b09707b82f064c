#pragma once
#include <memory>
#include <string>

#include "libmodels/generators/generator.hpp"

namespace mocap::generators {

// Of the kinds quaternet and erd. SampleSettings::noise_scale scales the deviation of the initial state, the only noise there is.
std::unique_ptr<Generator> make_baseline_generator(const store::ModelFile& model, const std::string& file);

}  // namespace mocap::generators
