#include "libmocap/features/motion_cell.hpp"

#include <algorithm>
#include <cmath>

#include "libmocap/base/error.hpp"
#include "libmocap/features/continuous_log.hpp"

namespace mocap::features {
namespace {

void write_rotation(const Quaternion& q, RotationRepresentation r, double* out) {
  switch (r) {
    case RotationRepresentation::axis_angle: {
      Eigen::Map<Vector3>{out} = continuous_log(q);
      break;
    }
    case RotationRepresentation::quaternion:
      out[0] = q.w();
      Eigen::Map<Vector3>{out + 1} = q.vec();
      break;
    case RotationRepresentation::rotation_matrix:
      Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>{out} = to_matrix(q);
      break;
  }
}

Quaternion read_rotation(const double* in, RotationRepresentation r) {
  switch (r) {
    case RotationRepresentation::axis_angle: return exp_map(Eigen::Map<const Vector3>(in));
    case RotationRepresentation::quaternion: {
      const Quaternion q(in[0], in[1], in[2], in[3]);
      return q.norm() < 1e-6 ? Quaternion::Identity() : q.normalized();
    }
    case RotationRepresentation::rotation_matrix: {
      const RotationMatrix m = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(in);
      if (!(m.col(0).cross(m.col(1)).norm() > 1e-9)) return Quaternion::Identity();
      return to_quaternion(orthonormalize(m));
    }
  }
  return Quaternion::Identity();
}

}  // namespace

RotationRepresentation parse_representation(const std::string& name) {
  for (const auto r : {RotationRepresentation::axis_angle, RotationRepresentation::quaternion, RotationRepresentation::rotation_matrix})
    if (name == text(r)) return r;
  refuse_usage("representation '" + name + "', expected axis-angle, quaternion or rotation-matrix");
}

std::string text(RotationRepresentation r) {
  switch (r) {
    case RotationRepresentation::axis_angle: return "axis-angle";
    case RotationRepresentation::quaternion: return "quaternion";
    case RotationRepresentation::rotation_matrix: return "rotation-matrix";
  }
  return {};
}

FeatureMatrix encode_motion_cell(const Clip& clip, RotationRepresentation representation) {
  if (!clip.translations.empty()) refuse({{}, 0, "clip " + clip.name}, "joints that move against their parents, expected rotations only");
  if (clip.frames() == 0) refuse({{}, 0, "clip " + clip.name}, "0 frames, expected at least one");
  const auto joints = static_cast<std::size_t>(clip.joints());
  const auto frames = static_cast<Eigen::Index>(clip.frames());
  const MotionCellLayout layout{clip.joints() - 1, representation};
  const int k = layout.rotation_values(), root = layout.rotation_columns();
  FeatureMatrix x(frames, layout.columns());

  auto q = clip.rotations;
  for (std::size_t j = 1; j < joints; ++j) {
    make_sign_continuous(q, j, joints, clip.frames());
    double side = 0;
    for (std::size_t t = 0; t < clip.frames(); ++t) side += q[t * joints + j].w();
    if (side < 0)
      for (std::size_t t = 0; t < clip.frames(); ++t) q[t * joints + j].coeffs() *= -1;
    for (Eigen::Index t = 0; t < frames; ++t)
      write_rotation(q[static_cast<std::size_t>(t) * joints + j], representation, &x(t, static_cast<Eigen::Index>(j - 1) * k));
  }

  std::vector<double> heading(clip.frames());
  for (std::size_t t = 0; t < clip.frames(); ++t) heading[t] = yaw_of(clip.rotations[t * joints]);
  for (Eigen::Index t = 0; t < frames; ++t) {
    const auto now = static_cast<std::size_t>(t);
    const Vector3 tilt = log_map(yaw_rotation(-heading[now]) * clip.rotations[now * joints]);
    x(t, root + 2) = clip.root_position[now].z();
    x(t, root + 4) = tilt.x();
    x(t, root + 5) = tilt.y();
    if (t + 1 < frames) {
      const Vector3 v = yaw_rotation(-heading[now]) * (clip.root_position[now + 1] - clip.root_position[now]) * clip.frame_rate_hz;
      x(t, root + 0) = v.x();
      x(t, root + 1) = v.y();
      x(t, root + 3) = wrap_angle(heading[now + 1] - heading[now]) * clip.frame_rate_hz;
    } else {
      for (const int c : {0, 1, 3}) x(t, root + c) = t > 0 ? x(t - 1, root + c) : 0.0;
    }
  }
  return x;
}

Clip decode_motion_cell(const FeatureMatrix& x, const std::shared_ptr<const Skeleton>& skeleton, double frame_rate_hz, RotationRepresentation representation,
                        const Placement& start) {
  const MotionCellLayout layout{skeleton->joint_count() - 1, representation};
  if (x.cols() != layout.columns())
    throw Error(Exit::internal, {}, std::to_string(x.cols()) + " feature columns, expected " + std::to_string(layout.columns()));
  const int k = layout.rotation_values(), root = layout.rotation_columns();
  const auto joints = static_cast<std::size_t>(skeleton->joint_count());
  Clip clip;
  clip.skeleton = skeleton;
  clip.frame_rate_hz = frame_rate_hz;
  clip.rotations.resize(static_cast<std::size_t>(x.rows()) * joints);
  clip.root_position.resize(static_cast<std::size_t>(x.rows()));
  double heading = start.heading;
  Vector2 place = start.position;
  for (Eigen::Index t = 0; t < x.rows(); ++t) {
    const auto frame = clip.frame(static_cast<std::size_t>(t));
    const Quaternion turn = yaw_rotation(heading);
    frame[0] = turn * exp_map(Vector3(x(t, root + 4), x(t, root + 5), 0));
    for (std::size_t j = 1; j < joints; ++j) frame[j] = read_rotation(&x(t, static_cast<Eigen::Index>(j - 1) * k), representation);
    clip.root_position[static_cast<std::size_t>(t)] = Vector3(place.x(), place.y(), x(t, root + 2));
    const Vector3 step = turn * Vector3(x(t, root + 0), x(t, root + 1), 0) / frame_rate_hz;
    place += step.head<2>();
    heading += x(t, root + 3) / frame_rate_hz;
  }
  make_sign_continuous(clip);
  return clip;
}

FeatureStatistics::FeatureStatistics(const MotionCellLayout& layout)
    : layout_(layout), sum_(Eigen::VectorXd::Zero(layout.columns())), square_sum_(Eigen::VectorXd::Zero(layout.columns())) {}

void FeatureStatistics::add(const FeatureMatrix& x) {
  if (shift_.size() == 0) shift_ = x.row(0);
  for (Eigen::Index t = 0; t < x.rows(); ++t) {
    const Eigen::VectorXd d = x.row(t).transpose() - shift_;
    sum_ += d;
    square_sum_ += d.cwiseProduct(d);
  }
  count_ += static_cast<double>(x.rows());
}

std::vector<float> FeatureStatistics::mean() const {
  std::vector<float> out;
  for (Eigen::Index c = 0; c < sum_.size(); ++c) out.push_back(static_cast<float>(count_ > 0 ? shift_[c] + sum_[c] / count_ : 0));
  return out;
}

std::vector<float> FeatureStatistics::deviation() const {
  const int k = layout_.rotation_values();
  std::vector<double> own(static_cast<std::size_t>(sum_.size()));
  for (Eigen::Index c = 0; c < sum_.size(); ++c) {
    const double m = count_ > 0 ? sum_[c] / count_ : 0;
    own[static_cast<std::size_t>(c)] = count_ > 0 ? std::sqrt(std::max(0.0, square_sum_[c] / count_ - m * m)) : 0;
  }
  std::vector<float> out;
  for (std::size_t c = 0; c < own.size(); ++c) {
    if (static_cast<int>(c) < layout_.rotation_columns()) {
      const std::size_t first = c / static_cast<std::size_t>(k) * static_cast<std::size_t>(k);
      const double largest = *std::max_element(own.begin() + static_cast<std::ptrdiff_t>(first), own.begin() + static_cast<std::ptrdiff_t>(first + static_cast<std::size_t>(k)));
      out.push_back(static_cast<float>(std::max(largest, 0.02)));
    } else {
      out.push_back(static_cast<float>(std::max(own[c], 1e-3)));
    }
  }
  return out;
}

}  // namespace mocap::features
