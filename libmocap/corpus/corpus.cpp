#include "libmocap/corpus/corpus.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "libmocap/base/error.hpp"
#include "libmocap/corpus/gait.hpp"
#include "libmocap/corpus/scripted.hpp"

namespace mocap::corpus {
namespace {

constexpr std::array<std::string_view, 5> kActionNames = {"walking", "jogging", "jumping", "lifting", "transition"};

// Stream purposes of a subject: 0 is the subject itself (subject.cpp).
enum Purpose : std::uint64_t { kMotion = 1, kNoise = 101 };

Random stream(const CorpusPlan& plan, const ClipId& id, Purpose purpose) {
  return Random(plan.seed,
                stream_of(subject_stream(id.gender, id.subject), purpose + static_cast<std::uint64_t>(id.action),
                          static_cast<std::uint64_t>(id.take)));
}

Vector3 y_up(const Vector3& v) { return {v.y(), v.z(), v.x()}; }

}  // namespace

std::string text(Action action) { return std::string(kActionNames[static_cast<std::size_t>(action)]); }

Action parse_action(std::string_view name) {
  for (std::size_t i = 0; i < kActionNames.size(); ++i)
    if (kActionNames[i] == name) return static_cast<Action>(i);
  refuse_usage("action '" + std::string(name) + "', expected walking, jogging, jumping, lifting or transition");
}

std::string ClipId::stem() const {
  return fmt::format("{}_{}{:03d}_{}", text(action), gender == Gender::female ? 'f' : 'm', subject, take);
}

std::vector<ClipId> list_clips(const CorpusPlan& plan) {
  std::vector<Action> actions = plan.actions;
  if (plan.transitions > 0) actions.push_back(Action::transition);
  std::sort(actions.begin(), actions.end());
  actions.erase(std::unique(actions.begin(), actions.end()), actions.end());
  std::vector<ClipId> ids;
  for (const Action action : actions)
    for (const Gender gender : {Gender::female, Gender::male})
      for (int subject = 1; subject <= plan.subjects; ++subject)
        for (int take = 1; take <= (action == Action::transition ? plan.transitions : plan.takes); ++take)
          ids.push_back({action, gender, subject, take});
  return ids;
}

Clip make_clip(const CorpusPlan& plan, const ClipId& id) {
  const Subject subject = draw_subject(plan.seed, id.gender, id.subject);
  Random random = stream(plan, id, kMotion);
  const auto frames = static_cast<std::size_t>(std::max<long>(2, std::lround(plan.seconds * kFrameRateHz)));
  const auto gait = [&](GaitPlan course) {
    course.turning = plan.turning;
    return make_gait(subject, course, random, frames, kFrameRateHz);
  };
  const auto make = [&] {
    switch (id.action) {
      case Action::walking:
        return gait(GaitPlan::steady(false));
      case Action::jogging:
        return gait(GaitPlan::steady(true));
      case Action::jumping:
        return make_jumping(subject, random, frames, kFrameRateHz);
      case Action::lifting:
        return make_lifting(subject, random, frames, kFrameRateHz);
      case Action::transition:
        break;
    }
    return gait(GaitPlan::walk_jog_walk(random, static_cast<double>(frames) / kFrameRateHz, kFrameRateHz));
  };
  Clip clip = make();
  clip.name = id.stem();
  clip.source.path = clip.name + ".bvh";
  clip.attributes = {{"gender", text(id.gender)}, {"subject", subject.name}};
  if (id.action != Action::transition) clip.attributes["action"] = text(id.action);
  return clip;
}

Clip make_noisy(const CorpusPlan& plan, const ClipId& id, const Clip& clean, double level,
                std::vector<NoiseEvent>& events) {
  Random random = stream(plan, id, kNoise);
  Clip clip = clean;
  events = add_sensor_noise(clip, level, random);
  return clip;
}

Clip to_y_up_centimetres(const Clip& clip) {
  constexpr double kCentimetres = 100;
  Clip out = clip;
  Skeleton skeleton = *clip.skeleton;
  for (Vector3& v : skeleton.rest_offsets) v = kCentimetres * y_up(v);
  for (auto& e : skeleton.end_sites) e.offset = kCentimetres * y_up(e.offset);
  out.skeleton = std::make_shared<const Skeleton>(std::move(skeleton));
  // A cyclic permutation of the axes is a rotation, so a quaternion's vector part permutes with them.
  for (Quaternion& q : out.rotations) q.vec() = y_up(q.vec());
  for (Vector3& v : out.root_position) v = kCentimetres * y_up(v);
  for (Vector3& v : out.translations) v = kCentimetres * y_up(v);
  return out;
}

std::string labels_table(const std::vector<Clip>& clips) {
  const bool segments = std::any_of(clips.begin(), clips.end(), [](const Clip& c) { return !c.segments.empty(); });
  std::string table = segments ? "file\taction\tgender\tsubject\tstart\tend\n" : "file\taction\tgender\tsubject\n";
  const auto value = [](const Attributes& a, const char* name) {
    const auto at = a.find(name);
    return at == a.end() ? std::string() : at->second;
  };
  for (const Clip& c : clips) {
    const std::string who = value(c.attributes, "gender") + '\t' + value(c.attributes, "subject");
    if (c.segments.empty())
      table += fmt::format("{}\t{}\t{}{}\n", c.source.path, value(c.attributes, "action"), who, segments ? "\t\t" : "");
    for (const Segment& s : c.segments)
      table += fmt::format("{}\t{}\t{}\t{:.4f}\t{:.4f}\n", c.source.path, value(s.attributes, "action"), who,
                           static_cast<double>(s.start) / c.frame_rate_hz,
                           static_cast<double>(s.start + s.length) / c.frame_rate_hz);
  }
  return table;
}

std::string manifest_header() { return "file\tkind\tjoint\tstart\tend\tsize\tunit\n"; }

std::string manifest_rows(const Clip& clip, const std::vector<NoiseEvent>& events) {
  std::string rows;
  for (const NoiseEvent& e : events)
    rows += fmt::format("{}\t{}\t{}\t{:.4f}\t{:.4f}\t{:.4f}\t{}\n", clip.source.path, e.kind, e.joint,
                        static_cast<double>(e.first) / clip.frame_rate_hz,
                        static_cast<double>(e.first + e.count) / clip.frame_rate_hz, e.size, e.unit);
  return rows;
}

}  // namespace mocap::corpus
