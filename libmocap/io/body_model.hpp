// A user's own SMPL, SMPL+H or SMPL-X body model (npz), as far as rest joints go: what gives AMASS clips their own bones.
// No such file comes with the project.
#pragma once
#include <array>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "libmocap/skeleton/skeleton.hpp"

namespace mocap::io {

// Rest joints of a shape (Loper et al. 2015, SMPL, eq. 10):
//     J(beta) = J_regressor (v_template + sum_b beta_b shapedirs[:, :, b]) = J_0 + sum_b beta_b D_b,
// of which J_0 and D_b are kept for the 22 body joints (canonical names and order), metres, in SMPL's axes: x left, y up,
// z forward. Immutable, thread-safe.
class BodyModel {
 public:
  static constexpr std::size_t kJoints = 22;
  using Joints = std::array<Vector3, kJoints>;

  // Members: `J_regressor` (J,V) dense, `v_template` (V,3), `kintree_table` (2,J), `shapedirs` (V,3,B) or none; J >= 22, B at
  // most 400. Error(data) with the member: absent, of another shape, pickled (a sparse regressor saved as an object), not
  // finite, a tree whose first 22 joints are not SMPL's body. Cost of parsing O(22 V B).
  static BodyModel parse(std::string_view bytes);
  // parse() of a file; errors name it.
  static std::shared_ptr<const BodyModel> read(const std::string& path);

  // The first min(B, betas) shape parameters count.
  Joints joints(std::span<const double> betas) const;
  std::size_t shapes() const { return shapes_.size(); }

  const std::string& path() const { return path_; }
  const std::string& sha256() const { return sha256_; }

 private:
  std::string path_, sha256_;
  Joints template_;
  std::vector<Joints> shapes_;
};

// The 22 joints under their canonical names with these bones, in our axes (x forward, y left, z up): offset of a joint =
// C (J_j - J_parent), C: (x,y,z) -> (z,x,y).
std::shared_ptr<const Skeleton> skeleton_of(const BodyModel::Joints& joints);

}  // namespace mocap::io
