#include "libmodels/train/trainable.hpp"

#include "libmodels/train/adam.hpp"

namespace mocap::train {

std::unique_ptr<Optimizer> Trainable::optimizer() { return std::make_unique<Adam>(parameters()); }

}  // namespace mocap::train
