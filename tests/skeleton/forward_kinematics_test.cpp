#include "libmocap/skeleton/forward_kinematics.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include "libmocap/base/error.hpp"

namespace mocap {
namespace {

Vector3 vector(std::istream& in) {
  double x = 0, y = 0, z = 0;
  in >> x >> y >> z;
  return {x, y, z};
}

// tests/data/skeleton/forward_kinematics.py computes the expected poses with 4x4 matrices in NumPy.
TEST(ForwardKinematics, AgreesWithNumPy) {
  std::ifstream in(TEST_DATA "/skeleton/forward_kinematics.tsv");
  std::size_t joints = 0;
  in >> joints;
  ASSERT_EQ(joints, 14u);
  Skeleton s;
  for (std::size_t j = 0; j < joints; ++j) {
    s.joint_names.push_back("j" + std::to_string(j));
    in >> s.parents.emplace_back();
    s.rest_offsets.push_back(vector(in));
  }
  s.end_sites.push_back({3, {0.1, 0.2, 0.3}});
  s.validate();
  int poses = 0;
  std::string word;
  for (; in >> word; ++poses) {
    bool moved = false;
    in >> moved;
    const Vector3 root = vector(in);
    std::vector<Quaternion> local(joints);
    std::vector<Vector3> positions(joints), translations;
    std::vector<RotationMatrix> rotations(joints);
    for (std::size_t j = 0; j < joints; ++j) {
      in >> local[j].w() >> local[j].x() >> local[j].y() >> local[j].z();
      positions[j] = vector(in);
      for (int k = 0; k < 9; ++k) in >> rotations[j](k / 3, k % 3);
      if (moved) translations.push_back(vector(in));
    }
    ASSERT_TRUE(in);
    Pose pose;
    forward_kinematics(s, local, root, pose, translations);
    for (std::size_t j = 0; j < joints; ++j) {
      EXPECT_LT((pose.positions[j] - positions[j]).norm(), 1e-12) << j;
      EXPECT_LT((to_matrix(pose.rotations[j]) - rotations[j]).cwiseAbs().maxCoeff(), 1e-12) << j;
    }
    const auto tips = end_site_positions(s, pose);
    ASSERT_EQ(tips.size(), 1u);
    EXPECT_LT((tips[0] - (positions[3] + rotations[3] * Vector3(0.1, 0.2, 0.3))).norm(), 1e-12);
  }
  EXPECT_EQ(poses, 3);
}

TEST(ForwardKinematics, RefusesSizesThatDoNotFit) {
  Skeleton s;
  s.joint_names = {"a", "b"};
  s.parents = {-1, 0};
  s.rest_offsets = {{0, 0, 0}, {0, 0, 1}};
  Pose pose;
  const std::vector<Quaternion> one(1, Quaternion::Identity()), two(2, Quaternion::Identity());
  const std::vector<Vector3> moved(1, Vector3::Zero());
  EXPECT_THROW(forward_kinematics(s, one, Vector3::Zero(), pose), Error);
  EXPECT_THROW(forward_kinematics(s, two, Vector3::Zero(), pose, moved), Error);
  EXPECT_NO_THROW(forward_kinematics(s, two, Vector3::Zero(), pose));
}

}  // namespace
}  // namespace mocap
