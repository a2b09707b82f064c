// Curves of time that the corpus is drawn with: slow noise, key frames, quintic paths, Fourier series.
#pragma once
#include <vector>

#include "libmocap/base/random.hpp"

namespace mocap::corpus {

// Smooth noise of zero mean and unit variance, defined for every time: four sinusoids of random frequency in
// [low_hz, high_hz] and random phase. What varies slowly within a clip (cadence, speed, heading, amplitudes).
class SlowNoise {
 public:
  explicit SlowNoise(Random& random, double low_hz = 0.05, double high_hz = 0.4);
  double operator()(double t) const;

 private:
  struct Wave {
    double omega, phase;
  };
  Wave waves_[4];
};

// Key frames joined by monotone cubics (Fritsch & Carlson 1980): C1, no overshoot between keys, constant outside.
class KeyCurve {
 public:
  struct Sample {
    double value, slope;
  };

  void add(double t, double value);  // times strictly increasing; Error(internal) otherwise
  void finish();                     // after the last add, before the first at()
  double operator()(double t) const { return at(t).value; }
  Sample at(double t) const;

 private:
  std::vector<double> t_, value_, slope_;
};

// Knots of position, velocity and acceleration joined by quintics: C2, and exact where the motion between two knots is
// a parabola (free flight). Constant outside.
class QuinticPath {
 public:
  void add(double t, double position, double velocity = 0, double acceleration = 0);
  double operator()(double t) const;

 private:
  struct Knot {
    double t, p, v, a;
  };
  std::vector<Knot> knots_;
};

// mean + a1 cos(2 pi (phase - lag)) + a2 cos(4 pi (phase - lag2)): two harmonics carry more than 95 % of the variance
// of walking (Troje 2002, "Decomposing biological motion"). phase and lags in cycles.
struct Fourier {
  double mean = 0, a1 = 0, lag = 0, a2 = 0, lag2 = 0;
  double operator()(double phase) const;
};

double smoothstep(double u);               // 0 below 0, 1 above 1, 3u^2 - 2u^3 between
double mix(double a, double b, double u);  // a + (b - a) u
double radians(double degrees);

}  // namespace mocap::corpus
