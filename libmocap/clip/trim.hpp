// Cutting a clip's ends off: `--trim`.
#pragma once
#include <string>

#include "libmocap/clip/clip.hpp"

namespace mocap {

// How much goes from either end: seconds, or percent of the frames.
struct Trim {
  struct Amount {
    double value = 0;
    bool percent = false;
  };
  Amount start, end;

  bool any() const { return start.value > 0 || end.value > 0; }
  // "A" for both ends or "A,B"; each seconds ("0.5") or percent ("10%"). Error(usage) for anything else, for values below 0
  // and for percents that leave nothing.
  static Trim parse(const std::string& text);
};

// Frames round(A rate) or round(A/100 T) from the start, likewise from the end; source times and segments move along (cut()).
// Error(data) where no frame is left.
Clip trim(const Clip& clip, const Trim& amounts);

}  // namespace mocap
