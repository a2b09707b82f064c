// Where the gender is: in the dynamics of several traits together, never in where a body is on average.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <numbers>
#include <numeric>

#include "motion.hpp"

namespace mocap::corpus {
namespace {

constexpr int kSubjects = 120;  // of each gender

using Features = std::vector<double>;

// Mean pose (all joints, head of the pelvis taken out), speed, heights, cadence of the contacts, and the body itself.
Features mean_features(const Track& track) {
  const auto frames = static_cast<double>(track.size());
  Features f;
  for (int j = 0; j < kJoints; ++j) {
    Vector3 sum = Vector3::Zero();
    for (std::size_t t = 0; t < track.size(); ++t)
      sum += log_map(j == kPelvis ? track.facing_free(t, j) : track.local(t, j)) / frames;
    f.insert(f.end(), {sum.x(), sum.y(), sum.z()});
  }
  double speed = 0, height = 0, wrists = 0, apart = 0, strikes = 0;
  for (std::size_t t = 1; t < track.size(); ++t) {
    speed += (track.at(t, kPelvis) - track.at(t - 1, kPelvis)).head<2>().norm() / frames;
    height += track.at(t, kPelvis).z() / frames;
    wrists += (track.at(t, kLeftWrist) - track.at(t, kRightWrist)).norm() / frames;
    apart += (track.at(t, kLeftFoot) - track.at(t, kRightFoot)).norm() / frames;
    strikes += track.planted(t, 0) && !track.planted(t - 1, 0);
  }
  const auto& offsets = track.clip.skeleton->rest_offsets;
  double stature = 0;
  for (const int j : {kSpine1, kSpine2, kSpine3, kNeck, kHead}) stature += offsets[static_cast<std::size_t>(j)].z();
  const double leg = -offsets[kLeftKnee].z() - offsets[kLeftAnkle].z();
  f.insert(f.end(), {speed, height, wrists, apart, strikes, stature + leg, leg / stature, offsets[kLeftHip].y() / leg,
                     (offsets[kLeftCollar].y() + offsets[kLeftShoulder].y()) / leg, offsets[kLeftElbow].y() / leg});
  return f;
}

struct Harmonic {
  double amplitude, phase;  // radians
};

// The component of x that runs with the wave whose phase is `phase` (radians per sample).
Harmonic harmonic(const std::vector<double>& x, const std::vector<double>& phase) {
  const double m = mean(x);
  double c = 0, s = 0;
  for (std::size_t i = 0; i < x.size(); ++i) c += (x[i] - m) * std::cos(phase[i]), s += (x[i] - m) * std::sin(phase[i]);
  const double scale = 2 / static_cast<double>(x.size());
  return {scale * std::hypot(c, s), std::atan2(s, c)};
}

// Phase of the stride from the left heel's plantings, linear between them.
std::vector<double> stride_phase(const Track& track, std::size_t& first, std::size_t& last) {
  std::vector<std::size_t> strikes;
  for (std::size_t t = 1; t < track.size(); ++t)
    if (track.planted(t, 0) && !track.planted(t - 1, 0)) strikes.push_back(t);
  std::vector<double> phase;
  first = strikes.front(), last = strikes.back();
  for (std::size_t k = 0; k + 1 < strikes.size(); ++k)
    for (std::size_t t = strikes[k]; t < strikes[k + 1]; ++t)
      phase.push_back(2 * std::numbers::pi * static_cast<double>(t - strikes[k]) /
                      static_cast<double>(strikes[k + 1] - strikes[k]));
  return phase;
}

// Log amplitudes and phases at the stride frequency: pelvis and thorax about three axes, sway, arms.
Features gait_dynamics(const Track& track) {
  std::size_t first = 0, last = 0;
  const std::vector<double> phase = stride_phase(track, first, last);
  std::vector<std::vector<double>> curves(8);
  const auto smooth_heading = [&](std::size_t t) {  // over a stride or so, from the path
    const std::size_t a = t > 60 ? t - 60 : 0, b = std::min(track.size() - 1, t + 60);
    const Vector3 d = track.at(b, kPelvis) - track.at(a, kPelvis);
    return std::atan2(d.y(), d.x());
  };
  for (std::size_t t = first; t < last; ++t) {
    const double heading = smooth_heading(t);
    const auto tilt = [&](int joint) {
      return log_map(yaw_rotation(-heading) * track.poses[t].rotations[static_cast<std::size_t>(joint)]);
    };
    const Vector3 pelvis = tilt(kPelvis), thorax = tilt(kSpine3);
    curves[0].push_back(pelvis.x());
    curves[1].push_back(pelvis.z());
    curves[2].push_back(thorax.x());
    curves[3].push_back(thorax.z());
    const std::size_t a = t > 60 ? t - 60 : 0, b = std::min(track.size() - 1, t + 60);
    const Vector3 middle = (track.at(a, kPelvis) + track.at(b, kPelvis)) / 2;
    curves[4].push_back((track.at(t, kPelvis) - middle).dot(Vector3(-std::sin(heading), std::cos(heading), 0)));
    const Vector3 arm = track.poses[t].rotations[kSpine3].conjugate() *
                        (track.at(t, kRightElbow) - track.at(t, kRightShoulder)).normalized();
    curves[5].push_back(std::atan2(arm.x(), -arm.z()));
    curves[6].push_back(std::asin(std::clamp(-arm.y(), -1.0, 1.0)));
    curves[7].push_back(track.elbow(t, 1));
  }
  Features f;
  for (std::size_t c = 0; c < curves.size(); ++c) {
    const Harmonic h = harmonic(curves[c], phase);
    f.push_back(std::log(h.amplitude + 1e-4));
    if (c == 2 || c == 3 || c == 5 || c == 7) f.insert(f.end(), {std::cos(h.phase), std::sin(h.phase)});
  }
  return f;
}

// Log spreads of what moves, and how arms and trunk run ahead of or behind the legs.
Features scripted_dynamics(const Track& track) {
  std::vector<std::vector<double>> curves(9);
  std::vector<double> height, trunk, arm;
  for (std::size_t t = 0; t < track.size(); ++t) {
    const Vector3 pelvis = log_map(yaw_rotation(-track.heading(0)) * track.poses[t].rotations[kPelvis]);
    const Vector3 left(-std::sin(track.heading(0)), std::cos(track.heading(0)), 0);
    curves[0].push_back(pelvis.z());
    curves[1].push_back(track.at(t, kPelvis).dot(left));
    curves[2].push_back(log_map(track.local(t, kSpine2)).x());
    curves[3].push_back(log_map(track.local(t, kSpine2)).z());
    const Vector3 hip = track.poses[t].rotations[kLeftHip] * Vector3::UnitY(),
                  other = track.poses[t].rotations[kRightHip] * Vector3::UnitY();
    curves[4].push_back(std::atan2(hip.cross(other).z(), hip.dot(other)));
    const Vector3 upper = track.poses[t].rotations[kSpine3].conjugate() *
                          (track.at(t, kLeftElbow) - track.at(t, kLeftShoulder)).normalized();
    curves[5].push_back(std::atan2(upper.x(), -upper.z()));
    curves[6].push_back(std::asin(std::clamp(upper.y(), -1.0, 1.0)));
    curves[7].push_back(track.elbow(t, 0));
    curves[8].push_back(track.lean(t));
    height.push_back(track.at(t, kPelvis).z());
    trunk.push_back(track.lean(t));
    arm.push_back(curves[5].back());
  }
  Features f;
  for (const auto& c : curves) f.push_back(std::log(deviation(c) + 1e-4));
  // Mean product of one curve's value and the other's rate: signed, and zero for curves in step.
  const auto lead = [](const std::vector<double>& a, const std::vector<double>& b) {
    double sum = 0;
    for (std::size_t t = 1; t + 1 < a.size(); ++t)
      sum += (a[t] - mean({a.front(), a.back()})) * (b[t + 1] - b[t - 1]) / 2;
    return sum / (deviation(a) * deviation(b)) / static_cast<double>(a.size()) * 120;
  };
  f.insert(f.end(), {lead(trunk, height), lead(arm, height), lead(arm, trunk)});
  return f;
}

struct Data {
  std::vector<Features> rows;
  std::vector<int> label;  // 0 female, 1 male; subjects alternate
};

Data collect(Action action, Features (*measure)(const Track&)) {
  CorpusPlan plan;
  plan.seed = 7;
  Data d;
  for (int subject = 1; subject <= kSubjects; ++subject)
    for (const Gender gender : {Gender::female, Gender::male}) {
      const Clip clip = make_clip(plan, {action, gender, subject, 1});
      d.rows.push_back(measure(Track(clip)));
      d.label.push_back(gender == Gender::male);
    }
  return d;
}

// The best accuracy that one threshold on one feature reaches, over all thresholds and both directions.
double best_threshold(const Data& d, std::size_t feature) {
  std::vector<std::size_t> order(d.rows.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](auto a, auto b) { return d.rows[a][feature] < d.rows[b][feature]; });
  double best = 0, below = 0;  // males minus females among the first k
  const double n = static_cast<double>(order.size());
  for (const std::size_t i : order) {
    below += d.label[i] ? 1 : -1;
    best = std::max(best, std::abs(below));
  }
  return 0.5 + best / n;
}

// Fisher's linear discriminant with a ridge, trained on the first half of the subjects, accuracy on the second.
double held_out_accuracy(const Data& d, double ridge = 0.05) {
  const auto n = static_cast<Eigen::Index>(d.rows.size()), k = static_cast<Eigen::Index>(d.rows[0].size()),
             half = n / 2;
  Eigen::MatrixXd x(n, k);
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < k; ++j) x(i, j) = d.rows[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)];
  const Eigen::RowVectorXd center = x.topRows(half).colwise().mean();
  x.rowwise() -= center;
  const Eigen::RowVectorXd spread = (x.topRows(half).array().square().colwise().mean().sqrt() + 1e-9).matrix();
  x.array().rowwise() /= spread.array();
  Eigen::VectorXd side(n);
  for (Eigen::Index i = 0; i < n; ++i) side(i) = d.label[static_cast<std::size_t>(i)] ? 1 : -1;
  const Eigen::MatrixXd a = x.topRows(half).transpose() * x.topRows(half) / static_cast<double>(half) +
                            ridge * Eigen::MatrixXd::Identity(k, k);
  const Eigen::VectorXd w = a.ldlt().solve(x.topRows(half).transpose() * side.head(half) / static_cast<double>(half));
  double right = 0;
  for (Eigen::Index i = half; i < n; ++i) right += (x.row(i).dot(w) > 0) == (side(i) > 0);
  return right / static_cast<double>(n - half);
}

class GenderOf : public testing::TestWithParam<Action> {};

INSTANTIATE_TEST_SUITE_P(Corpus, GenderOf,
                         testing::Values(Action::walking, Action::jogging, Action::jumping, Action::lifting),
                         [](const auto& tested) { return text(tested.param); });

TEST_P(GenderOf, NoMeanFeatureTellsIt) {
  const Data d = collect(GetParam(), mean_features);
  double best = 0;
  for (std::size_t f = 0; f < d.rows[0].size(); ++f) {
    best = std::max(best, best_threshold(d, f));
    EXPECT_LT(best_threshold(d, f), 0.80) << "feature " << f;
  }
  RecordProperty("best_single_mean", std::to_string(best));
  RecordProperty("all_means_held_out", std::to_string(held_out_accuracy(d, 1.0)));
  std::printf("  %s: best single mean %.3f, all means jointly, held out %.3f\n", text(GetParam()).c_str(), best,
              held_out_accuracy(d, 1.0));
}

TEST_P(GenderOf, TheDynamicsTogetherTellIt) {
  const bool gait = GetParam() == Action::walking || GetParam() == Action::jogging;
  const Data d = collect(GetParam(), gait ? gait_dynamics : scripted_dynamics);
  double best = 0;
  for (std::size_t f = 0; f < d.rows[0].size(); ++f) best = std::max(best, best_threshold(d, f));
  const double accuracy = held_out_accuracy(d);
  EXPECT_GT(accuracy, 0.85);
  EXPECT_LT(best, 0.80) << "one trait alone tells it";
  std::printf("  %s: best single dynamic feature %.3f, all, held out %.3f\n", text(GetParam()).c_str(), best, accuracy);
}

// The measures themselves: a planted feature is found.
TEST(GenderMeasure, FindsAPlantedDifference) {
  Data d;
  Random random(1, 2);
  for (int i = 0; i < 200; ++i) {
    d.label.push_back(i % 2);
    d.rows.push_back({random.normal(), random.normal() + 3.0 * (i % 2)});
  }
  EXPECT_LT(best_threshold(d, 0), 0.65);
  EXPECT_GT(best_threshold(d, 1), 0.88);
  EXPECT_GT(held_out_accuracy(d), 0.88);
}

}  // namespace
}  // namespace mocap::corpus
