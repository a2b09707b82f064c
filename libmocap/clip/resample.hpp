// Time-true resampling.
#pragma once
#include "libmocap/clip/clip.hpp"

namespace mocap {

enum class AntiAlias { none, sinc };

// Samples the clip at times (phase / clip.frame_rate_hz) + i / rate_hz, i = 0, 1, ..., up to its last frame: spherical
// linear interpolation of rotations, linear of positions, nearest frame of contacts. Where the times fall on frames
// (120 -> 30 Hz) frames are picked unchanged. Segments are moved to the nearest new frames. source.phase is set.
// rate_hz finite and > 0, 0 <= phase, otherwise Error(usage). Cost O(J) a frame.
//
// AntiAlias::sinc, where the clip's rate is higher than rate_hz (otherwise as none): a zero-phase low-pass by a sinc with a
// Kaiser window (Oppenheim & Schafer, Discrete-Time Signal Processing, 7.5.3; 44 dB, beta = 3.86) before sampling,
//     x(t) = sum_k w_k x_k / sum_k w_k,   w_k = sinc(2 fc s) I0(beta sqrt(1 - (s/h)^2)),   s = t_k - t, |s| < h,
// fc = 0.45 rate_hz (0.9 of the new Nyquist frequency), h = 8 / rate_hz. Positions as they are; rotations in the tangent
// space of the motion at t, q(t) exp(sum_k w_k log(q(t)^-1 q_k) / sum_k w_k), each logarithm on the branch next to its
// neighbour's, so that spins of several turns pass. A rotation about one axis is filtered exactly as a number would be.
// Amplitudes, at 4:1: within 1 % up to 0.7 of the new Nyquist frequency, -6 dB at 0.9, at least 40 dB down from 1.1 (tested,
// and against SciPy). At the ends the weights that are there are normalised. Cost: 16 r logarithms
// a joint and new frame at the ratio r, 70 us for 31 joints at 4:1: canonicalize takes six times as long over CMU's files.
Clip resample(const Clip& clip, double rate_hz, int phase = 0, AntiAlias anti_alias = AntiAlias::none);

// How many decimation offsets a rate change has: round(source / target) when that is whole within 1e-6, else 1.
int phase_count(double source_hz, double target_hz);

}  // namespace mocap
