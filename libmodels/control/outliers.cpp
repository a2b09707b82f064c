#include "libmodels/control/outliers.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace mocap::control {

namespace {

using Index = Eigen::Index;

constexpr int kParabola = 3;              // frames on either side
constexpr double kMedianNorm = 1.5382;    // of three standard normal numbers
constexpr double kLeftByParabola = 0.8165;  // deviation of what a parabola over 7 frames leaves of white noise
constexpr int kLongestSpike = 4, kShortestHold = 3;
constexpr double kHeld = 3.5, kExactly = 1e-7, kMoves = 1e-4, kActivity = 4, kSpeedAfter = 1.5, kBesideOthers = 1.5, kAtEnd = 0.7, kSuddenly = 0.7;
constexpr Index kNear = 15, kStride = 45, kApart = 6;
constexpr std::size_t kFewest = 5;
constexpr Index kLongestHold = 64;  // beyond it a joint is at rest

Vector3 at(const Values& v, Index t, int g) { return v.row(t).segment<3>(3 * g).transpose(); }

// Weights of the values at first .. first + count - 1 of the least-squares parabola (a line through 2, the value itself of 1) read at frame t.
Eigen::VectorXd parabola_weights(Index t, Index first, Index count) {
  const Index degree = std::min<Index>(2, count - 1);
  Eigen::MatrixXd basis(count, degree + 1);
  for (Index i = 0; i < count; ++i)
    for (Index k = 0; k <= degree; ++k) basis(i, k) = std::pow(static_cast<double>(first + i - t), static_cast<double>(k));
  return (basis.transpose() * basis).ldlt().solve(basis.transpose()).row(0).transpose();
}

Values smoothed(const Values& v) {
  const Index frames = v.rows(), width = std::min<Index>(2 * kParabola + 1, frames);
  Values out(frames, v.cols());
  const Eigen::VectorXd inside = parabola_weights(width / 2, 0, width);
  for (Index t = 0; t < frames; ++t) {
    const Index first = std::clamp<Index>(t - width / 2, 0, frames - width);
    out.row(t) = (t - first == width / 2 ? inside : parabola_weights(t, first, width)).transpose() * v.middleRows(first, width);
  }
  return out;
}

// The value at frame t as the frames before the run first .. last have it (side < 0), those after it (side > 0), or both.
Vector3 beside(const Values& v, int g, Index first, Index last, Index t, int side) {
  std::vector<Index> known;
  for (Index i = std::max<Index>(0, first - 2); i < first && side <= 0; ++i) known.push_back(i);
  const bool left = !known.empty();
  for (Index i = last + 1; i <= std::min(v.rows() - 1, last + 2) && side >= 0; ++i) known.push_back(i);
  if (!left || known.back() < first) {
    // At an end of the motion a line, since a parabola would blow noise up.
    const Index a = known.front(), b = known.back();
    return a == b ? at(v, a, g) : Vector3(at(v, a, g) + (at(v, b, g) - at(v, a, g)) * (static_cast<double>(t - a) / static_cast<double>(b - a)));
  }
  Vector3 sum = Vector3::Zero();
  for (const Index i : known) {
    double w = 1;
    for (const Index k : known)
      if (k != i) w *= static_cast<double>(t - k) / static_cast<double>(i - k);
    sum += w * at(v, i, g);
  }
  return sum;
}

void bridge(Values& v, int g, Index first, Index last) {
  const bool left = first > 0, right = last + 1 < v.rows();
  if (!left && !right) return;
  const Vector3 a = left ? at(v, first - 1, g) : at(v, last + 1, g), b = right ? at(v, last + 1, g) : a;
  for (Index t = first; t <= last; ++t) v.row(t).segment<3>(3 * g) = (a + (b - a) * (static_cast<double>(t - first + 1) / static_cast<double>(last - first + 2))).transpose();
}

void find_spikes(Values& v, int g, double threshold, Marks& marks) {
  const Index frames = v.rows();
  struct Found {
    double rank, score;
    Index first, last;
  };
  for (int pass = 0; pass < 10; ++pass) {
    std::vector<Found> found;
    for (Index length = 1; length <= kLongestSpike && length + 2 <= frames; ++length) {
      // The least that a frame of the run lies off, by what lies on one side of it or on both.
      const auto score_of = [&](Index a, int side) {
        double least = std::numeric_limits<double>::infinity();
        for (Index t = a; t < a + length; ++t) least = std::min(least, (at(v, t, g) - beside(v, g, a, a + length - 1, t, side)).norm());
        for (Index t = a; side != 0 && t < a + length; ++t) least = std::min(least, (at(v, t, g) - at(v, side > 0 ? a + length : a - 1, g)).norm());
        return least;
      };
      const Index runs = frames - length + 1;
      std::vector<double> scores;
      for (Index a = 0; a < runs; ++a) scores.push_back(score_of(a, 0));
      for (Index a = 0; a < runs; ++a) {
        // At an end of the motion what one side says elsewhere is what to compare with.
        const int side = a <= 1 ? 1 : a + 2 >= runs ? -1 : 0;
        if (side > 0 ? a + length + 1 > frames : side < 0 && a < 1) continue;
        const double score = side == 0 ? scores[static_cast<std::size_t>(a)] : score_of(a, side);
        if (score <= threshold) continue;
        std::vector<double> near;
        std::vector<std::pair<double, Index>> others;
        for (Index k = std::max<Index>(0, a - kStride); k < std::min(runs, a + kStride + 1); ++k) {
          if (side > 0 ? k + length + 2 > frames : side < 0 && k < 2) continue;
          const double other = side == 0 ? scores[static_cast<std::size_t>(k)] : score_of(k, side);
          if (std::abs(k - a) <= kNear) near.push_back(other);
          if (std::abs(k - a) > kApart) others.emplace_back(other, k);
        }
        if (others.size() < kFewest || score <= kActivity * median(std::move(near))) continue;
        // Feet come down in every stride: what stands out has to do so beside the others that do, but for one, which may be a spike too.
        const Index first = std::max_element(others.begin(), others.end())->second;
        double second = 0;
        for (const auto& [other, k] : others)
          if (std::abs(k - first) > kApart) second = std::max(second, other);
        if (score > kBesideOthers * second) found.push_back({side == 0 ? score : kAtEnd * score, score, a, a + length - 1});
      }
    }
    // What is seen from both sides goes before what one side says: a spike near an end makes the frames beyond it look like one.
    std::stable_sort(found.begin(), found.end(), [](const Found& x, const Found& y) { return x.rank > y.rank; });
    std::vector<Found> taken;
    for (const Found& f : found) {
      if (std::any_of(taken.begin(), taken.end(), [&](const Found& o) { return f.first <= o.last + kApart && o.first <= f.last + kApart; })) continue;
      taken.push_back(f);
      for (Index t = f.first; t <= f.last; ++t) marks(t, g) = 1;
      bridge(v, g, f.first, f.last);
    }
    if (taken.empty()) return;
  }
}

std::vector<HeldRun> find_held(const Values& v, int g, double noise, double threshold) {
  std::vector<HeldRun> runs;
  const Index frames = v.rows();
  const auto moved = [&](Index t) { return (at(v, t, g) - at(v, t - 1, g)).norm(); };
  for (Index a = 0; a + kShortestHold <= frames;) {
    Index b = a;
    while (b + 1 < frames && moved(b + 1) <= kExactly) ++b;
    if (b - a + 1 >= kShortestHold) {
      // Of motion with noise on it that alone is proof; a joint of clean motion may come to rest, but not suddenly.
      const bool stops = a > 0 && moved(a) > kMoves && (noise > kMoves || a < 2 || moved(a) > kSuddenly * moved(a - 1));
      const bool jumps = b + 1 < frames && moved(b + 1) > kMoves && (noise > kMoves || b + 2 >= frames || moved(b + 1) > kSpeedAfter * moved(b + 2));
      if (stops || jumps) runs.push_back({g, a, b});
      a = b + 1;
      continue;
    }
    // The same under noise: all within what noise does of their mean.
    Vector3 sum = at(v, a, g);
    b = a;
    while (b + 1 < frames && b + 1 - a < kLongestHold) {
      const Vector3 more = sum + at(v, b + 1, g), mean = more / static_cast<double>(b + 2 - a);
      bool within = true;
      for (Index t = a; t <= b + 1 && within; ++t) within = (at(v, t, g) - mean).norm() <= kHeld * noise;
      if (!within) break;
      sum = more;
      ++b;
    }
    if (b - a + 1 >= kShortestHold && b + 1 < frames && b + 1 - a < kLongestHold) {
      const double jump = (at(v, b + 1, g) - sum / static_cast<double>(b + 1 - a)).norm(), after = b + 2 < frames ? moved(b + 2) : 0;
      if (jump > threshold + kSpeedAfter * after) {
        runs.push_back({g, a, b});
        a = b + 1;
        continue;
      }
    }
    a += b + 1 - a >= kLongestHold ? kLongestHold / 2 : 1;
  }
  return runs;
}

}  // namespace

double median(std::vector<double> x) {
  if (x.empty()) return 0;
  const auto middle = x.begin() + static_cast<std::ptrdiff_t>(x.size() / 2);
  std::nth_element(x.begin(), middle, x.end());
  return *middle;
}

Values measured_values(const Clip& clip, const features::FeatureMatrix& x) {
  Values v(x.rows(), x.cols());
  double heading = yaw_of(clip.rotations[0]);
  for (Index t = 0; t < x.rows(); ++t) {
    if (t > 0) heading += x(t, 2);
    v.row(t).head<3>() = clip.root_position[static_cast<std::size_t>(t)].transpose();
    v(t, 3) = heading;
    v.row(t).tail(x.cols() - 4) = x.row(t).tail(x.cols() - 4);
  }
  return v;
}

features::FeatureMatrix states_of(const Values& v) {
  features::FeatureMatrix x(v.rows(), v.cols());
  for (Index t = 0; t < v.rows(); ++t) {
    x.row(t).head<3>().setZero();
    if (t > 0) {
      const Vector3 step = yaw_rotation(-v(t - 1, 3)) * (at(v, t, 0) - at(v, t - 1, 0));
      x.row(t).head<3>() << step.x(), step.y(), v(t, 3) - v(t - 1, 3);
    }
    x(t, 3) = v(t, 2);
    x.row(t).tail(v.cols() - 4) = v.row(t).tail(v.cols() - 4);
  }
  if (v.rows() > 1) x.row(0).head<3>() = x.row(1).head<3>();
  return x;
}

std::vector<double> noise_deviations(const Values& v) {
  const Values s = smoothed(v);
  std::vector<double> out;
  for (int g = 0; 3 * g < v.cols(); ++g) {
    std::vector<double> off;
    for (Index t = 0; t < v.rows(); ++t) off.push_back((at(v, t, g) - at(s, t, g)).norm());
    out.push_back(median(std::move(off)) / (kMedianNorm * kLeftByParabola));
  }
  return out;
}

Suspects find_suspects(const Values& values, const std::vector<double>& noise, double sigma_position, double sigma_angle, double sigmas, const Skeleton& skeleton) {
  const int groups = static_cast<int>(values.cols() / 3);
  Suspects s{Marks::Zero(values.rows(), groups), {}};
  for (int g = 0; g < groups; ++g) {
    const double own = noise[static_cast<std::size_t>(g)], threshold = sigmas * std::max(own, g == 0 ? sigma_position : sigma_angle);
    const auto runs = find_held(values, g, own, threshold);
    s.held.insert(s.held.end(), runs.begin(), runs.end());
    Values v = values;
    for (const auto& r : runs) bridge(v, g, r.first, r.last);
    find_spikes(v, g, threshold, s.marks);
  }
  // What hangs below a joint that was lost.
  const std::vector<HeldRun> found = s.held;
  for (const auto& r : found) {
    if (r.group == 0) continue;
    std::vector<bool> below(static_cast<std::size_t>(groups), false);
    for (int j = r.group - 1; j < groups - 1; ++j) {
      const int parent = skeleton.parents[static_cast<std::size_t>(j)];
      below[static_cast<std::size_t>(j)] = j == r.group - 1 || (parent >= 0 && below[static_cast<std::size_t>(parent)]);
      if (below[static_cast<std::size_t>(j)] && j > r.group - 1) s.held.push_back({j + 1, r.first, r.last});
    }
  }
  for (const auto& r : s.held)
    for (Index t = r.first; t <= r.last; ++t) s.marks(t, r.group) = 1;
  return s;
}

Values bridged(const Values& values, const Marks& marks) {
  Values v = values;
  for (int g = 0; g < marks.cols(); ++g)
    for (Index t = 0; t < v.rows(); ++t) {
      if (!marks(t, g)) continue;
      Index last = t;
      while (last + 1 < v.rows() && marks(last + 1, g)) ++last;
      bridge(v, g, t, last);
      t = last;
    }
  return smoothed(v);
}

std::vector<Outlier> list_outliers(const Marks& marks, const std::vector<HeldRun>& held, const Eigen::ArrayXXd& off, const Skeleton& skeleton) {
  const auto joints = static_cast<int>(skeleton.parents.size());
  std::vector<std::vector<Outlier>> of(static_cast<std::size_t>(marks.cols()));
  for (int g = 0; g < marks.cols(); ++g)
    for (Index t = 0; t < marks.rows(); ++t) {
      if (!marks(t, g)) continue;
      Outlier o{g - 1, t, t, false, 0};
      for (; o.last < marks.rows() && marks(o.last, g); ++o.last) o.largest = std::max(o.largest, off(o.last, g));
      t = o.last--;
      o.dropout = std::any_of(held.begin(), held.end(), [&](const HeldRun& r) { return r.group == g && r.first <= o.last && o.first <= r.last; });
      of[static_cast<std::size_t>(g)].push_back(o);
    }
  std::vector<Outlier> all = of[0];
  for (int j = 0; j < joints; ++j)
    for (const Outlier& o : of[static_cast<std::size_t>(j) + 1]) {
      bool part = false;
      for (int up = o.dropout ? skeleton.parents[static_cast<std::size_t>(j)] : -1; up >= 0 && !part; up = skeleton.parents[static_cast<std::size_t>(up)])
        part = std::any_of(of[static_cast<std::size_t>(up) + 1].begin(), of[static_cast<std::size_t>(up) + 1].end(), [&](const Outlier& p) { return p.dropout && p.first <= o.first && o.last <= p.last; });
      if (!part) all.push_back(o);
    }
  std::stable_sort(all.begin(), all.end(), [](const Outlier& a, const Outlier& b) { return std::pair(a.first, a.joint) < std::pair(b.first, b.joint); });
  return all;
}

}  // namespace mocap::control
