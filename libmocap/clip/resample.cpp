#include "libmocap/clip/resample.hpp"

#include <cmath>
#include <numbers>

#include "libmocap/base/error.hpp"

namespace mocap {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kCutoff = 0.45, kHalfWidth = 8;  // of the new rate; in new frames
const double kBeta = 0.5842 * std::pow(44 - 21, 0.4) + 0.07886 * (44 - 21);  // Kaiser's formula for 44 dB

double bessel_i0(double x) {
  double sum = 1, term = 1;
  for (int k = 1; term > 1e-17 * sum; ++k) {
    term *= x * x / (4.0 * k * k);
    sum += term;
  }
  return sum;
}

// Weights of the source frames around `at` (in source frames), for `ratio` source frames to a new one; their sum is 1.
class Kernel {
 public:
  Kernel(double ratio, std::size_t frames) : ratio_(ratio), frames_(static_cast<std::ptrdiff_t>(frames)) {}

  void move_to(double at) {
    const double half = kHalfWidth * ratio_;
    const double base = std::floor(at + 1e-9), fraction = std::max(0.0, at - base);
    const auto reach = static_cast<std::ptrdiff_t>(std::ceil(half));
    if (taps_.empty() || std::abs(fraction - fraction_) > 1e-12) {
      // Whole ratios meet the same fraction again and again.
      fraction_ = fraction;
      taps_.clear();
      for (std::ptrdiff_t k = -reach; k <= reach + 1; ++k) {
        const double s = static_cast<double>(k) - fraction, x = 2 * kPi * kCutoff * s / ratio_, inside = 1 - s * s / (half * half);
        taps_.push_back(inside <= 1e-9 ? 0 : (std::abs(x) < 1e-9 ? 1 : std::sin(x) / x) * bessel_i0(kBeta * std::sqrt(inside)));
      }
    }
    const auto first = static_cast<std::ptrdiff_t>(base) - reach;
    begin_ = std::max<std::ptrdiff_t>(first, 0);
    end_ = std::min<std::ptrdiff_t>(first + static_cast<std::ptrdiff_t>(taps_.size()), frames_);
    skipped_ = begin_ - first;
    centre_ = std::min(static_cast<std::ptrdiff_t>(base), frames_ - 1);
    sum_ = 0;
    for (std::ptrdiff_t k = begin_; k < end_; ++k) sum_ += raw(k);
  }
  std::ptrdiff_t begin() const { return begin_; }
  std::ptrdiff_t end() const { return end_; }
  std::ptrdiff_t centre() const { return centre_; }
  double weight(std::ptrdiff_t k) const { return raw(k) / sum_; }

 private:
  double raw(std::ptrdiff_t k) const { return taps_[static_cast<std::size_t>(k - begin_ + skipped_)]; }

  double ratio_, fraction_ = 0, sum_ = 1;
  std::ptrdiff_t frames_, begin_ = 0, end_ = 0, skipped_ = 0, centre_ = 0;
  std::vector<double> taps_;
};

Vector3 filtered(const std::vector<Vector3>& v, std::size_t width, std::size_t item, const Kernel& kernel) {
  Vector3 sum = Vector3::Zero();
  for (std::ptrdiff_t k = kernel.begin(); k < kernel.end(); ++k) sum += kernel.weight(k) * v[static_cast<std::size_t>(k) * width + item];
  return sum;
}

// `middle`: the unfiltered motion at the kernel's place.
Quaternion filtered(const std::vector<Quaternion>& q, std::size_t width, std::size_t item, const Quaternion& middle, const Kernel& kernel) {
  const Quaternion back = middle.conjugate();
  Vector3 sum = Vector3::Zero();
  const auto add = [&](std::ptrdiff_t k, Vector3& last) {
    Vector3 v = log_map(back * q[static_cast<std::size_t>(k) * width + item]);
    if (const double angle = v.norm(); angle > 1e-6) {
      // Of v + 2 pi n along its axis the one next to the neighbour.
      const Vector3 axis = v / angle;
      v += std::round((last - v).dot(axis) / (2 * kPi)) * 2 * kPi * axis;
    }
    last = v;
    sum += kernel.weight(k) * v;
  };
  Vector3 last = Vector3::Zero();
  for (std::ptrdiff_t k = kernel.centre(); k >= kernel.begin(); --k) add(k, last);
  last.setZero();
  for (std::ptrdiff_t k = kernel.centre() + 1; k < kernel.end(); ++k) add(k, last);
  return middle * exp_map(sum);
}

}  // namespace

int phase_count(double source_hz, double target_hz) {
  const double ratio = source_hz / target_hz, whole = std::round(ratio);
  return whole >= 1 && std::abs(ratio - whole) < 1e-6 * ratio ? static_cast<int>(whole) : 1;
}

Clip resample(const Clip& clip, double rate_hz, int phase, AntiAlias anti_alias) {
  if (!(std::isfinite(rate_hz) && rate_hz > 0)) refuse_usage("a rate of " + std::to_string(rate_hz) + " Hz, expected a finite number above 0");
  if (phase < 0) refuse_usage("a phase below 0");
  const double ratio = clip.frame_rate_hz / rate_hz;
  Clip out = without_frames(clip);
  out.frame_rate_hz = rate_hz;
  out.source.phase = phase;
  const std::size_t frames = clip.frames();
  const auto joints = static_cast<std::size_t>(clip.joints());
  if (frames == 0 || static_cast<std::size_t>(phase) >= frames) return out;
  // A hair of tolerance: 2.9999999 source frames are 3.
  const auto count = static_cast<std::size_t>(std::floor(static_cast<double>(frames - 1 - static_cast<std::size_t>(phase)) / ratio + 1e-9)) + 1;
  out.rotations.reserve(count * joints);
  out.root_position.reserve(count);
  const bool smooth = anti_alias == AntiAlias::sinc && ratio > 1 + 1e-9;
  Kernel kernel(ratio, frames);
  for (std::size_t i = 0; i < count; ++i) {
    const double at = phase + static_cast<double>(i) * ratio, nearest = std::round(at);
    const bool exact = std::abs(at - nearest) < 1e-9;
    const auto a = std::min(static_cast<std::size_t>(exact ? nearest : std::floor(at)), frames - 1);
    const std::size_t b = std::min(a + 1, frames - 1);
    const double w = exact ? 0.0 : at - static_cast<double>(a);
    if (smooth) kernel.move_to(at);
    const auto mix = [&](const std::vector<Vector3>& v, std::size_t width, std::size_t k) -> Vector3 {
      if (smooth) return filtered(v, width, k, kernel);
      return w == 0 ? v[a * width + k] : Vector3((1 - w) * v[a * width + k] + w * v[b * width + k]);
    };
    for (std::size_t k = 0; k < joints; ++k) {
      const Quaternion q = w == 0 ? clip.rotations[a * joints + k] : slerp(clip.rotations[a * joints + k], clip.rotations[b * joints + k], w);
      out.rotations.push_back(smooth ? filtered(clip.rotations, joints, k, q, kernel) : q);
    }
    out.root_position.push_back(mix(clip.root_position, 1, 0));
    if (!clip.translations.empty())
      for (std::size_t k = 0; k < joints; ++k) out.translations.push_back(mix(clip.translations, joints, k));
    if (!clip.contacts.empty()) out.contacts.push_back(clip.contacts[w < 0.5 ? a : b]);
  }
  for (const Segment& s : clip.segments) {
    // The first new frame at or after a source frame: each new frame has the labels of the moment that it shows, up to the last.
    const auto place = [&](std::int64_t frame) {
      return std::clamp<std::int64_t>(static_cast<std::int64_t>(std::ceil((static_cast<double>(frame) - phase) / ratio - 1e-9)), 0, static_cast<std::int64_t>(count));
    };
    const std::int64_t a = place(s.start), b = place(s.start + s.length);
    if (a < b) out.segments.push_back({a, b - a, s.attributes});
  }
  make_sign_continuous(out);
  return out;
}

}  // namespace mocap
