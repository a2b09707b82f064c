#include "libmodels/control/terms.hpp"

#include <array>
#include <cmath>
#include <numbers>

#include "libmodels/control/solve.hpp"
#include "tests/control/control_support.hpp"

namespace mocap::control {
namespace {

using torch::Tensor;

constexpr double kPi = std::numbers::pi;

std::shared_ptr<const GroundCurve> bend() { return std::make_shared<GroundCurve>(std::vector<Vector2>{{-1, 0.2}, {0.4, -0.3}, {1.5, 1.1}}); }

Measured measured(std::int64_t frames) {
  return {normal({frames, 3}, 71), normal({frames}, 72), normal({frames, 65}, 73, 0.3), (normal({frames, 69}, 74) > -0.5).to(torch::kDouble)};
}

// All of them, with sigmas that make values of the order of 1 to 1000.
Terms all_terms(std::int64_t frames) {
  return {prior(),
          noise_prior(0.05),
          curve_term(bend(), 0, 9, 0.3),
          facing_term(bend(), 0, 9, 0.5),
          contact_term(0.1, 0.2, 0.03),
          speed_term(1.1, 0.4),
          direction_term(0.7, 0.6),
          turn_rate_term(0.3, 0.5, 0.4),
          step_length_term(torch::tensor({1.0, 0.0}), 0.5, 0.2),
          observation_term(measured(frames), 0.2, 0.3)};
}

struct Models {
  lstm_gmm::Model generator = tiny_generator();
  refiner::Model refiner = tiny_refiner();
  int hand = generator.reference.skeleton->find_role("left_hand");
  MotionModel plain{generator, nullptr, hand, torch::kDouble}, refined{generator, &refiner, hand, torch::kDouble};
  const MotionModel& operator()(bool refines) const { return refines ? refined : plain; }
  // Behind a frame of the data, anywhere.
  Carried before(bool refines) const { return placed((*this)(refines).start(generator.starts[1]), 0.3, -0.2, 0.9); }
};
const Models& models() {
  static const Models m;
  return m;
}

// By autograd against central differences, over a sample of entries: |difference| <= 1e-6 of the largest. What a term does not see has no gradient.
void expect_gradient(const Term& term, bool refines, std::int64_t candidates) {
  const std::int64_t frames = 6;
  const Carried before = models().before(refines);
  Motion m = random_motion(frames, candidates, 21);
  const Tensor weights = torch::linspace(1, 2, candidates, torch::kDouble);
  const auto value = [&] { return (weights * term(models()(refines)(before, m))).sum(); };
  m.states.set_requires_grad(true);
  m.noise.set_requires_grad(true);
  const auto gradients = torch::autograd::grad({value()}, {m.states, m.noise}, {}, torch::nullopt, false, true);
  const torch::NoGradGuard no_grad;
  std::int64_t seen = 0;
  for (const auto& [tensor, gradient] : {std::pair<Tensor, Tensor>{m.states, gradients[0]}, {m.noise, gradients[1]}}) {
    const Tensor flat = tensor.view({-1});
    std::vector<std::pair<double, double>> pairs;
    double largest = 0;
    const auto check = [&](std::int64_t e) {
      double* at = flat.data_ptr<double>() + e;
      const double x = *at, h = 1e-5;
      *at = x + h;
      const double up = value().item<double>();
      *at = x - h;
      const double down = value().item<double>();
      *at = x;
      pairs.emplace_back(gradient.defined() ? gradient.reshape({-1})[e].item<double>() : 0, (up - down) / (2 * h));
      largest = std::max(largest, std::abs(pairs.back().second));
    };
    for (std::int64_t e = 0; e < flat.numel(); e += 53) check(e);
    for (std::int64_t t = 0; t < frames; ++t)
      for (const int column : {0, 1, 2, 3, 4, 20}) check((t * candidates + candidates - 1) * 69 + column);
    for (const auto& [analytic, numeric] : pairs) EXPECT_NEAR(analytic, numeric, 1e-6 * largest + 1e-9) << term.name() << " refined " << refines << " of " << candidates;
    seen += largest > 1e-3;
  }
  EXPECT_GE(seen, 1) << term.name();  // something was compared
}

TEST(Terms, GradientsAreThoseOfFiniteDifferences) {
  for (const auto& term : all_terms(6))
    for (const bool refines : {false, true})
      for (const std::int64_t candidates : {1, 3}) expect_gradient(*term, refines, candidates);
}

TEST(Terms, CandidatesDoNotSeeOneAnother) {
  const torch::NoGradGuard no_grad;
  for (const bool refines : {false, true}) {
    const Motion m = random_motion(5, 3, 31);
    const Carried before = models().before(refines);
    const Seen together = models()(refines)(before, m);
    for (const auto& term : all_terms(5)) {
      const Tensor all = (*term)(together);
      ASSERT_EQ(all.sizes(), at::IntArrayRef({3})) << term->name();
      for (std::int64_t b = 0; b < 3; ++b) EXPECT_NEAR((*term)(models()(refines)(before, m.candidate(b))).item<double>(), all[b].item<double>(), 1e-11 * std::max(1.0, std::abs(all[b].item<double>()))) << term->name() << " " << b;
    }
  }
}

// What is seen, as a clip in double: the frame before, then those of the motion.
struct Decoded {
  Clip clip;
  std::vector<Pose> poses;
  std::vector<double> heading;
  std::vector<std::array<bool, 2>> down;  // of the motion's frames
  int left, right, hand;

  Decoded(const Carried& before, const Seen& seen) {
    const auto& reference = data().set->reference();
    const std::int64_t frames = seen.features.size(0);
    features::FeatureMatrix x(frames + 1, 69);
    for (std::int64_t c = 0; c < 69; ++c) {
      x(0, c) = before.shown[c].item<double>() * static_cast<double>(reference.deviation[static_cast<std::size_t>(c)]) + static_cast<double>(reference.mean[static_cast<std::size_t>(c)]);
      for (std::int64_t t = 0; t < frames; ++t) x(t + 1, c) = seen.features[t][0][c].item<double>();
    }
    clip = features::decode_state(x, reference.skeleton, reference.frame_rate_hz, {before.heading, {before.x, before.y}});
    for (std::size_t t = 0; t < clip.frames(); ++t) {
      poses.emplace_back();
      world_pose(clip, t, poses.back());
      heading.push_back(yaw_of(clip.frame(t)[0]));
    }
    for (std::int64_t t = 0; t < frames; ++t) down.push_back({seen.rows[t][0][69].item<double>() >= 0.5, seen.rows[t][0][70].item<double>() >= 0.5});
    left = reference.skeleton->find_role("left_foot");
    right = reference.skeleton->find_role("right_foot");
    hand = reference.skeleton->find_role("left_hand");
  }
  std::size_t frames() const { return clip.frames() - 1; }
  Vector3 at(int joint, std::size_t t) const { return poses[t].positions[static_cast<std::size_t>(joint)]; }
  double step(std::size_t t) const { return (clip.root_position[t] - clip.root_position[t - 1]).head<2>().norm(); }
};

// The nearest of many points of the curve; its direction there.
struct Near {
  double distance = 1e9;
  Vector2 tangent;
};
Near nearest(const GroundCurve& curve, const Vector2& p, double from, double to) {
  Near best;
  for (int i = 0; i <= 40000; ++i) {
    const double s = std::min(curve.length(), std::max(0.0, from + (to - from) * i / 40000));
    if (const double d = (curve.point_at(s) - p).norm(); d < best.distance) best = {d, curve.tangent_at(s)};
  }
  return best;
}

struct Case {
  Carried before;
  Seen seen;
  Decoded clip;
  double value(const std::shared_ptr<const Term>& term) const { return (*term)(seen).item<double>(); }
};
Case make_case(bool refines, std::uint64_t stream = 41) {
  const torch::NoGradGuard no_grad;
  const Carried before = models().before(refines);
  const Seen seen = models()(refines)(before, random_motion(8, 1, stream));
  return {before, seen, Decoded(before, seen)};
}

TEST(Terms, CurveAndFacingByTheClip) {
  for (const bool refines : {false, true}) {
    const Case c = make_case(refines);
    const auto curve = bend();
    double fit = 0, facing = 0;
    for (std::size_t t = 1; t <= c.clip.frames(); ++t) {
      const Near near = nearest(*curve, c.clip.at(c.clip.hand, t).head<2>(), 0.2, 2.5);
      fit += near.distance * near.distance / (0.1 * 0.1);
      facing += 2 * (1 - std::cos(c.clip.heading[t] - std::atan2(near.tangent.y(), near.tangent.x()))) / (0.5 * 0.5);
    }
    EXPECT_NEAR(c.value(curve_term(curve, 0.2, 2.5, 0.1)), fit, 1e-5 * fit);
    EXPECT_NEAR(c.value(facing_term(curve, 0.2, 2.5, 0.5)), facing, 1e-8 * facing);
  }
}

TEST(Terms, WithoutAJointTheRootFollows) {
  const torch::NoGradGuard no_grad;
  const MotionModel model(models().generator, nullptr, -1, torch::kDouble);
  const Carried before = placed(model.start(models().generator.starts[1]), 0.3, -0.2, 0.9);
  const Seen seen = model(before, random_motion(8, 1, 41));
  const Decoded clip(before, seen);
  double fit = 0;
  for (std::size_t t = 1; t <= clip.frames(); ++t) fit += std::pow(nearest(*bend(), clip.clip.root_position[t].head<2>(), 0, 3).distance, 2);
  EXPECT_NEAR((*curve_term(bend(), 0, 3, 1))(seen).item<double>(), fit, 1e-5 * fit);
}

TEST(Terms, ContactAndStepLengthByForwardKinematics) {
  int touched = 0;
  for (const bool refines : {false, true})
    for (const std::uint64_t stream : {41, 44, 47}) {
      const Case c = make_case(refines, stream);
      double contact = 0, apart = 0;
      int downs = 0;
      std::array<bool, 2> before = {true, false};
      for (std::size_t t = 1; t <= c.clip.frames(); ++t) {
        for (const int foot : {0, 1}) {
          const auto side = static_cast<std::size_t>(foot);
          if (!c.clip.down[t - 1][side]) continue;
          const int joint = foot == 0 ? c.clip.left : c.clip.right;
          contact += (c.clip.at(joint, t) - c.clip.at(joint, t - 1)).squaredNorm() / (0.005 * 0.005) + std::pow(c.clip.at(joint, t).z() - 0.04, 2) / (0.01 * 0.01);
          if (before[side]) continue;
          ++downs;
          apart += std::pow((c.clip.at(c.clip.left, t) - c.clip.at(c.clip.right, t)).head<2>().norm() - 0.6, 2) / (0.05 * 0.05);
        }
        before = c.clip.down[t - 1];
      }
      EXPECT_NEAR(c.value(contact_term(0.005, 0.01, 0.04)), contact, 1e-8 * contact + 1e-12);
      EXPECT_NEAR(c.value(step_length_term(torch::tensor({1.0f, 0.0f}), 0.6, 0.05)), downs ? apart / downs : 0, 1e-6 * std::max(1.0, apart));
      touched += downs;
    }
  EXPECT_GT(touched, 5);
}

TEST(Terms, SpeedTurnsAndNoiseByTheClip) {
  for (const bool refines : {false, true}) {
    const Case c = make_case(refines);
    double way = 0, turned = 0;
    const std::size_t n = c.clip.frames();
    for (std::size_t t = 1; t <= n; ++t) {
      way += c.clip.step(t);
      turned += std::remainder(c.clip.heading[t] - c.clip.heading[t - 1], 2 * kPi);
    }
    const double seconds = static_cast<double>(n) / 30;
    EXPECT_NEAR(c.value(speed_term(0.8, 0.3)), std::pow((way / seconds - 0.8) / 0.3, 2), 1e-6);
    EXPECT_NEAR(c.value(turn_rate_term(c.before.heading, 0.4, 0.2)), std::pow((turned / seconds - 0.4) / 0.2, 2), 1e-8);
    EXPECT_NEAR(c.value(noise_prior(0.05)), c.seen.noise.square().sum().item<double>() / (2 * 0.05 * 0.05), 1e-9);
  }
}

TEST(Terms, DirectionsAreWrapped) {
  const torch::NoGradGuard no_grad;
  for (const double heading : {kPi - 0.01, -kPi + 0.01, 0.0, 7 * kPi}) {
    const Carried before = placed(models().before(false), 0, 0, heading);
    const Seen seen = models().plain(before, random_motion(8, 1, 41));
    const double last = Decoded(before, seen).heading.back();
    for (const double wanted : {kPi - 0.02, -kPi + 0.02, 1.0, -3.0}) {
      const double off = std::remainder(last - wanted, 2 * kPi);
      EXPECT_NEAR((*direction_term(wanted, 0.5))(seen).item<double>(), off * off / 0.25, 1e-8) << heading << " " << wanted;
    }
  }
}

// The angles of a clip by the encoder, whose columns from 4 on are what is measured.
TEST(Terms, ObservationByTheClip) {
  const Case c = make_case(true);
  const std::int64_t n = 8;
  const features::FeatureMatrix x = features::encode_state(c.clip.clip);
  Measured m = measured(n);
  double value = 0;
  for (std::int64_t t = 0; t < n; ++t) {
    const auto frame = static_cast<std::size_t>(t) + 1;
    for (int k = 0; k < 3; ++k) value += m.trust[t][k].item<double>() * std::pow(c.clip.clip.root_position[frame][k] - m.root[t][k].item<double>(), 2) / (2 * 0.2 * 0.2);
    value += m.trust[t][3].item<double>() * std::pow(c.seen.heading[t][0].item<double>() - m.heading[t].item<double>(), 2) / (2 * 0.3 * 0.3);
    EXPECT_NEAR(std::remainder(c.seen.heading[t][0].item<double>() - c.clip.heading[frame], 2 * kPi), 0, 1e-9);
    for (int k = 0; k < 65; ++k) value += m.trust[t][4 + k].item<double>() * std::pow(x(t + 1, 4 + k) - m.angles[t][k].item<double>(), 2) / (2 * 0.3 * 0.3);
  }
  EXPECT_NEAR(c.value(observation_term(m, 0.2, 0.3)), value, 1e-8 * value);
  // Of itself it is 0, whatever is trusted; what is not trusted does not count.
  m.root = torch::cat({c.seen.root.select(1, 0), c.seen.features.select(1, 0).narrow(1, 3, 1)}, 1);
  m.heading = c.seen.heading.select(1, 0);
  m.angles = c.seen.features.select(1, 0).narrow(1, 4, 65);
  EXPECT_EQ(c.value(observation_term(m, 1e-3, 1e-3)), 0);
  m.trust = torch::ones({n, 69}, torch::kDouble);
  EXPECT_EQ(c.value(observation_term(m, 1e-3, 1e-3)), 0);
  m.angles = m.angles.clone();
  m.angles[2][7] += 0.5;
  EXPECT_NEAR(c.value(observation_term(m, 1e-3, 1)), 0.125, 1e-12);
  m.trust[2][11] = 0;
  EXPECT_EQ(c.value(observation_term(m, 1e-3, 1)), 0);
}

// Of a curve that crosses itself the part that is due is followed: going through the crossing along the first pass is right in its time and wrong when the second is due.
TEST(Terms, AFigureEightIsFollowedInOrder) {
  std::vector<Vector2> points;
  for (int i = 0; i <= 400; ++i) points.emplace_back(2 * std::sin(2 * kPi * i / 400), 2 * std::sin(2 * kPi * i / 400) * std::cos(2 * kPi * i / 400));
  const auto eight = std::make_shared<GroundCurve>(points);
  const double middle = eight->length() / 2;
  Seen seen;
  seen.point = torch::zeros({1, 1, 2}, torch::kDouble);
  const Vector2 tangent = eight->tangent_at(0);
  seen.heading = torch::full({1, 1}, std::atan2(tangent.y(), tangent.x()), torch::kDouble);
  seen.point[0][0][0] = 0.01 * tangent.x();
  seen.point[0][0][1] = 0.01 * tangent.y();
  const auto value = [&](const auto& make, double from, double to) { return (*make(eight, from, to, 1.0))(seen).template item<double>(); };
  EXPECT_LT(value(curve_term, 0, 1), 1e-7);
  EXPECT_LT(value(facing_term, 0, 1), 1e-3);
  EXPECT_GT(value(curve_term, middle - 0.5, middle + 0.5), 5e-5);  // the other branch is a right angle away
  EXPECT_GT(value(facing_term, middle - 0.5, middle + 0.5), 1);
}

TEST(Terms, NamesAreTheReports) {
  const torch::NoGradGuard no_grad;
  std::string names;
  double sum = 0;
  const Motion m = random_motion(6, 1, 21);
  for (const auto& [name, value] : by_term(models().plain, models().before(false), m, all_terms(6))) {
    names += name + " ";
    sum += value;
  }
  EXPECT_EQ(names, "prior noise curve facing contact speed direction turn_rate step_length observation ");
  EXPECT_NEAR(objective(models().plain, models().before(false), m, all_terms(6)).item<double>(), sum, 1e-9 * std::abs(sum));
}

}  // namespace
}  // namespace mocap::control
