#include "libmocap/clip/rate_check.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "libmocap/skeleton/canonical_body.hpp"

namespace mocap {
namespace {

constexpr double kGravity = 9.81;
constexpr double kLifted = 0.03, kClear = 0.05;  // metres of the lower sole in flight, and at its highest
constexpr double kFeetPassed = 0.15;             // metres the ankles part between two steps
constexpr double kShortestStep = 0.25;           // metres; below it people turn and shuffle
constexpr double kUneven = 1.35;                 // of the times of two steps that follow each other

// Parts of the body, their shares of its mass and where along them their centres lie (de Leva 1996, mean of women and men).
struct BodyPart {
  const char *from, *to;
  double share, along;
};
constexpr std::array<BodyPart, 10> kParts = {{{"", "neck", 0.43, 0.45},
                                              {"head", "head", 0.07, 0},
                                              {"left_shoulder", "left_elbow", 0.026, 0.55},
                                              {"right_shoulder", "right_elbow", 0.026, 0.55},
                                              {"left_elbow", "left_hand", 0.022, 0.6},
                                              {"right_elbow", "right_hand", 0.022, 0.6},
                                              {"left_hip", "left_knee", 0.145, 0.39},
                                              {"right_hip", "right_knee", 0.145, 0.39},
                                              {"left_knee", "left_ankle", 0.0575, 0.55},
                                              {"right_knee", "right_ankle", 0.0575, 0.55}}};

struct Tracks {  // [T] each
  std::vector<Vector3> centre, root;
  std::array<std::vector<Vector3>, 2> foot;
  std::vector<double> lower, higher;  // sole of either foot above the ground
  std::vector<double> ahead;          // left ankle before the right one, along the facing
};

std::optional<Tracks> tracks_of(const Clip& clip) {
  const Skeleton& s = *clip.skeleton;
  std::array<std::array<int, 2>, kParts.size()> ends{};
  for (std::size_t i = 0; i < kParts.size(); ++i) {
    ends[i] = {*kParts[i].from ? s.find_role(kParts[i].from) : 0, s.find_role(kParts[i].to)};
    if (ends[i][0] < 0 || ends[i][1] < 0) return std::nullopt;
  }
  const std::array<int, 2> ankle = {s.find_role("left_ankle"), s.find_role("right_ankle")}, toe = {s.find_role("left_foot"), s.find_role("right_foot")};
  const std::array<int, 2> hip = {s.find_role("left_hip"), s.find_role("right_hip")};
  Tracks out;
  Pose pose;
  Vector3 facing = Vector3::UnitX();
  const auto at = [&](int j) -> const Vector3& { return pose.positions[static_cast<std::size_t>(j)]; };
  for (std::size_t t = 0; t < clip.frames(); ++t) {
    world_pose(clip, t, pose);
    Vector3 sum = Vector3::Zero();
    double mass = 0;
    for (std::size_t i = 0; i < kParts.size(); ++i) {
      sum += kParts[i].share * ((1 - kParts[i].along) * at(ends[i][0]) + kParts[i].along * at(ends[i][1]));
      mass += kParts[i].share;
    }
    out.centre.emplace_back(sum / mass);
    out.root.push_back(at(0));
    std::array<double, 2> sole{};
    for (std::size_t k = 0; k < 2; ++k) {
      sole[k] = at(ankle[k]).z() - kAnkleSoleHeight;
      if (toe[k] >= 0) sole[k] = std::min(sole[k], at(toe[k]).z() - kFootSoleHeight);
      out.foot[k].push_back(toe[k] >= 0 ? Vector3((at(ankle[k]) + at(toe[k])) / 2) : at(ankle[k]));
    }
    out.lower.push_back(std::min(sole[0], sole[1]));
    out.higher.push_back(std::max(sole[0], sole[1]));
    const Vector3 across = at(hip[0]) - at(hip[1]);
    if (std::hypot(across.x(), across.y()) > 0.05) facing = Vector3(across.y(), -across.x(), 0).normalized();
    out.ahead.push_back((at(ankle[0]) - at(ankle[1])).dot(facing));
  }
  return out;
}

double median(std::vector<double> v) {
  const auto middle = v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2);
  std::nth_element(v.begin(), middle, v.end());
  return *middle;
}

RateEvidence::Flight fit_fall(const Tracks& k, std::size_t first, std::size_t last, double rate_hz) {
  Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
  Vector3 b = Vector3::Zero();
  const double middle = static_cast<double>(first + last) / 2;
  const auto row = [&](std::size_t t) {
    const double x = (static_cast<double>(t) - middle) / rate_hz;
    return Vector3(1, x, x * x);
  };
  double top = k.centre[first].z();
  for (std::size_t t = first; t <= last; ++t) {
    a += row(t) * row(t).transpose();
    b += row(t) * k.centre[t].z();
    top = std::max(top, k.centre[t].z());
  }
  const Vector3 c = a.ldlt().solve(b);
  double square = 0;
  for (std::size_t t = first; t <= last; ++t) square += std::pow(k.centre[t].z() - c.dot(row(t)), 2);
  return {-2 * c[2], static_cast<double>(last - first) / rate_hz, top - std::max(k.centre[first].z(), k.centre[last].z()),
          std::sqrt(square / static_cast<double>(last - first + 1))};
}

// A foot that stands on something while the other swings is up, and goes nowhere.
bool feet_fly_along(const Tracks& k, std::size_t first, std::size_t last) {
  std::vector<double> share;
  for (std::size_t t = first; t < last; ++t) {
    const double body = (k.centre[t + 1] - k.centre[t]).norm() + 1e-4;
    for (const auto& f : k.foot) share.push_back((f[t + 1] - f[t]).norm() / body);
  }
  const auto fifth = share.begin() + static_cast<std::ptrdiff_t>(share.size() / 5);
  std::nth_element(share.begin(), fifth, share.end());
  return *fifth > 0.4;
}

std::vector<RateEvidence::Flight> flights_of(const Tracks& k, double rate_hz) {
  std::vector<RateEvidence::Flight> out;
  const std::size_t n = k.lower.size();
  for (std::size_t t = 1; t < n; ++t) {
    if (k.lower[t] < kLifted || k.lower[t - 1] >= kLifted) continue;
    std::size_t end = t;
    double highest = 0;
    for (; end < n && k.lower[end] >= kLifted; ++end) highest = std::max(highest, k.lower[end]);
    if (end == n || end - t < 4 || highest < kClear || !feet_fly_along(k, t, end - 1)) continue;
    const auto f = fit_fall(k, t, end - 1, rate_hz);
    // 2.6 s: a high jump at a quarter of its rate. Longer ones climb, hang and sit.
    if (f.seconds < 2.6 && f.rise_m > 0.015 && f.residual_m < 0.06 * f.rise_m + 0.001) out.push_back(f);
  }
  return out;
}

double third_drop(const Tracks& k, double rate_hz) {
  const auto lag = static_cast<std::size_t>(std::max(1L, std::lround(rate_hz / 30)));
  const double h = static_cast<double>(lag) / rate_hz;
  std::vector<std::pair<double, std::size_t>> drops;
  for (std::size_t t = lag; t + lag < k.centre.size(); ++t)
    drops.emplace_back(-(k.centre[t + lag].z() - 2 * k.centre[t].z() + k.centre[t - lag].z()) / (h * h), t);
  std::sort(drops.rbegin(), drops.rend());
  std::vector<std::size_t> taken;
  for (const auto& [drop, t] : drops) {
    if (std::any_of(taken.begin(), taken.end(), [&, at = t](std::size_t u) { return (at > u ? at - u : u - at) < 4 * lag; })) continue;
    taken.push_back(t);
    if (taken.size() == 3) return std::max(drop, 0.0);
  }
  return 0;
}

struct Step {
  double seconds, metres;
  std::size_t first, last;  // frames in which the feet pass each other
};

// The longest run of steps like each other. A step goes from one passing of the feet to the next.
std::vector<Step> regular_steps(const Tracks& k, double rate_hz) {
  struct Passing {
    double at;
    std::size_t frame;
  };
  std::vector<Passing> passings;
  double parted = std::numeric_limits<double>::infinity();
  for (std::size_t t = 1; t < k.ahead.size(); ++t) {
    const double a = k.ahead[t - 1], b = k.ahead[t];
    parted = std::max(parted, std::abs(a));
    if ((a < 0) == (b < 0) || parted < kFeetPassed) continue;
    passings.push_back({static_cast<double>(t - 1) + a / (a - b), t});
    parted = 0;
  }
  std::vector<Step> run, best;
  for (std::size_t i = 1; i < passings.size(); ++i) {
    const Vector3 way = k.root[passings[i].frame] - k.root[passings[i - 1].frame];
    const Step s{(passings[i].at - passings[i - 1].at) / rate_hz, std::hypot(way.x(), way.y()), passings[i - 1].frame, passings[i].frame};
    const bool like = run.empty() || (s.seconds < kUneven * run.back().seconds && run.back().seconds < kUneven * s.seconds);
    if (s.metres <= kShortestStep || !like) run.clear();
    if (s.metres > kShortestStep) run.push_back(s);
    if (run.size() > best.size()) best = run;
  }
  return best;
}

// Slope and correlation of kinetic over potential energy per mass between two frames.
void measure_exchange(const Tracks& k, std::size_t first, std::size_t last, double rate_hz, RateEvidence& e) {
  const std::size_t side = static_cast<std::size_t>(std::max(2L, std::lround(rate_hz / e.cadence_hz)));
  first = std::max<std::size_t>(first, 1);
  last = std::min(last, k.centre.size() - 2);
  if (last < first || last - first < 2 * side) return;
  const std::size_t n = last - first + 1;
  std::vector<double> potential{0}, kinetic{0};  // running sums
  const auto energies = [&](std::size_t i) {
    const std::size_t t = first + i;
    return std::pair(kGravity * k.centre[t].z(), 0.5 * ((k.centre[t + 1] - k.centre[t - 1]) * rate_hz / 2).squaredNorm());
  };
  for (std::size_t i = 0; i < n; ++i) {
    potential.push_back(potential.back() + energies(i).first);
    kinetic.push_back(kinetic.back() + energies(i).second);
  }
  double xx = 0, xy = 0, yy = 0;
  for (std::size_t i = side; i + side < n; ++i) {
    const auto mean = [&](const std::vector<double>& sum) { return (sum[i + side + 1] - sum[i - side]) / static_cast<double>(2 * side + 1); };
    const double x = energies(i).first - mean(potential), y = energies(i).second - mean(kinetic);
    xx += x * x;
    xy += x * y;
    yy += y * y;
  }
  if (!(xx > 0 && yy > 0)) return;
  e.exchange = xy / xx;
  e.correlation = xy / std::sqrt(xx * yy);
}

// The downward acceleration of the flights where they agree on one.
std::optional<double> agreed_fall(const std::vector<RateEvidence::Flight>& flights) {
  if (flights.empty()) return std::nullopt;
  std::vector<double> falls;
  for (const auto& f : flights) falls.push_back(f.gravity_mps2);
  const double middle = median(falls);
  if (middle < 0.3) return std::nullopt;  // a fifth of the rate and less: rather no fall
  const auto agree = static_cast<std::size_t>(std::count_if(falls.begin(), falls.end(), [&](double a) { return std::abs(a - middle) < 0.25 * middle; }));
  const bool alone = flights.size() == 1 && flights[0].rise_m > 0.05;
  return alone || (agree >= 2 && 2 * agree > falls.size()) ? std::optional(middle) : std::nullopt;
}

}  // namespace

RateEvidence rate_evidence(const Clip& clip) {
  RateEvidence e;
  const auto tracks = clip.frames() < 8 ? std::nullopt : tracks_of(clip);
  if (!tracks) return e;
  const double rate = clip.frame_rate_hz;
  e.flights = flights_of(*tracks, rate);
  e.drop_mps2 = third_drop(*tracks, rate);
  const auto steps = regular_steps(*tracks, rate);
  e.steps = steps.size();
  if (steps.empty()) return e;
  std::vector<double> seconds, metres;
  for (const Step& s : steps) {
    seconds.push_back(s.seconds);
    metres.push_back(s.metres);
  }
  e.cadence_hz = 1 / median(seconds);
  e.step_m = median(metres);
  const std::size_t first = steps.front().first, last = steps.back().last;
  std::size_t down = 0;
  for (std::size_t t = first; t <= last; ++t) down += tracks->higher[t] < 0.05;
  e.grounded = static_cast<double>(down) / static_cast<double>(last - first + 1);
  measure_exchange(*tracks, first, last, rate, e);
  return e;
}

std::optional<std::string> check_rate(const Clip& clip) {
  const RateEvidence e = rate_evidence(clip);
  if (const auto fall = agreed_fall(e.flights); fall && (*fall < 5 || *fall > 20)) {
    const double said = clip.source.frame_rate_hz > 0 ? clip.source.frame_rate_hz : clip.frame_rate_hz;
    return fmt::format("it falls at {:.2g} m/s^2, expected {}: as if recorded at about {:.0f} Hz", *fall, kGravity, said * std::sqrt(kGravity / *fall));
  }
  if (e.drop_mps2 > 28) return fmt::format("the body goes down at {:.2g} m/s^2, expected little more than gravity's {}", e.drop_mps2, kGravity);
  if (e.steps < 3) return std::nullopt;
  if (e.cadence_hz < 0.7 || e.cadence_hz > 4.7) return fmt::format("steps at {:.2g} a second, expected 0.7 to 4.7", e.cadence_hz);
  const bool walks = e.grounded > 0.3;
  if (const double most = walks ? 0.8 : 0.95; e.step_m > most * e.cadence_hz)
    return fmt::format("steps of {:.2g} m at {:.2g} a second, expected {:.2g} or more for that length", e.step_m, e.cadence_hz, e.step_m / most);
  if (e.cadence_hz > 3.3 && e.step_m > 0.4 && walks) return fmt::format("a walk of {:.2g} steps a second, expected at most 3.3", e.cadence_hz);
  if (e.steps >= 4 && e.correlation < -0.6 && (e.exchange < -2.8 || e.exchange > -0.3))
    return fmt::format("a walk whose speed changes by {:.2g} times what its rise and fall account for, expected about 1", -e.exchange);
  return std::nullopt;
}

}  // namespace mocap
