#include "libmodels/objective/classifier_loss.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "libmocap/base/error.hpp"
#include "libmocap/base/sha256.hpp"
#include "tests/objective/data.hpp"

namespace mocap::objective {
namespace {

using features::RotationRepresentation;
using mocap::testing::refusal;
using mocap::testing::slurp;
using mocap::testing::TemporaryFolder;
using mocap::testing::waves;
using torch::Tensor;
using train::MotionDataset;

constexpr RotationRepresentation kAll[] = {RotationRepresentation::quaternion, RotationRepresentation::rotation_matrix, RotationRepresentation::axis_angle};

struct Files {
  TemporaryFolder folder;
  std::string data = folder / "w.h5", action = folder / "action.h5", side = folder / "side.h5";
  std::vector<Clip> real = waves(), made;
  Files() {
    mocap::testing::write_archive(data, real);
    mocap::testing::write_classifier(action, real, "action", {"run", "walk"}, 1);
    mocap::testing::write_classifier(side, real, "side", {"a", "b", "c"}, 2);
    // Like the real ones, a little off.
    made = real;
    Random random(4, 0);
    for (Clip& clip : made)
      for (std::size_t i = 0; i < clip.rotations.size(); ++i) clip.rotations[i] = clip.rotations[i] * exp_map(0.05 * Vector3(random.normal(), random.normal(), random.normal()));
  }
};
const Files& files() {
  static const Files f;
  return f;
}

struct Setting {
  MotionDataset set;
  train::Batch batch;
  Tensor y;  // the made clips, standardised as the data
  explicit Setting(RotationRepresentation r) : set(files().data, r, {}) {
    const Tensor padding = train::identity_padding(set.layout(), set.mean(), set.deviation());
    batch = train::fixed_batch(set, {0, 1, 2, 3}, 30, padding);
    y = padding.expand({4, 30, -1}).clone();
    for (std::int64_t b = 0; b < 4; ++b) {
      const auto x = features::encode_motion_cell(files().made[static_cast<std::size_t>(b)], r);
      for (std::int64_t t = 0; t < std::min<std::int64_t>(30, x.rows()); ++t)
        for (std::int64_t c = 0; c < x.cols(); ++c) y[b][t][c] = (x(t, c) - set.mean()[static_cast<std::size_t>(c)]) / set.deviation()[static_cast<std::size_t>(c)];
    }
  }
};

// Eq. 24 by way of classifier::encode(), clip by clip.
double oracle(const std::string& file) {
  const auto model = classifier::Classifier::load(file);
  const torch::NoGradGuard no_grad;
  std::vector<double> differences(3), squares(3);
  double entropy = 0;
  for (std::size_t b = 0; b < 4; ++b) {
    const auto layers = [&](const Clip& whole) {
      // The window's own last frame ends its differences; root velocities are those of the whole clip.
      const auto pose = features::encode_motion_cell(whole, RotationRepresentation::quaternion);
      const Eigen::Index n = std::min<Eigen::Index>(30, pose.rows()), d = pose.cols();
      features::FeatureMatrix x(n, 2 * d);
      x.leftCols(d) = pose.topRows(n);
      for (Eigen::Index t = 0; t < n; ++t) x.row(t).tail(d) = pose.row(std::min(t + 1, n - 1)) - pose.row(std::min(t, n - 2));
      return model->network().layers(classifier::standardise(x, model->mean(), model->deviation()).unsqueeze(0), {n});
    };
    const auto real = layers(files().real[b]), made = layers(files().made[b]);
    for (std::size_t l = 0; l < 3; ++l) {
      differences[l] += (real[l] - made[l]).square().sum().item<double>();
      squares[l] += real[l].square().sum().item<double>();
    }
    const Tensor p = torch::softmax(model->network().scores(real[3]), 1), q = torch::softmax(model->network().scores(made[3]), 1);
    entropy += (p * (p.log() - q.log())).sum().item<double>();
  }
  double sum = entropy / 4;
  for (std::size_t l = 0; l < 3; ++l) sum += differences[l] / squares[l];
  return sum;
}

TEST(ClassifierLoss, EqualsItsFormulaInEveryRepresentation) {
  const double expected = oracle(files().action) + oracle(files().side);
  EXPECT_GT(expected, 1e-2);
  for (const auto r : kAll) {
    const Setting s(r);
    const ClassifierLoss loss({files().action, files().side}, s.set);
    EXPECT_NEAR(loss(s.y, s.batch).item<double>(), expected, 1e-3 * expected) << text(r);
    EXPECT_LT(loss(s.batch.features, s.batch).item<double>(), 1e-6 * expected) << text(r);
  }
}

TEST(ClassifierLoss, DividesByTheLayersSize) {
  // Twice the scale in every layer: the intermediate terms stay (biases are 0), where raw errors would grow to 4, 16 and 64 times.
  const TemporaryFolder folder;
  mocap::testing::write_classifier(folder / "big.h5", files().real, "action", {"run", "walk"}, 1, 2);
  const Setting s(RotationRepresentation::quaternion);
  const double one = ClassifierLoss({files().action}, s.set)(s.y, s.batch).item<double>(), big = ClassifierLoss({folder / "big.h5"}, s.set)(s.y, s.batch).item<double>();
  EXPECT_GT(big, 0.8 * one);
  EXPECT_LT(big, 40 * one);
  const auto model = classifier::Classifier::load(folder / "big.h5");
  EXPECT_NEAR(big, oracle(folder / "big.h5"), 1e-3 * big);
}

TEST(ClassifierLoss, GradientThroughTheReconstructionAlone) {
  for (const auto r : kAll) {
    const Setting s(r);
    const ClassifierLoss loss({files().action, files().side}, s.set);
    const Tensor y = s.y.clone().set_requires_grad(true);
    train::Batch batch = s.batch;
    batch.features = batch.features.clone().set_requires_grad(true);
    const auto g = torch::autograd::grad({loss(y, s.batch)}, {y});
    const Tensor masked = g[0] * (1 - s.batch.mask.unsqueeze(2));
    EXPECT_EQ(masked.abs().sum().item<double>(), 0) << "padding";
    const double length = g[0].norm().item<double>();
    const auto at = [&](double step) {
      const torch::NoGradGuard no_grad;
      return loss(s.y + step / length * g[0], s.batch).item<double>();
    };
    const double step = 0.1, numeric = (8 * (at(step) - at(-step)) - (at(2 * step) - at(-2 * step))) / (12 * step);
    EXPECT_NEAR(numeric, length, 0.02 * length) << text(r);
  }
}

TEST(ClassifierLoss, ShortestRows) {
  const Setting s(RotationRepresentation::quaternion);
  const ClassifierLoss loss({files().action}, s.set);
  train::Batch one{s.batch.features.narrow(1, 0, 1), s.batch.mask.narrow(1, 0, 1), s.batch.classes};
  EXPECT_TRUE(std::isfinite(loss(s.y.narrow(1, 0, 1), one).item<double>()));
  train::Batch single = s.batch;
  single.mask = s.batch.mask.clone();
  single.mask.narrow(1, 1, 29).zero_();  // one real frame in a longer window: no change to look at
  EXPECT_NEAR(loss(s.y, single).item<double>(), loss(s.y.narrow(1, 0, 1), one).item<double>(), 1e-5);
}

TEST(ClassifierLoss, Refusals) {
  const Setting s(RotationRepresentation::quaternion);
  const TemporaryFolder folder;
  mocap::testing::write_classifier(folder / "fast.h5", files().real, "action", {"run", "walk"}, 1, 1, 60);
  auto other = std::make_shared<Skeleton>(*canonical_body());
  other->rest_offsets[3].z() += 0.01;
  std::vector<Clip> clips = files().real;
  for (Clip& c : clips) c.skeleton = other;
  mocap::testing::write_classifier(folder / "taller.h5", clips, "action", {"run", "walk"}, 1);
  const auto said = [&](const std::vector<std::string>& paths) { return refusal([&] { ClassifierLoss(paths, s.set); }); };
  EXPECT_NE(said({folder / "fast.h5"}).find("60 Hz, expected the 30 Hz"), std::string::npos);
  EXPECT_NE(said({folder / "taller.h5"}).find("another skeleton"), std::string::npos);
  EXPECT_NE(said({files().action, files().action}).find("second time"), std::string::npos);
  EXPECT_NE(said({files().data}).find("w.h5"), std::string::npos);
  EXPECT_EQ(said({files().action, files().side}), "");
  const ClassifierLoss loss({files().action, files().side}, s.set);
  EXPECT_EQ(loss.to_json()[1], (nlohmann::json{{"attribute", "side"}, {"sha256", to_hex(sha256(slurp(files().side)))}}));
}

}  // namespace
}  // namespace mocap::objective
