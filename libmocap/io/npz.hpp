// NumPy .npz archives and the two motion layouts kept in them (contract/npz.md).
#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "libmocap/base/history.hpp"
#include "libmocap/clip/clip.hpp"
#include "libmocap/io/body_model.hpp"

namespace mocap::io {

// One array: C order, little-endian. Read dtypes: f4 f8 i4 i8 u1 u4 u8 b1 widened to double or int64; U and S to
// strings.
struct NpyArray {
  std::vector<std::size_t> shape;  // empty: 0-d
  std::variant<std::vector<double>, std::vector<std::int64_t>, std::vector<std::string>> data;
};
using Npz = std::map<std::string, NpyArray>;

// Members stored or deflated; sizes are checked against the bytes before any allocation; pickled (object) and
// Fortran-order arrays of more than one dimension are refused by name. Errors carry the member as object.
Npz parse_npz(std::string_view bytes);
// Only the members wanted (as far as they are there): others may be of any kind, pickled ones included.
Npz parse_npz(std::string_view bytes, const std::set<std::string, std::less<>>& wanted);
// Names of the arrays in a file, from the zip's directory alone; nullopt where it is no zip or a damaged one.
std::optional<std::set<std::string, std::less<>>> npz_members(const std::string& path);
// float64, int32 (int64 where a value does not fit) and unicode members; stored, members in name order, fixed time
// stamps: equal content gives equal bytes; numpy.load(allow_pickle=False) reads it.
std::string format_npz(const Npz& arrays);

// Source-skeleton layout of `bvh2npz`: poses [N,3J] axis-angle, trans, rates, names, parents, rest_offsets, end sites,
// history; `translations` [N,J,3] where the clip has some (joint position in its parent, metres; row 0 unused). The
// clip must be normalised (metres, Z up). The inverse returns the clip and the history it carries.
Npz to_source_layout(const Clip& clip, const History& history);

// AMASS SMPL+H layout of `export --format npz`: poses [N,156] in SMPL rest frames (x left, y up, z forward), trans =
// pelvis - J0. The clip must be on the canonical body (its 22 joints; other proportions are not kept).
//
// Joint frames here are x forward, y left, z up. C is the permutation from SMPL axes to ours, (x,y,z) -> (z,x,y):
//   non-root  R_smpl = C^T R C        root  R_smpl = R C (it takes SMPL rest vectors to the Z-up world)
//   pelvis = trans + J0: SMPL adds the rest pelvis to `trans` as a constant, without turning it.
Npz to_amass_layout(const Clip& clip, const History& history);

struct NpzMotion {
  Clip clip;  // metres, Z up; AMASS files: on the canonical body or the model's, `gender` as attribute
  History history;
  std::string release;  // "source", "SMPL+H" or "SMPL-X"
};

// Either layout, by content; members not needed are not looked at. AMASS: both rate keys, 0-d and 1-d arrays, bytes and
// unicode genders, float32 and float64, poses of 156 or 165 columns (hands, jaw and eyes are left out), or in their place
// root_orient [N,3] and pose_body [N,63] as they stand in SMPL-X files; rates within
// 1e-6 (relative) of N or N*1000/1001 are snapped. Gender "neutral" stays unlabelled: files write it for unknown.
// Error(data) for npz files without motion says what is missing ("no poses: a shape file").
// With a body model, clips of AMASS files have its bones for their betas, under the canonical names (22 joints), and the
// pelvis is trans + the model's own J0; without, or with a model and no betas in the file, betas are 0.
NpzMotion parse_motion_npz(std::string_view bytes, const BodyModel* model = nullptr);

// Why a file holds no motion ("no poses: a shape file"), from its directory alone; "" where it has one or cannot be told.
std::string why_no_motion(const std::string& path);

// Rest position of the pelvis of SMPL's neutral body with zero betas; AMASS `trans` is relative to it. Metres, in
// SMPL's own frame (x left, y up, z forward) as used by AMASS's Z-up world.
inline const Vector3 kSmplPelvis{-0.00179506, -0.22333382, 0.02821918};

}  // namespace mocap::io
