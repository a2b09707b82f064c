#include "libmodels/objective/motion_objective.hpp"

#include <fmt/core.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "libmocap/base/error.hpp"
#include "libmocap/skeleton/forward_kinematics.hpp"
#include "tests/objective/data.hpp"

namespace mocap::objective {
namespace {

using features::RotationRepresentation;
using mocap::testing::refusal;
using mocap::testing::TemporaryFolder;
using torch::Tensor;
using train::MotionDataset;

const MotionDataset& data(RotationRepresentation r) {
  static const TemporaryFolder folder;
  static std::map<RotationRepresentation, std::unique_ptr<MotionDataset>> sets;
  if (sets.empty()) mocap::testing::write_archive(folder / "w.h5", mocap::testing::waves());
  if (!sets[r]) sets[r] = std::make_unique<MotionDataset>(folder / "w.h5", r, std::vector<std::string>{});
  return *sets[r];
}

train::Batch batch_of(const MotionDataset& set) {
  return train::fixed_batch(set, {0, 1, 2, 3}, 30, train::identity_padding(set.layout(), set.mean(), set.deviation()));
}

Tensor near(const train::Batch& batch, double by, std::uint64_t stream = 1) {
  Random random(2, stream);
  return batch.features + by * nn::normal_tensor(batch.features.sizes(), random);
}

using Numbers = std::vector<double>;

Quaternion rotation_of(const Numbers& x, RotationRepresentation r) {
  if (r == RotationRepresentation::quaternion) return Quaternion(x[0], x[1], x[2], x[3]).normalized();
  if (r == RotationRepresentation::axis_angle) return exp_map(Vector3(x[0], x[1], x[2]));
  RotationMatrix m;
  for (int i = 0; i < 9; ++i) m(i / 3, i % 3) = x[static_cast<std::size_t>(i)];
  return to_quaternion(orthonormalize(m));
}

// The header's formulas in plain double, frame by frame.
double oracle(const MotionDataset& set, const ObjectiveConfig& c, const Tensor& y, const train::Batch& batch) {
  const auto& layout = set.layout();
  const auto r = layout.representation;
  const auto k = static_cast<std::size_t>(layout.rotation_values());
  const Skeleton& body = *set.header().skeleton;
  auto alpha = impact_factors(body, c.joint_weight_floor);
  if (c.uniform_joints) {
    double sum = 0;
    for (const double a : alpha) sum += a;
    std::fill(alpha.begin(), alpha.end(), sum / static_cast<double>(alpha.size()));
  }
  const auto value = [&](const Tensor& t, std::int64_t b, std::int64_t f, std::size_t column) {
    return static_cast<double>(t[b][f][static_cast<std::int64_t>(column)].item<float>()) * set.deviation()[column] + set.mean()[column];
  };
  double total = 0;
  for (std::int64_t b = 0; b < y.size(0); ++b)
    for (std::int64_t f = 0; f < y.size(1); ++f) {
      if (batch.mask[b][f].item<float>() == 0) continue;
      const auto joints = static_cast<std::size_t>(layout.joints);
      const auto numbers = [&](const Tensor& t, std::int64_t frame, std::size_t j) {
        Numbers x;
        for (std::size_t i = 0; i < k; ++i) x.push_back(value(t, b, frame, j * k + i));
        return x;
      };
      double loss = 0;
      for (std::size_t j = 0; j < joints; ++j) {
        const double a = alpha[j + 1];
        const Numbers made = numbers(y, f, j), real = numbers(batch.features, f, j);
        const Quaternion q = rotation_of(made, r), goal = rotation_of(real, r);
        switch (c.distance) {
          case Distance::d1: loss += a * 2 * std::acos(std::min(1.0, std::abs(q.dot(goal)))); break;
          case Distance::d2: loss += a * (1 - std::abs(q.dot(goal))); break;
          case Distance::d3: loss += a * std::min((q.coeffs() - goal.coeffs()).squaredNorm(), (q.coeffs() + goal.coeffs()).squaredNorm()); break;
          case Distance::geodesic: loss += a * log_map(to_quaternion(to_matrix(q) * to_matrix(goal).transpose())).norm(); break;
          case Distance::l2:
            for (std::size_t i = 0; i < k; ++i) loss += a * std::pow(made[i] - real[i], 2);
            break;
          case Distance::fk: break;
        }
        if (r == RotationRepresentation::quaternion) {
          double norm2 = 0;
          for (const double x : made) norm2 += x * x;
          loss += c.unit_norm_weight * std::abs(norm2 - 1);
        }
        if (r == RotationRepresentation::rotation_matrix) {
          RotationMatrix m;
          for (int i = 0; i < 9; ++i) m(i / 3, i % 3) = made[static_cast<std::size_t>(i)];
          loss += c.orthogonality_weight * (m * m.transpose() - RotationMatrix::Identity()).squaredNorm() + c.determinant_weight * std::abs(m.determinant() - 1);
        }
        if (f > 0 && c.velocity_weight > 0) {
          // Signs do not matter as long as they are continuous: every quaternion on the side of its goal, goals on that of the first.
          const Quaternion goal_before = rotation_of(numbers(batch.features, f - 1, j), r), before = rotation_of(numbers(y, f - 1, j), r);
          const auto on_side = [](const Quaternion& x, const Eigen::Vector4d& side) { return Eigen::Vector4d(x.coeffs().dot(side) < 0 ? -x.coeffs() : x.coeffs()); };
          const Eigen::Vector4d g0 = goal_before.coeffs(), g1 = on_side(goal, g0);
          loss += c.velocity_weight * a * 2 * std::sqrt(((on_side(q, g1) - g1) - (on_side(before, g0) - g0)).squaredNorm() + 1e-8);
        }
      }
      if (c.distance == Distance::fk) {
        const auto places = [&](const Tensor& t) {
          const std::size_t root = joints * k;
          std::vector<Quaternion> local = {exp_map(Vector3(value(t, b, f, root + 4), value(t, b, f, root + 5), 0))};
          for (std::size_t j = 0; j < joints; ++j) local.push_back(rotation_of(numbers(t, f, j), r));
          Pose pose;
          forward_kinematics(body, local, Vector3::Zero(), pose);
          auto all = pose.positions;
          const auto tips = end_site_positions(body, pose);
          all.insert(all.end(), tips.begin(), tips.end());
          return all;
        };
        const auto made = places(y), real = places(batch.features);
        for (std::size_t i = 1; i < made.size(); ++i) loss += (made[i] - real[i]).norm();
      }
      for (std::size_t i = 0; i < 6; ++i) {
        const std::size_t column = joints * k + i;
        const double weight = i < 4 ? c.root_weight : *std::max_element(alpha.begin(), alpha.end());
        const auto error = [&](std::int64_t frame) { return (value(y, b, frame, column) - value(batch.features, b, frame, column)) / set.deviation()[column]; };
        const auto size = [](double e) { return std::sqrt(e * e + 1e-6) - 1e-3; };
        loss += weight * size(error(f));
        if (f > 0) loss += c.velocity_weight * weight * size(error(f) - error(f - 1));
      }
      total += loss;
    }
  return total;
}

struct Case {
  RotationRepresentation representation;
  Distance distance;
};
std::vector<Case> cases() {
  std::vector<Case> all;
  for (const auto r : {RotationRepresentation::quaternion, RotationRepresentation::rotation_matrix, RotationRepresentation::axis_angle})
    for (const auto d : {Distance::d1, Distance::d2, Distance::d3, Distance::geodesic, Distance::l2, Distance::fk})
      if (refusal([&] { check_distance(d, r); }).empty()) all.push_back({r, d});
  return all;
}

TEST(MotionObjective, EveryDistanceOfEveryRepresentationEqualsItsFormula) {
  int tried = 0;
  for (const auto& [r, d] : cases())
    for (const bool other : {false, true}) {
      ObjectiveConfig c;
      c.distance = d;
      c.velocity_weight = other ? 0 : 0.7;
      c.uniform_joints = other && d != Distance::fk;
      c.orthogonality_weight = 0.3;
      const auto& set = data(r);
      const auto batch = batch_of(set);
      const Tensor y = near(batch, 0.5);
      Figures figures;
      const Tensor loss = MotionObjective(c, set)(y, batch, figures);
      const double expected = oracle(set, c, y, batch);
      EXPECT_NEAR(loss.sum().item<double>(), expected, 3e-5 * expected) << text(r) << " " << text(d);
      EXPECT_GT(figures.angle, 0);
      EXPECT_GT(figures.distance, 0);
      EXPECT_EQ(figures.constraint > 0, r != RotationRepresentation::axis_angle);
      EXPECT_EQ((loss * (1 - batch.mask)).abs().sum().item<double>(), 0);
      ++tried;
    }
  EXPECT_EQ(tried, 2 * (5 + 3 + 6));
}

TEST(MotionObjective, GradientsAgainstFiniteDifferences) {
  for (const auto& [r, d] : cases()) {
    ObjectiveConfig c;
    c.distance = d;
    c.velocity_weight = 0.7;
    const auto& set = data(r);
    const auto batch = batch_of(set);
    const MotionObjective objective(c, set);
    const Tensor y = near(batch, 0.5).set_requires_grad(true);
    Figures figures;
    const Tensor gradient = torch::autograd::grad({objective(y, batch, figures).sum()}, {y})[0];
    // Along a direction of its own for the root and for the rotations: in float each has its digits.
    const std::int64_t n = set.layout().rotation_columns();
    for (const bool root : {false, true}) {
      const Tensor direction = torch::zeros_like(gradient);
      const std::int64_t first = root ? n : 0, count = root ? features::kRootValues : n;
      direction.narrow(2, first, count).copy_(gradient.narrow(2, first, count));
      const double length = direction.norm().item<double>();
      const auto at = [&](double s) {
        const torch::NoGradGuard no_grad;
        return objective(y + s / length * direction, batch, figures).to(torch::kDouble).sum().item<double>();
      };
      const double step = 0.02, numeric = (8 * (at(step) - at(-step)) - (at(2 * step) - at(-2 * step))) / (12 * step);
      EXPECT_NEAR(numeric, length, 0.01 * length) << text(r) << " " << text(d) << (root ? " root" : " rotations");
    }
  }
}

TEST(MotionObjective, PerfectReconstructionCostsNothing) {
  for (const auto& [r, d] : cases()) {
    ObjectiveConfig c;
    c.distance = d;
    const auto& set = data(r);
    const auto batch = batch_of(set);
    Figures figures;
    const double frames = batch.mask.sum().item<double>();
    EXPECT_LT(MotionObjective(c, set)(batch.features, batch, figures).sum().item<double>() / frames, 1e-4) << text(r) << " " << text(d);
    EXPECT_LT(figures.angle / frames, 1e-6);
  }
}

TEST(MotionObjective, ImpossiblePairsNameThePossibleOnes) {
  const auto said = [](Distance d, RotationRepresentation r) { return refusal([&] { check_distance(d, r); }); };
  EXPECT_NE(said(Distance::geodesic, RotationRepresentation::quaternion).find("expected one of d1, d2, d3, l2, fk"), std::string::npos);
  EXPECT_NE(said(Distance::d1, RotationRepresentation::rotation_matrix).find("expected one of geodesic, l2, fk"), std::string::npos);
  EXPECT_NE(refusal([] { parse_distance("d4"); }).find("d4"), std::string::npos);
  ObjectiveConfig c;
  EXPECT_THROW(MotionObjective(c, data(RotationRepresentation::rotation_matrix)), Error);
  c.distance = Distance::fk;
  c.uniform_joints = true;
  EXPECT_THROW(MotionObjective(c, data(RotationRepresentation::quaternion)), Error);
  EXPECT_EQ(default_distance(RotationRepresentation::quaternion), Distance::d1);
  EXPECT_EQ(default_distance(RotationRepresentation::rotation_matrix), Distance::geodesic);
  EXPECT_EQ(default_distance(RotationRepresentation::axis_angle), Distance::l2);
}

TEST(ObjectiveConfig, JsonRoundTrip) {
  ObjectiveConfig c{0.1, 0.2, 0.3, 0.4, Distance::fk, true, 0.5, 0.6};
  const auto json = nlohmann::json::parse(to_json(c).dump());
  EXPECT_EQ(to_json(objective_config_from_json(json)), json);
  EXPECT_EQ(json.size(), 8u);
  for (const auto& [key, value] : json.items()) {
    auto other = json;
    other.erase(key);
    EXPECT_THROW(objective_config_from_json(other), Error) << key;
    other[key] = key == "distance" ? nlohmann::json("d9") : nlohmann::json("text");
    EXPECT_NE(refusal([&] { objective_config_from_json(other); }).find("config/training/objective"), std::string::npos) << key;
  }
}

}  // namespace
}  // namespace mocap::objective
