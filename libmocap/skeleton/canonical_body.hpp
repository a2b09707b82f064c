// The project's own canonical body: the 22 SMPL body joint names on a neutral, left-right symmetric 1.70 m figure.
//
// Segment lengths are published anthropometric proportions of stature H (legs, foot: Drillis & Contini 1966 as given by
// Winter, Biomechanics and Motor Control of Human Movement, fig. 4.1; arms: de Leva 1996), not a table derived from a
// licensed body model. Rest pose: T-pose facing +X, Z up, left is +Y, arms along +-Y, legs and feet straight.
// World rest heights: ankle 0.066 m, toe base (`left_foot`) kFootSoleHeight above the sole, which is z = 0.
#pragma once
#include <memory>

#include "libmocap/skeleton/skeleton.hpp"

namespace mocap {

inline constexpr double kFootSoleHeight = 0.025;   // toe-base joint above the sole, metres
inline constexpr double kAnkleSoleHeight = 0.0663;  // ankle joint above the sole with a flat foot, metres

// 22 joints, 5 end sites, roles filled. One shared object.
std::shared_ptr<const Skeleton> canonical_body();

// Pelvis height of the rest pose above the sole, metres.
double canonical_pelvis_height();

}  // namespace mocap
