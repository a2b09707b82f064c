#include "libmocap/features/state.hpp"

#include "libmocap/base/error.hpp"
#include "libmocap/features/continuous_log.hpp"

namespace mocap::features {

int state_columns(const Skeleton& skeleton) { return kStateRootValues + 3 * (skeleton.joint_count() - 1); }

FeatureMatrix StateEncoder::operator()(const Clip& piece) {
  if (!piece.translations.empty()) refuse({{}, 0, "clip " + piece.name}, "joints that move against their parents, expected rotations only");
  if (piece.frames() == 0) refuse({{}, 0, "clip " + piece.name}, "0 frames, expected at least one");
  const auto joints = static_cast<std::size_t>(piece.joints());
  FeatureMatrix x(static_cast<Eigen::Index>(piece.frames()), state_columns(*piece.skeleton));
  const bool first = before_.empty();
  for (std::size_t t = 0; t < piece.frames(); ++t) {
    const auto row = static_cast<Eigen::Index>(t);
    const auto q = piece.frame(t);
    const double heading = yaw_of(q[0]);
    if (before_.empty()) {
      x.row(row).head<3>().setZero();
    } else {
      const double last = yaw_of(before_[0]);
      const Vector3 step = yaw_rotation(-last) * (piece.root_position[t] - place_);
      x(row, 0) = step.x();
      x(row, 1) = step.y();
      x(row, 2) = wrap_angle(heading - last);
    }
    const Vector3 tilt = log_map(yaw_rotation(-heading) * q[0]);
    x(row, 3) = piece.root_position[t].z();
    x(row, 4) = tilt.x();
    x(row, 5) = tilt.y();
    const bool start = before_.empty();
    if (start) before_.resize(joints);
    before_[0] = q[0];
    for (std::size_t j = 1; j < joints; ++j) {
      Quaternion now = q[j];
      if (start ? now.w() < 0 : now.dot(before_[j]) < 0) now.coeffs() *= -1;
      before_[j] = now;
      x.row(row).segment<3>(kStateRootValues + 3 * static_cast<Eigen::Index>(j - 1)) = continuous_log(now).transpose();
    }
    place_ = piece.root_position[t];
  }
  if (first && x.rows() > 1) x.row(0).head<3>() = x.row(1).head<3>();
  return x;
}

StateDecoder::StateDecoder(std::shared_ptr<const Skeleton> skeleton, double frame_rate_hz, const Placement& start) : skeleton_(std::move(skeleton)), rate_(frame_rate_hz), now_(start) {}

Clip StateDecoder::operator()(const FeatureMatrix& x) {
  if (x.cols() != state_columns(*skeleton_)) throw Error(Exit::internal, {}, std::to_string(x.cols()) + " state columns, expected " + std::to_string(state_columns(*skeleton_)));
  const auto joints = static_cast<std::size_t>(skeleton_->joint_count());
  Clip clip;
  clip.skeleton = skeleton_;
  clip.frame_rate_hz = rate_;
  clip.rotations.resize(static_cast<std::size_t>(x.rows()) * joints);
  clip.root_position.resize(static_cast<std::size_t>(x.rows()));
  for (Eigen::Index t = 0; t < x.rows(); ++t) {
    if (!before_.empty()) {
      now_.position += (yaw_rotation(now_.heading) * Vector3(x(t, 0), x(t, 1), 0)).head<2>();
      now_.heading += x(t, 2);
    }
    const auto frame = clip.frame(static_cast<std::size_t>(t));
    frame[0] = yaw_rotation(now_.heading) * exp_map(Vector3(x(t, 4), x(t, 5), 0));
    for (std::size_t j = 1; j < joints; ++j) frame[j] = exp_map(x.row(t).segment<3>(kStateRootValues + 3 * static_cast<Eigen::Index>(j - 1)).transpose());
    for (std::size_t j = 0; j < joints && !before_.empty(); ++j)
      if (frame[j].dot(before_[j]) < 0) frame[j].coeffs() *= -1;
    before_.assign(frame.begin(), frame.end());
    clip.root_position[static_cast<std::size_t>(t)] = Vector3(now_.position.x(), now_.position.y(), x(t, 3));
  }
  return clip;
}

FeatureMatrix encode_state(const Clip& clip) { return StateEncoder()(clip); }

Clip decode_state(const FeatureMatrix& features, const std::shared_ptr<const Skeleton>& skeleton, double frame_rate_hz, const Placement& start) {
  return StateDecoder(skeleton, frame_rate_hz, start)(features);
}

Placement placement_of(const Clip& clip, std::size_t frame) { return {yaw_of(clip.frame(frame)[0]), clip.root_position[frame].head<2>()}; }

}  // namespace mocap::features
