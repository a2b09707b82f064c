#include "libmocap/clip/canonicalize.hpp"

#include <fmt/core.h>

#include <cmath>

#include "libmocap/base/error.hpp"
#include "libmocap/clip/mirror.hpp"
#include "libmocap/clip/world_frame.hpp"
#include "libmocap/skeleton/canonical_body.hpp"

namespace mocap {

Canonicalizer::Canonicalizer(CanonicalizeOptions options) : options_(std::move(options)), preset_(contact_preset(options_.contacts)) {
  if (!(std::isfinite(options_.rate_hz) && options_.rate_hz > 0)) refuse_usage(fmt::format("a rate of {} Hz, expected a finite number above 0", options_.rate_hz));
}

std::shared_ptr<const Retargeter> Canonicalizer::retargeter_for(const Clip& clip, std::vector<std::string>& notes) const {
  const auto& skeleton = clip.skeleton;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [known, retargeter] : known_)
      if (known->same_as(*skeleton, 0) && known->roles == skeleton->roles) return retargeter;
  }
  const bool from_motion = options_.alignment == Alignment::motion || (options_.alignment == Alignment::automatic && !Retargeter::rest_pose_stands(*skeleton));
  if (from_motion) {
    notes.push_back("the rest pose does not stand: joint axes are taken from the motion");
    return std::make_shared<const Retargeter>(skeleton, clip);  // depends on the clip
  }
  auto made = std::make_shared<const Retargeter>(skeleton);
  const std::lock_guard lock(mutex_);
  // A folder of subjects has a skeleton a subject; the latest few are the ones that come back.
  if (known_.size() >= 16) known_.erase(known_.begin());
  known_.emplace_back(skeleton, made);
  return made;
}

Canonicalizer::Result Canonicalizer::operator()(const Clip& whole, bool report) const {
  const Clip trimmed = options_.trim.any() ? trim(whole, options_.trim) : Clip{};
  const Clip& clip = options_.trim.any() ? trimmed : whole;
  if (clip.seconds() < options_.min_seconds)
    refuse({{}, 0, "clip " + clip.name}, fmt::format("{:.3g} s of motion, expected at least {:.3g} s", clip.seconds(), options_.min_seconds));
  require_right_handed(clip);
  Result out;
  const bool canonical = !options_.body && clip.skeleton->same_as(*canonical_body(), 1e-5);
  const auto retargeter = canonical || options_.body ? nullptr : retargeter_for(clip, out.notes);
  const Clip rotations_only = options_.body ? on_body(without_translations(clip, out.notes), options_.body, out.notes) : Clip{};
  const Clip& input = options_.body ? rotations_only : clip;
  const int phases = options_.all_phases ? phase_count(clip.frame_rate_hz, options_.rate_hz) : 1;
  for (int phase = 0; phase < phases && static_cast<std::size_t>(phase) < clip.frames(); ++phase) {
    Clip c = resample(input, options_.rate_hz, phase, options_.anti_alias);
    Clip source;
    if (canonical) {
      c.skeleton = canonical_body();
    } else if (retargeter) {
      if (report && phase == 0) source = c;
      c = retargeter->apply(c);
    }
    set_on_ground(c);
    face_forward(c);
    c.contacts = label_contacts(c, preset_);
    if (phase > 0) c.name += fmt::format("@{}", phase);
    make_sign_continuous(c);
    c.validate();
    if (source.frames() > 0) out.report = report_retargeting(*retargeter, source, c);
    out.clips.push_back(std::move(c));
    if (!options_.mirror) continue;
    Clip mirrored = mirror(out.clips.back());
    mirrored.name += "@m";
    out.clips.push_back(std::move(mirrored));
  }
  return out;
}

}  // namespace mocap
