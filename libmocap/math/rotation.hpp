// Rotations in the representations the field uses, and the maps between them.
//
// Convention: a rotation acts on column vectors, v' = R v; quaternions are Hamilton, unit, and q and -q are the same
// rotation. Angles are radians. Functions are exact to a few units in the last place over the whole group, the
// neighbourhoods of 0 and pi included (tests/math runs one property suite over all of them).
#pragma once
#include <Eigen/Geometry>
#include <array>
#include <string>
#include <string_view>
#include <vector>

namespace mocap {

using Quaternion = Eigen::Quaterniond;
using RotationMatrix = Eigen::Matrix3d;
using Vector2 = Eigen::Vector2d;
using Vector3 = Eigen::Vector3d;
using SixD = Eigen::Matrix<double, 6, 1>;  // first two columns of the matrix, stacked (Zhou et al. 2019)

// exp: axis times angle -> unit quaternion (w >= 0 for |v| <= pi). log: the inverse, |result| <= pi.
Quaternion exp_map(const Vector3& axis_angle);
Vector3 log_map(const Quaternion& q);

RotationMatrix to_matrix(const Quaternion& q);
// Nearest-branch conversion (Shepperd); the matrix must be a rotation within 1e-3, otherwise Error(data).
Quaternion to_quaternion(const RotationMatrix& m);
// Gram-Schmidt on the first two columns (the third follows): any 3x3 with independent first columns becomes a rotation.
RotationMatrix orthonormalize(const RotationMatrix& m);

SixD to_six_d(const Quaternion& q);
Quaternion from_six_d(const SixD& v);  // Gram-Schmidt; Error(data) where the two columns are parallel or zero

// One channel order, outermost rotation first: "ZYX" means R = Rz Ry Rx. Any three axes (also "ZXZ"), any one or two.
// axes[i] is 0, 1, 2 for X, Y, Z.
struct EulerOrder {
  std::array<int, 3> axes{2, 1, 0};
  int count = 3;
  static EulerOrder parse(std::string_view text);  // Error(usage) for anything but X, Y, Z letters
  std::string text() const;
};
// Product of the axis rotations in the order listed: R = R_first R_second R_third.
Quaternion from_euler(const Vector3& angles, const EulerOrder& order);
// Inverse for three different axes (middle angle in [-pi/2, pi/2]); at gimbal lock the first angle is `near`'s or 0 and
// the rotation is still exact. With `near` the branch and the multiples of 2 pi nearest to it are returned, so that
// curves stay continuous from frame to frame.
Vector3 to_euler(const Quaternion& q, const EulerOrder& order, const Vector3* near = nullptr);

// Shortest rotation taking direction `from` to `to` (need not be unit, must not be 0). Opposite directions turn about
// the axis nearest to world Z that is perpendicular to `from`.
Quaternion rotation_between(const Vector3& from, const Vector3& to);
// The rotation whose columns are: x = along, z in the plane of along and `up`. Error(internal) where they are parallel.
Quaternion frame_from(const Vector3& along, const Vector3& up);

// Twist of q about `axis` (unit) in q = swing * twist; a half-turn swing has no twist and gives the identity.
Quaternion twist_about(const Quaternion& q, const Vector3& axis);
double yaw_of(const Quaternion& q);  // angle of twist_about(q, Z), in (-pi, pi]
Quaternion yaw_rotation(double yaw);

// Spherical linear interpolation along the shorter arc; t in [0, 1].
Quaternion slerp(const Quaternion& a, const Quaternion& b, double t);

// Angular distances. geodesic: eq. 17 and 21 of Ghorbani et al., as 2 atan2(|vec|, |w|) (arccos has infinite slope at
// 0). d2, d3: their eq. 18 and 20.
double geodesic_distance(const Quaternion& a, const Quaternion& b);
double geodesic_distance(const RotationMatrix& a, const RotationMatrix& b);
double quaternion_d2(const Quaternion& a, const Quaternion& b);
double quaternion_d3(const Quaternion& a, const Quaternion& b);

// Flips signs so that each quaternion of the strided sequence lies on the side of its predecessor; the first gets w >= 0
// (ties: the first non-zero of x, y, z positive).
void make_sign_continuous(std::vector<Quaternion>& q, std::size_t first, std::size_t stride, std::size_t count);

// Angle brought into (-pi, pi].
double wrap_angle(double a);

}  // namespace mocap
