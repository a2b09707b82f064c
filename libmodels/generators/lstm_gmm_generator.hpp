#pragma once
#include <memory>
#include <string>

#include "libmodels/generators/generator.hpp"

namespace mocap::generators {

// Of the kind lstm-gmm: trained without attributes, starts from the first frame of a clip (SampleSettings::init, otherwise one of those in the model file),
// labels contacts itself. SampleSettings::noise_scale scales every sigma of the mixture.
std::unique_ptr<Generator> make_lstm_gmm_generator(const store::ModelFile& model, const std::string& file);

}  // namespace mocap::generators
