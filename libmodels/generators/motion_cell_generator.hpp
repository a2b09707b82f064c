#pragma once
#include <memory>
#include <string>

#include "libmodels/generators/generator.hpp"

namespace mocap::generators {

std::unique_ptr<Generator> make_motion_cell_generator(const store::ModelFile& model, const std::string& file);

}  // namespace mocap::generators
