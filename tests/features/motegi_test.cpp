#include "libmocap/features/motegi.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include "libmocap/base/error.hpp"
#include "libmocap/base/random.hpp"
#include "libmocap/clip/mirror.hpp"
#include "libmocap/skeleton/canonical_body.hpp"

namespace mocap::features {
namespace {

constexpr double kRate = 30;

int column(std::string_view joint) {  // of its x in the features
  const auto& names = motegi_joint_names();
  return 3 * static_cast<int>(std::find(names.begin(), names.end(), joint) - names.begin()) - 2;
}

// Walks about, leans and waves; upright enough to face somewhere.
Clip wandering(std::size_t frames, std::uint64_t seed) {
  Clip clip;
  clip.skeleton = canonical_body();
  clip.frame_rate_hz = kRate;
  Random random(seed, 0);
  std::vector<Vector3> axis(22);
  for (auto& a : axis) a = 0.4 * Vector3(random.normal(), random.normal(), random.normal());
  double heading = 0.3;
  Vector3 place(1, -2, 0.95);
  for (std::size_t t = 0; t < frames; ++t) {
    heading += 0.06 * std::sin(0.05 * static_cast<double>(t)) + 0.05;  // round and round
    place += yaw_rotation(heading) * Vector3(0.04, 0.01 * std::sin(0.3 * static_cast<double>(t)), 0);
    place.z() = 0.95 + 0.03 * std::cos(0.4 * static_cast<double>(t));
    for (std::size_t j = 0; j < 22; ++j) {
      const Quaternion q = exp_map(axis[j] * std::sin(0.2 * static_cast<double>(t) + static_cast<double>(j)));
      clip.rotations.push_back(j == 0 ? yaw_rotation(heading) * exp_map(0.2 * log_map(q)) : q);
    }
    clip.root_position.push_back(place);
  }
  return clip;
}

FeatureMatrix t_pose() {
  Clip clip;
  clip.skeleton = canonical_body();
  clip.rotations.assign(22, Quaternion::Identity());
  clip.root_position = {Vector3(0, 0, 1)};
  return motegi_positions(clip);
}

// A body with nothing but a pelvis, a waist and shoulders whose v_f rises by `steepness` from the ground, facing `heading`; `size` scales it.
Eigen::RowVectorXd leaning(double steepness, double heading, double size = 1) {
  Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(57);
  const Vector3 up(-0.5 * std::sin(steepness), 0, 0.5 * std::cos(steepness)), left(0, 0.2, 0);
  row.segment<3>(3 * 13) = (size * (yaw_rotation(heading) * (up + left))).transpose();
  row.segment<3>(3 * 16) = (size * (yaw_rotation(heading) * (up - left))).transpose();
  return row;
}

// The second route: section II as it is printed, with 4x4 matrices in the paper's axes (X left, Y up, Z forward; ours are Z, X, Y of it). `printed`: with its left-handed basis.
FeatureMatrix by_matrices(const FeatureMatrix& p, double rate, bool printed) {
  const auto at = [&](Eigen::Index t, int j) { return Vector3(p(t, 3 * j + 1), p(t, 3 * j + 2), p(t, 3 * j)); };
  double floor = at(0, 0).y();
  for (int j = 1; j < 19; ++j) floor = std::min(floor, at(0, j).y());
  const auto m_gl = [&](Eigen::Index t) {
    const Vector3 v_f = (at(t, 13) - at(t, 0)).cross(at(t, 16) - at(t, 0)), e_y = Vector3::UnitY();
    const Vector3 e_x = (printed ? v_f.cross(e_y) : e_y.cross(v_f)).normalized(), e_z = printed ? e_y.cross(e_x) : e_x.cross(e_y);
    Eigen::Matrix4d r = Eigen::Matrix4d::Identity(), to = Eigen::Matrix4d::Identity();
    r.block<3, 1>(0, 0) = e_x;
    r.block<3, 1>(0, 1) = e_y;
    r.block<3, 1>(0, 2) = e_z;
    to.block<3, 1>(0, 3) = Vector3(at(t, 0).x(), floor, at(t, 0).z());
    EXPECT_NEAR(r.determinant(), printed ? -1 : 1, 1e-12);
    return Eigen::Matrix4d(to * r);
  };
  FeatureMatrix x(p.rows(), 58);
  for (Eigen::Index t = 0; t < p.rows(); ++t) {
    const Eigen::Matrix4d m_lg = m_gl(t).inverse();
    for (int j = 0; j < 19; ++j) {
      const Eigen::Vector4d local = m_lg * at(t, j).homogeneous();
      if (j == 0) x(t, 0) = local.y();
      if (j > 0) x.row(t).segment<3>(3 * j - 2) << local.z(), local.x(), local.y();
    }
    const Eigen::Matrix4d delta = m_gl(std::max<Eigen::Index>(t, 1) - 1).inverse() * m_gl(std::max<Eigen::Index>(t, 1));
    x.row(t).tail(3) << delta(2, 3) * rate, delta(0, 3) * rate, std::atan2(delta(0, 2), delta(2, 2)) * rate;
  }
  return x;
}

std::string refused(const std::function<void()>& body, Exit status = Exit::data) {
  try {
    body();
  } catch (const Error& e) {
    EXPECT_EQ(e.status(), status);
    return e.what();
  }
  return {};
}

// Model files keep means and weights by column: another order would read them wrongly.
TEST(Motegi, JointsHaveTheirOrder) {
  const std::array<std::string_view, 19> order = {"pelvis",     "left_hip", "left_knee", "left_ankle", "left_foot",     "right_hip",  "right_knee", "right_ankle",    "right_foot", "spine1",
                                                  "spine3",     "neck",     "head",      "left_shoulder", "left_elbow", "left_wrist", "right_shoulder", "right_elbow", "right_wrist"};
  EXPECT_EQ(motegi_joint_names(), order);
  const auto joints = motegi_joints(*canonical_body());
  ASSERT_EQ(joints.size(), 19u);
  for (std::size_t j = 0; j < 19; ++j) EXPECT_EQ(canonical_body()->joint_names[static_cast<std::size_t>(joints[j])], order[j]);
}

TEST(Motegi, AgreesWithThePapersMatrices) {
  const FeatureMatrix p = motegi_positions(wandering(300, 6)), x = encode_motegi(p, kRate), m = by_matrices(p, kRate, false);
  EXPECT_LT((x - m).cwiseAbs().maxCoeff(), 1e-9);
  // Its printed basis gives the same with left and right exchanged in sign alone: the motion of a mirrored body under the names of this one.
  FeatureMatrix printed = by_matrices(p, kRate, true);
  EXPECT_GT((x - printed).cwiseAbs().maxCoeff(), 0.3);
  for (Eigen::Index c = 2; c < 55; c += 3) printed.col(c) *= -1;
  printed.rightCols(2) *= -1;
  EXPECT_LT((x - printed).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(Motegi, AxesAreForwardLeftUp) {
  FeatureMatrix p = t_pose();
  p.row(0).segment<3>(3 * 15) = Vector3(0.3, 0.4, 1.6).transpose();  // the left wrist, raised to the front
  const FeatureMatrix x = encode_motegi(p, kRate);
  ASSERT_EQ(x.cols(), 58);
  const int wrist = column("left_wrist");
  EXPECT_NEAR(x(0, wrist), 0.3, 1e-12);
  EXPECT_NEAR(x(0, wrist + 1), 0.4, 1e-12);
  const double floor = motegi_placement(p).floor;
  EXPECT_NEAR(floor, p.row(0).segment<3>(3 * 4).z(), 1e-12);  // a toe base is lowest
  EXPECT_NEAR(x(0, wrist + 2), 1.6 - floor, 1e-12);
  EXPECT_NEAR(x(0, 0), 1 - floor, 1e-12);
  EXPECT_LT(x(0, column("right_shoulder") + 1), -0.1);
  EXPECT_GT(x(0, column("left_foot")), 0.05);
  EXPECT_NEAR(motegi_placement(p).heading, 0, 1e-12);
  EXPECT_EQ(x(0, 55), 0);
}

// What leads to the next frame, by hand: from (0, 0) facing +Y to (1, 2) facing -X.
TEST(Motegi, VelocitiesAreThoseOfTheFrameBefore) {
  const FeatureMatrix one = t_pose();
  FeatureMatrix p(3, 57);
  const auto put = [&](Eigen::Index t, double heading, const Vector3& by) {
    for (int j = 0; j < 19; ++j) p.row(t).segment<3>(3 * j) = (yaw_rotation(heading) * Vector3(one.row(0).segment<3>(3 * j)) + by).transpose();
  };
  const double right = std::numbers::pi / 2;
  put(0, right, Vector3::Zero());
  put(1, 2 * right, {1, 2, 0});
  put(2, 2 * right + 1, {1, 2, 0.5});  // across the half turn
  const FeatureMatrix x = encode_motegi(p, kRate);
  EXPECT_NEAR(x(1, 55), 2 * kRate, 1e-9);   // +Y is forward
  EXPECT_NEAR(x(1, 56), -1 * kRate, 1e-9);  // +X is to the right
  EXPECT_NEAR(x(1, 57), right * kRate, 1e-9);
  EXPECT_NEAR(x(2, 57), kRate, 1e-9);
  EXPECT_NEAR(x(2, 55), 0, 1e-9);
  EXPECT_EQ(x.row(0).tail(3), x.row(1).tail(3));
  EXPECT_NEAR(x(2, 0) - x(1, 0), 0.5, 1e-12);
}

TEST(Motegi, DoesNotSeeWhereInTheWorldItIs) {
  const Clip clip = wandering(50, 1);
  Clip moved = clip;
  for (std::size_t t = 0; t < 50; ++t) {
    moved.root_position[t] = yaw_rotation(2) * clip.root_position[t] + Vector3(5, -3, 0.7);
    moved.frame(t)[0] = yaw_rotation(2) * clip.frame(t)[0];
  }
  const FeatureMatrix a = motegi_positions(clip), b = motegi_positions(moved);
  EXPECT_LT((encode_motegi(a, kRate) - encode_motegi(b, kRate)).cwiseAbs().maxCoeff(), 1e-9);
  const auto from = motegi_placement(a), to = motegi_placement(b);
  EXPECT_NEAR(wrap_angle(to.heading - from.heading - 2), 0, 1e-9);
  EXPECT_NEAR(to.floor - from.floor, 0.7, 1e-9);
}

// Holds for the paper's printed basis too, which turns the lateral signs of both; AxesAreForwardLeftUp and AgreesWithThePapersMatrices tell it apart.
TEST(Motegi, AMirroredMotionHasMirroredFeatures) {
  const Clip clip = wandering(40, 2), mirrored = mirror(clip);
  const FeatureMatrix x = encode_motegi(motegi_positions(clip), kRate), y = encode_motegi(motegi_positions(mirrored), kRate);
  const auto& names = motegi_joint_names();
  for (Eigen::Index t = 0; t < 40; ++t) {
    for (const std::string_view name : names) {
      if (name == "pelvis") continue;
      std::string other(name);
      if (name.starts_with("left")) other = "right" + other.substr(4);
      if (name.starts_with("right")) other = "left" + other.substr(5);
      const int a = column(name), b = column(other);
      EXPECT_NEAR(x(t, a), y(t, b), 1e-9);
      EXPECT_NEAR(x(t, a + 1), -y(t, b + 1), 1e-9);
      EXPECT_NEAR(x(t, a + 2), y(t, b + 2), 1e-9);
    }
    EXPECT_NEAR(x(t, 55), y(t, 55), 1e-9);
    EXPECT_NEAR(x(t, 56), -y(t, 56), 1e-9);
    EXPECT_NEAR(x(t, 57), -y(t, 57), 1e-9);
  }
  EXPECT_GT(x.col(57).cwiseAbs().maxCoeff(), 0.5);
}

TEST(Motegi, RoundTripsAreExact) {
  for (const auto& [frames, bound] : {std::pair<std::size_t, double>{1, 1e-12}, {90, 1e-12}, {10000, 1e-9}}) {
    const FeatureMatrix p = motegi_positions(wandering(frames, 3)), back = decode_motegi(encode_motegi(p, kRate), kRate, motegi_placement(p));
    EXPECT_LT((back - p).cwiseAbs().maxCoeff(), bound) << frames;
  }
  const FeatureMatrix p = motegi_positions(wandering(30, 3)), still = decode_motegi(encode_motegi(p, kRate), kRate);
  EXPECT_EQ(still(0, 0), 0);
  EXPECT_NEAR(motegi_placement(still).heading, 0, 1e-12);
  EXPECT_NEAR(motegi_placement(still).floor, 0, 1e-12);
}

// Bodies thrown about: every joint anywhere in every frame, lying and upside down among them.
TEST(Motegi, RoundTripsOfAnyPoseAreExact) {
  Random random(7, 0);
  Clip clip;
  clip.skeleton = canonical_body();
  clip.frame_rate_hz = kRate;
  for (int t = 0; t < 2000; ++t) {
    for (int j = 0; j < 22; ++j) clip.rotations.push_back(Quaternion(random.normal(), random.normal(), random.normal(), random.normal()).normalized());
    clip.root_position.emplace_back(random.normal(), random.normal(), random.normal());
  }
  const FeatureMatrix p = motegi_positions(clip), x = encode_motegi(p, 120);
  EXPECT_LT((decode_motegi(x, 120, motegi_placement(p)) - p).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_LE(x.col(57).cwiseAbs().maxCoeff(), std::numbers::pi * 120 * (1 + 1e-12));
  EXPECT_GT((x.col(57).array() == 0).count(), 0);  // some lie
}

TEST(Motegi, AnyJointCanBeTheFloor) {
  for (int j = 0; j < 19; ++j) {
    FeatureMatrix p = FeatureMatrix(2, 57);
    p.row(0) = p.row(1) = t_pose().row(0);
    p(0, 3 * j + 2) = -0.25;
    EXPECT_EQ(motegi_placement(p).floor, -0.25) << motegi_joint_names()[static_cast<std::size_t>(j)];
    const FeatureMatrix x = encode_motegi(p, kRate);
    EXPECT_NEAR(x(0, 3 * j), 0, 1e-12);
    EXPECT_NEAR(x(1, 0), p(1, 2) + 0.25, 1e-12);  // that of frame 0 for all
  }
}

TEST(Motegi, APlacementIsThatOfItsFrame) {
  FeatureMatrix p(3, 57);
  for (Eigen::Index t = 0; t < 3; ++t) {
    p.row(t) = leaning(0, 0.5 * static_cast<double>(t));
    for (int j = 0; j < 19; ++j) p.row(t).segment<3>(3 * j) += static_cast<double>(t) * Eigen::RowVector3d(1, -2, 3);
  }
  const auto at = motegi_placement(p, 2);
  EXPECT_EQ(at.x, 2);
  EXPECT_EQ(at.y, -4);
  EXPECT_NEAR(at.heading, 1, 1e-12);
  EXPECT_EQ(at.floor, 6);
}

// Steepness counts, not size: v_f of a body of a centimetre says as much.
TEST(Motegi, AHeadingIsHeldOnlyWhereItIsSteep) {
  const double limit = std::acos(0.1);
  for (const double size : {0.01, 1.0, 100.0}) {
    for (const double sign : {1.0, -1.0}) {
      FeatureMatrix p(2, 57);
      p.row(0) = leaning(0, 0.7);
      p.row(1) = leaning(sign * (limit - 1e-6), 1.2, size);
      EXPECT_NEAR(motegi_placement(p, 1).heading, 1.2, 1e-9);
      EXPECT_NEAR(encode_motegi(p, kRate)(1, 57), 0.5 * kRate, 1e-6);
      p.row(1) = leaning(sign * (limit + 1e-6), 1.2, size);
      EXPECT_NEAR(motegi_placement(p, 1).heading, 0.7, 1e-9);
      EXPECT_NEAR(encode_motegi(p, kRate)(1, 57), 0, 1e-9);
    }
  }
  FeatureMatrix p(2, 57);
  p.row(0) = leaning(0, 0.7);
  p.row(1).setZero();  // no shoulders at all
  EXPECT_NEAR(motegi_placement(p, 1).heading, 0.7, 1e-12);
  EXPECT_EQ(encode_motegi(p, kRate)(1, 57), 0);
  p.row(1) = leaning(-2, 0.7);  // bent over, shoulders under hips: the paper's v_f turns round
  EXPECT_NEAR(std::abs(wrap_angle(motegi_placement(p, 1).heading - 0.7)), std::numbers::pi, 1e-9);
}

// Between two headings it is the last one, not the first and not the next.
TEST(Motegi, TheLastHeadingIsHeld) {
  FeatureMatrix p(5, 57);
  const double flat = std::numbers::pi / 2;
  p.row(0) = leaning(0, 0.4);
  p.row(1) = leaning(0, 1.0);
  p.row(2) = p.row(3) = leaning(flat, 2.5);
  p.row(4) = leaning(0, 1.9);
  const FeatureMatrix x = encode_motegi(p, kRate);
  for (const Eigen::Index t : {1, 2, 3}) EXPECT_NEAR(motegi_placement(p, t).heading, 1.0, 1e-12) << t;
  EXPECT_NEAR(x(2, 57), 0, 1e-12);
  EXPECT_NEAR(x(3, 57), 0, 1e-12);
  EXPECT_NEAR(x(4, 57), 0.9 * kRate, 1e-9);
  EXPECT_LT((decode_motegi(x, kRate, motegi_placement(p)) - p).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(Motegi, WhoLiesFacesWhereHeDidBefore) {
  const FeatureMatrix one = t_pose();
  FeatureMatrix p(5, 57);
  for (Eigen::Index t = 0; t < 5; ++t) {
    // On the back, head to the south, in frames 0 and 3: v_f points up.
    const Quaternion q = t == 0 || t == 3 ? Quaternion(Eigen::AngleAxisd(-std::numbers::pi / 2, Vector3::UnitY())) : yaw_rotation(0.4);
    for (int j = 0; j < 19; ++j) p.row(t).segment<3>(3 * j) = (q * Vector3(one.row(0).segment<3>(3 * j))).transpose();
  }
  const FeatureMatrix x = encode_motegi(p, kRate);
  EXPECT_NEAR(motegi_placement(p, 0).heading, 0.4, 1e-9);
  EXPECT_NEAR(motegi_placement(p, 3).heading, 0.4, 1e-9);
  EXPECT_LT(x.col(57).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_LT((decode_motegi(x, kRate, motegi_placement(p)) - p).cwiseAbs().maxCoeff(), 1e-12);
  const FeatureMatrix lying = p.row(3);
  EXPECT_EQ(motegi_placement(lying).heading, 0);
}

TEST(Motegi, WhatCannotBeIsRefused) {
  const FeatureMatrix p = motegi_positions(wandering(4, 5)), x = encode_motegi(p, kRate);
  EXPECT_NE(refused([&] { encode_motegi(x, kRate); }).find("58 numbers in a frame, expected the 57"), std::string::npos);
  EXPECT_NE(refused([&] { decode_motegi(p, kRate); }).find("57 numbers in a frame, expected the 58"), std::string::npos);
  EXPECT_NE(refused([&] { encode_motegi(FeatureMatrix(0, 57), kRate); }).find("0 frames"), std::string::npos);
  EXPECT_NE(refused([&] { decode_motegi(FeatureMatrix(0, 58), kRate); }).find("0 frames"), std::string::npos);
  EXPECT_NE(refused([&] { encode_motegi(p, 0); }).find("0 Hz"), std::string::npos);
  for (const double rate : {0.0, -30.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
    EXPECT_NE(refused([&] { encode_motegi(p, rate); }).find("Hz, expected a rate above 0"), std::string::npos) << rate;
    EXPECT_NE(refused([&] { decode_motegi(x, rate); }).find("Hz, expected a rate above 0"), std::string::npos) << rate;
  }
  for (const double no : {std::nan(""), std::numeric_limits<double>::infinity()}) {
    FeatureMatrix bad = p, worse = x;
    bad(2, 7) = no;
    worse(3, 57) = no;
    EXPECT_NE(refused([&] { encode_motegi(bad, kRate); }).find("frame 2"), std::string::npos);
    EXPECT_NE(refused([&] { decode_motegi(worse, kRate); }).find("frame 3"), std::string::npos);
  }
  for (const Eigen::Index frame : {-1, 4}) EXPECT_NE(refused([&] { motegi_placement(p, frame); }, Exit::internal), "");
  EXPECT_NE(refused([&] { motegi_placement(x); }, Exit::internal), "");
  auto skeleton = std::make_shared<Skeleton>(*canonical_body());
  skeleton->joint_names[9] = "chest";
  EXPECT_NE(refused([&] { motegi_joints(*skeleton); }).find("no joint spine3"), std::string::npos);
  Clip empty;
  empty.skeleton = canonical_body();
  EXPECT_NE(refused([&] { motegi_positions(empty); }).find("0 frames"), std::string::npos);
}

}  // namespace
}  // namespace mocap::features
