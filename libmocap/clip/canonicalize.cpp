#include "libmocap/clip/canonicalize.hpp"

#include <fmt/core.h>

#include <cmath>

#include "libmocap/base/error.hpp"
#include "libmocap/clip/world_frame.hpp"
#include "libmocap/skeleton/canonical_body.hpp"

namespace mocap {

Canonicalizer::Canonicalizer(CanonicalizeOptions options) : options_(std::move(options)), preset_(contact_preset(options_.contacts)) {
  if (!(std::isfinite(options_.rate_hz) && options_.rate_hz > 0)) refuse_usage(fmt::format("a rate of {} Hz, expected a finite number above 0", options_.rate_hz));
}

std::shared_ptr<const Retargeter> Canonicalizer::retargeter_for(const std::shared_ptr<const Skeleton>& skeleton) const {
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [known, retargeter] : known_)
      if (known->same_as(*skeleton, 0)) return retargeter;
  }
  auto made = std::make_shared<const Retargeter>(skeleton);
  const std::lock_guard lock(mutex_);
  // A folder of subjects has a skeleton a subject; the latest few are the ones that come back.
  if (known_.size() >= 16) known_.erase(known_.begin());
  known_.emplace_back(skeleton, made);
  return made;
}

std::vector<Clip> Canonicalizer::operator()(const Clip& whole) const {
  const Clip trimmed = options_.trim.any() ? trim(whole, options_.trim) : Clip{};
  const Clip& clip = options_.trim.any() ? trimmed : whole;
  if (clip.seconds() < options_.min_seconds)
    refuse({{}, 0, "clip " + clip.name}, fmt::format("{:.3g} s of motion, expected at least {:.3g} s", clip.seconds(), options_.min_seconds));
  const bool canonical = clip.skeleton->same_as(*canonical_body(), 1e-5);
  const auto retargeter = canonical ? nullptr : retargeter_for(clip.skeleton);
  const int phases = options_.all_phases ? phase_count(clip.frame_rate_hz, options_.rate_hz) : 1;
  std::vector<Clip> out;
  for (int phase = 0; phase < phases && static_cast<std::size_t>(phase) < clip.frames(); ++phase) {
    Clip c = resample(clip, options_.rate_hz, phase, options_.anti_alias);
    if (canonical) {
      c.skeleton = canonical_body();
    } else {
      c = retargeter->apply(c);
    }
    set_on_ground(c);
    face_forward(c);
    c.contacts = label_contacts(c, preset_);
    if (phase > 0) c.name += fmt::format("@{}", phase);
    make_sign_continuous(c);
    c.validate();
    out.push_back(std::move(c));
  }
  return out;
}

}  // namespace mocap
