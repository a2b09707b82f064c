// Rotations of the canonical body for given joint positions: inverse kinematics in closed form, frame by frame, bones keep their length.
//
// For motion that exists as positions (a network's output, markers at joints), whose bones need not be of any one length. From the pelvis outwards:
//   pelvis     at its place; turned so that the line through the hips and, in its plane, spine1 point as they do
//   chest      (spine3) turned so that the neck and, in its plane, the line through the shoulders point as they do; what lies between pelvis and chest is shared by spine1, spine2 and spine3, a third
//              each, and the three are swung so that spine3 lies in the right direction
//   collars, neck   swung to shoulder and head, ankles to the toe base: the shortest rotation that does it
//   arms, legs      two bones with a hinge between them (knee: Y, the shin goes back; elbow: Z, the forearm goes forward). The end comes to its place where it is within reach, else as near as it
//              can; how far the hinge is open follows from the distance, |a + R_h(theta) b| = d, and the plane of the limb from the middle joint: its normal n = (middle - start) x (end - start).
//              A straight limb has no plane, so what would be natural is added to n, little beside a limb that is bent: for legs the normal of shin and foot and the pelvis's left, for arms the
//              hinge as the shortest swing from the T-pose carries it. A limb that closes the wrong way by a few degrees (legs 6, arms 3) counts as straight. So limbs pass through straight, and a little beyond,
//              without turning over.
//   not to be seen in positions: how wrists, toe bases and head are turned, and the turn of neck, ankles and forearms about their own axis. They are those of a `natural` pose, the mean of some
//              motion or the T-pose
//
// Accuracy on motion of the body itself (positions of 19 joints, without collars and spine2): ends of limbs within reach exact; means in docs/results.md.
#pragma once
#include <Eigen/Core>
#include <memory>
#include <vector>

#include "libmocap/clip/clip.hpp"

namespace mocap {

using JointPositions = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;  // [T, 3 K], metres, world, Z up

struct JointFit {  // how far a joint of the result is from where it should be
  double mean_mm = 0, worst_mm = 0;
  std::size_t worst_frame = 0;
};
struct PositionFit {
  Clip clip;                     // rotations and root positions; no name
  std::size_t frames = 0;
  std::vector<JointFit> joints;  // as given
  double mean_mm = 0;            // over them
};

class PositionFitter {
 public:
  // joints: which of the skeleton's the positions are of. Error(data): a skeleton without a joint of the canonical body, a joint that is needed and not given (all 22 but spine2 and the collars).
  // natural: local rotations [J], what is not to be seen is taken from; empty: the T-pose. Error(data) for another number of them.
  PositionFitter(std::shared_ptr<const Skeleton> skeleton, std::vector<int> joints, const std::vector<Quaternion>& natural = {});

  // Error(data): another number of columns than 3 K, no frames, a number that is not finite (frame and joint are named), a rate that is not above 0.
  // Cost: about 3 us a frame. Thread-safe; a frame depends on itself alone, but for the signs of quaternions.
  PositionFit operator()(const JointPositions& positions, double frame_rate_hz) const;

 private:
  struct Body;
  std::shared_ptr<const Skeleton> skeleton_;
  std::vector<int> joints_;
  std::shared_ptr<const Body> body_;
};

// Mean local rotation of every joint but the root over all frames added: the normalised sum of quaternions brought to the side of the first (within a degree of the true mean where rotations are
// within 90 degrees of it). The root's is the identity.
class MeanPose {
 public:
  void add(const Clip& clip);
  std::vector<Quaternion> rotations() const;  // [J]; empty where nothing was added

 private:
  std::vector<Eigen::Vector4d> sum_;
};

}  // namespace mocap
