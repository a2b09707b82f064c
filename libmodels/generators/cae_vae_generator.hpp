#pragma once
#include <memory>
#include <string>

#include "libmodels/generators/generator.hpp"

namespace mocap::generators {

// Of the kind cae-vae. SampleSettings::noise_scale scales the draws of z.
std::unique_ptr<Generator> make_cae_vae_generator(const store::ModelFile& model, const std::string& file);

}  // namespace mocap::generators
