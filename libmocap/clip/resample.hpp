// Time-true resampling.
#pragma once
#include "libmocap/clip/clip.hpp"

namespace mocap {

// Samples the clip at times (phase / clip.frame_rate_hz) + i / rate_hz, i = 0, 1, ..., up to its last frame: spherical
// linear interpolation of rotations, linear of positions, nearest frame of contacts. Where the times fall on frames
// (120 -> 30 Hz) frames are picked unchanged. Segments are moved to the nearest new frames. source.phase is set.
// rate_hz finite and > 0, 0 <= phase, otherwise Error(usage). Cost O(J) a frame.
Clip resample(const Clip& clip, double rate_hz, int phase = 0);

// How many decimation offsets a rate change has: round(source / target) when that is whole within 1e-6, else 1.
int phase_count(double source_hz, double target_hz);

}  // namespace mocap
