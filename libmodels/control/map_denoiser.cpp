#include "libmodels/control/map_denoiser.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <utility>

#include "libmocap/base/error.hpp"
#include "libmocap/clip/ground.hpp"

namespace mocap::control {

using torch::Tensor;

namespace {

constexpr std::int64_t kBits = train::kContactBits;
constexpr double kFarFromAll = 4;  // times the median

Tensor rows_of(const Values& v, std::int64_t first, std::int64_t count) { return torch::from_blob(const_cast<double*>(v.data() + first * v.cols()), {count, v.cols()}, torch::kDouble).clone(); }

class Problem {
 public:
  Problem(const MotionModel& model, const Terms& terms, const MapSettings& settings, const PlanOptions& options, const Clip& clip)
      : model_(model), terms_(terms), settings_(settings), options_(options), clip_(clip), number_(model.number()) {
    const auto& reference = model.reference();
    mean_ = torch::tensor(reference.mean).to(torch::kDouble);
    deviation_ = torch::tensor(reference.deviation).to(torch::kDouble);
    const features::FeatureMatrix states = features::encode_state(clip);
    values_ = measured_values(clip, states);
    if (!values_.allFinite()) refuse({{}, 0, "clip " + clip.name}, "numbers that are not finite, expected motion of finite numbers");
    const auto noise = noise_deviations(values_);
    for (std::size_t g = 0; g < noise.size(); ++g) limit_.push_back(settings.outlier_sigmas * std::max(noise[g], g == 0 ? settings.sigma_root : settings.sigma_angle));
    suspects_ = find_suspects(values_, noise, settings.sigma_root, settings.sigma_angle, settings.outlier_sigmas, *clip.skeleton);
    candidates_ = suspects_.marks;
    const Values smooth = bridged(values_, suspects_.marks);
    guess_ = states_of(smooth);
    start_values_ = smooth.row(0);
    Clip shown = features::decode_state(guess_, clip.skeleton, clip.frame_rate_hz, {smooth(0, 3), smooth.row(0).head<2>().transpose()});
    contacts_ = label_contacts(shown, contact_preset("default"));
    contacts_.resize(clip.frames());
    off_ = Eigen::ArrayXXd::Zero(values_.rows(), values_.cols() / 3);
  }

  MapDenoised solve() {
    MapDenoised out;
    const std::int64_t frames = values_.rows();
    std::optional<Shown> shown;
    const Tensor pair = standardised(0, 2);
    now_ = model_.start(pair);
    place_ = {start_values_[3], start_values_.head<2>()};
    for (std::int64_t first = 0; first + 1 < frames;) {
      const std::int64_t count = std::min(options_.window, frames - 1 - first);
      const Solved s = window(first, count, first == 0);
      ++out.windows;
      out.lowered += s.after < s.before;
      if (!shown) {
        Carried start = now_;
        const Eigen::Vector2d at = place_.position + turned({now_.x, now_.y}, place_.heading);
        start.x = at.x();
        start.y = at.y();
        start.heading += place_.heading;
        shown.emplace(model_.reference(), start);
      }
      const std::int64_t kept = first + count + 1 == frames ? count : options_.window - options_.overlap;
      shown->add(s.rows.narrow(0, 0, kept));
      for (std::int64_t i = kept; i < count; ++i) keep(first + 1 + i, s.motion, i);
      overlap_noise_ = s.motion.noise.narrow(0, kept, count - kept);
      if (first + kept + 1 < frames) {
        now_ = model_.advance(now_, s.motion, kept);
        place_.position += turned({now_.x, now_.y}, place_.heading);
        place_.heading += now_.heading;
        now_.x = now_.y = now_.heading = 0;
      }
      first += kept;
    }
    const Clip found = shown->piece();
    out.clip = clip_;
    out.clip.rotations = found.rotations;
    out.clip.root_position = found.root_position;
    out.clip.contacts = found.contacts;
    out.clip.contacts[0] = contacts_[0];
    make_sign_continuous(out.clip);
    out.outliers = list_outliers(suspects_.marks, suspects_.held, off_, *clip_.skeleton);
    return out;
  }

 private:
  struct Solved {
    Motion motion;
    Tensor rows;  // (T, D + 2) as they are shown
    double before = 0, after = 0;
  };

  static Vector2 turned(const Vector2& v, double by) { return {std::cos(by) * v.x() - std::sin(by) * v.y(), std::sin(by) * v.x() + std::cos(by) * v.y()}; }

  // (count, D + 2) of the guess.
  Tensor standardised(std::int64_t first, std::int64_t count) const {
    return train::standardised(guess_.middleRows(first, count), std::span(contacts_).subspan(static_cast<std::size_t>(first), static_cast<std::size_t>(count)), model_.reference()).to(number_);
  }

  // Frames that no window has seen yet: the generator goes on by itself and is drawn to what was measured, value by value by the gain of a steady Kalman filter of a random walk with its deviations. What L-BFGS begins with
  // has to be natural: from noise the network expects noise, and there the objective is far higher and flat.
  void follow(std::int64_t first, Motion& motion) const {
    const torch::NoGradGuard no_grad;
    const std::int64_t count = motion.frames(), known = overlap_noise_.defined() ? overlap_noise_.size(0) : 0, d = mean_.size(0);
    const Measured m = measured(first + 1, count);
    const Tensor mean = mean_.to(number_), deviation = deviation_.to(number_);
    const Tensor observed = torch::cat({torch::full({2}, settings_.sigma_root), torch::full({1}, settings_.sigma_angle), torch::full({1}, settings_.sigma_root), torch::full({d - 4}, settings_.sigma_angle)}).to(number_) / deviation;
    Carried c = known > 0 ? model_.advance(now_, motion, known) : now_;
    for (std::int64_t i = known; i < count; ++i) {
      const auto expected = model_.next(c);
      const Tensor to = m.root[i].narrow(0, 0, 2) - torch::tensor({c.x, c.y}, torch::kDouble).to(number_);
      const double cos = std::cos(c.heading), sin = std::sin(c.heading);
      const Tensor step = torch::stack({cos * to[0] + sin * to[1], cos * to[1] - sin * to[0], m.heading[i] - c.heading});
      const Tensor seen = (torch::cat({step, m.root[i].narrow(0, 2, 1), m.angles[i]}) - mean) / deviation;
      const Tensor trust = torch::cat({m.trust[i].narrow(0, 0, 2), m.trust[i].narrow(0, 3, 1), m.trust[i].narrow(0, 2, 1), m.trust[i].narrow(0, 4, d - 4)});
      const Tensor ratio = (expected.deviation / observed).square(), gain = 0.5 * ((ratio.square() + 4 * ratio).sqrt() - ratio);
      motion.states[i][0].copy_(expected.mean + trust * gain * (seen - expected.mean));
      motion.contacts[i][0].copy_(expected.contacts);
      if (i + 1 < count) c = model_.advance(c, {motion.states.narrow(0, i, 1), motion.noise.narrow(0, i, 1), motion.contacts.narrow(0, i, 1)}, 1);
    }
  }

  // Frame i of a motion becomes the guess of frame t.
  void keep(std::int64_t t, const Motion& motion, std::int64_t i) {
    const Tensor x = (motion.states[i][0].to(torch::kDouble) * deviation_ + mean_).contiguous();
    guess_.row(t) = Eigen::Map<const Eigen::RowVectorXd>(x.data_ptr<double>(), x.numel());
    for (std::int64_t b = 0; b < kBits; ++b) contacts_[static_cast<std::size_t>(t)][static_cast<std::size_t>(b)] = motion.contacts[i][0][b].item<double>() >= 0.5;
  }

  // Values of frames first .. in the frame of place_, and which of them count.
  Measured measured(std::int64_t first, std::int64_t count) const {
    Values v = values_.middleRows(first, count);
    Values trust(count, v.cols());
    for (std::int64_t t = 0; t < count; ++t) {
      v.row(t).head<2>() = turned(v.row(t).head<2>().transpose() - place_.position, -place_.heading).transpose();
      v(t, 3) -= place_.heading;
      for (std::int64_t g = 0; g < suspects_.marks.cols(); ++g) trust.row(t).segment<3>(3 * g).setConstant(suspects_.marks(first + t, g) ? 0 : 1);
    }
    const Tensor x = rows_of(v, 0, count).to(number_);
    return {x.narrow(1, 0, 3), x.select(1, 3), x.narrow(1, 4, v.cols() - 4), rows_of(trust, 0, count).to(number_)};
  }

  // Distances of the measured values from those seen, in groups; marks of suspects change by them, held runs as one. Whether any did.
  bool judge(std::int64_t first, const Tensor& seen, const Measured& m) {
    const Tensor measured = torch::cat({m.root, m.heading.unsqueeze(1), m.angles}, 1);
    const Tensor off = (seen - measured).view({seen.size(0), -1, 3}).norm(2, 2).to(torch::kDouble).contiguous();
    const std::int64_t count = off.size(0), groups = off.size(1);
    const double* p = off.data_ptr<double>();
    for (std::int64_t t = 0; t < count; ++t)
      for (std::int64_t g = 0; g < groups; ++g) off_(first + t, g) = *p++;
    // Where what was found is far from all values, it is not the values that are wrong.
    Marks now = Marks::Zero(count, groups);
    for (std::int64_t g = 0; g < groups; ++g) {
      std::vector<double> believed;
      for (std::int64_t t = 0; t < count; ++t)
        if (!suspects_.marks(first + t, g)) believed.push_back(off_(first + t, g));
      const double limit = std::max(limit_[static_cast<std::size_t>(g)], kFarFromAll * median(std::move(believed)));
      for (std::int64_t t = 0; t < count; ++t) now(t, g) = candidates_(first + t, g) && off_(first + t, g) > limit;
    }
    for (const HeldRun& r : suspects_.held) {
      const std::int64_t from = std::max(r.first, first) - first, to = std::min(r.last, first + count - 1) - first;
      if (from > to) continue;
      auto run = now.col(r.group).segment(from, to - from + 1);
      if ((run != 0).any()) run = 1;
    }
    auto old = suspects_.marks.middleRows(first, count);
    const bool changed = (old != now).any();
    old = now;
    return changed;
  }

  // The window behind frame `first`. With `free`, that frame and the state before it are looked for as well, and now_ becomes what was found.
  Solved window(std::int64_t first, std::int64_t count, bool free) {
    const std::int64_t d = mean_.size(0);
    const Tensor mean = mean_.to(number_), deviation = deviation_.to(number_);
    const Tensor guess = standardised(first + 1, count);
    Motion motion{guess.narrow(1, 0, d).unsqueeze(1).contiguous(), torch::zeros({count, 1, d}, guess.options()), guess.narrow(1, d, kBits).unsqueeze(1).contiguous()};
    if (overlap_noise_.defined() && overlap_noise_.size(0) > 0) motion.noise.narrow(0, 0, overlap_noise_.size(0)).copy_(overlap_noise_);
    follow(first, motion);
    const Tensor prior_state = now_.state;
    Solved result;
    for (int run = 0; run < std::max(1, options_.lbfgs.rereads); ++run) {
      const Measured m = measured(first + 1, count);
      const Measured m0 = free ? measured(first, 1) : Measured{};
      Terms terms = terms_;
      terms.push_back(observation_term(m, settings_.sigma_root, settings_.sigma_angle));

      // Scales: of a change of one value alone, by the mixture and what was measured. Places and headings in place of steps.
      const Tensor natural = 2 / model_.scale(now_, motion).squeeze(1).square(), trust = m.trust;
      const auto scale = [&](const Tensor& by_mixture, const Tensor& by_observation) { return (by_mixture + by_observation).rsqrt(); };
      const double r = 1 / (settings_.sigma_root * settings_.sigma_root), a = 1 / (settings_.sigma_angle * settings_.sigma_angle);
      const Tensor weights = torch::cat({torch::full({1}, r), torch::full({d - 4}, a)}).to(number_);
      const Tensor rest_scale = scale(natural.narrow(1, 3, d - 3), torch::cat({trust.narrow(1, 2, 1), trust.narrow(1, 4, d - 4)}, 1) * weights * deviation.narrow(0, 3, d - 3).square());
      const Tensor path_weights = torch::cat({torch::full({2}, r), torch::full({1}, a)}).to(number_);
      const Tensor path_scale = scale(natural.narrow(1, 0, 3) / deviation.narrow(0, 0, 3).square(), torch::cat({trust.narrow(1, 0, 2), trust.narrow(1, 3, 1)}, 1) * path_weights);

      const auto zeros = [&](at::IntArrayRef sizes) { return torch::zeros(sizes, guess.options().dtype(number_)).set_requires_grad(true); };
      Tensor path = zeros({count, 3}), rest = zeros({count, d - 3}), noise = (motion.noise / options_.lbfgs.noise_sigma).clone().set_requires_grad(true);
      Tensor frame = zeros({d}), state = zeros({now_.state.size(0)}), shift = zeros({3});
      const Tensor base_rest = motion.states.squeeze(1).narrow(1, 3, d - 3), at_start = torch::tensor({now_.x, now_.y, now_.heading}, torch::kDouble).to(number_);
      const Tensor base_path = path_of(motion, at_start);
      const Carried from = now_;

      const auto start = [&] {
        if (!free) return from;
        // The step that led to frame 0 was not measured and stays what it was; the others move as those of frame 1 do.
        const Tensor moved = torch::cat({frame.narrow(0, 0, 3) * 0.1, frame.narrow(0, 3, d - 3) * rest_scale[0]});
        Carried c = model_.behind(torch::cat({from.frame.narrow(0, 0, d) + moved, from.frame.narrow(0, d, kBits)}), from.state + 0.1 * state);
        c.speed = from.speed;
        return c;
      };
      const auto placed = [&] { return free ? at_start + shift * path_scale[0] : at_start; };
      const auto moved = [&](const Tensor& begins) {
        const Tensor p = base_path + path * path_scale, last = torch::cat({begins.unsqueeze(0), p.narrow(0, 0, count - 1)}, 0), step = p - last;
        const Tensor c = last.select(1, 2).cos(), s = last.select(1, 2).sin(), x = step.select(1, 0), y = step.select(1, 1);
        const Tensor steps = (torch::stack({c * x + s * y, c * y - s * x, step.select(1, 2)}, 1) - mean.narrow(0, 0, 3)) / deviation.narrow(0, 0, 3);
        return Motion{torch::cat({steps, base_rest + rest * rest_scale}, 1).unsqueeze(1), options_.lbfgs.noise_sigma * noise, motion.contacts};
      };
      // The model counts from the origin; here it is put where the start is.
      const auto see = [&](Carried begin, const Motion& candidate, const Tensor& begins) {
        begin.x = begin.y = begin.heading = 0;
        Seen seen = model_(begin, candidate);
        const Tensor c = begins[2].cos(), s = begins[2].sin(), x = seen.root.select(2, 0), y = seen.root.select(2, 1);
        seen.root = torch::stack({begins[0] + c * x - s * y, begins[1] + s * x + c * y}, 2);
        seen.heading = seen.heading + begins[2];
        return seen;
      };
      const auto raw_start = [&](const Carried& begin, const Tensor& begins) {
        const Tensor x = begin.shown.narrow(0, 0, d) * deviation + mean;
        return torch::cat({begins.narrow(0, 0, 2), x.narrow(0, 3, 1), begins.narrow(0, 2, 1), x.narrow(0, 4, d - 4)});
      };
      const auto objective_of = [&](const Carried& begin, const Tensor& begins) {
        const Tensor sum = total(see(begin, moved(begins), begins), terms).sum();
        if (!free) return sum;
        const Tensor seen_0 = raw_start(begin, begins), off = m0.trust[0] * (seen_0 - torch::cat({m0.root, m0.heading.unsqueeze(1), m0.angles}, 1)[0]).square();
        const Tensor beside = 0.5 * r * off.narrow(0, 0, 3).sum() + 0.5 * a * off.narrow(0, 3, d - 3).sum();
        return sum + beside + 0.5 * begin.frame.narrow(0, 0, d).square().sum() + 0.5 * (begin.state - prior_state).square().sum();
      };

      std::vector<Tensor> unknown = {path, rest, noise};
      if (free) unknown.insert(unknown.end(), {frame, state, shift});
      const double begun = lbfgs(unknown, options_.lbfgs, [&] { return objective_of(start(), placed()); });

      const torch::NoGradGuard no_grad;
      const Carried begin = start();
      const Tensor begins = placed();
      const double ended = objective_of(begin, begins).item<double>();
      if (run == 0) result.before = begun;
      if (ended < begun) {
        motion = moved(begins);
        motion = {motion.states.detach().clone(), motion.noise.detach().clone(), motion.contacts};
        if (free) {
          now_ = begin;
          now_.frame = begin.frame.detach().clone();
          now_.state = begin.state.detach().clone();
          now_.shown = begin.shown.detach().clone();
          now_.x = begins[0].item<double>();
          now_.y = begins[1].item<double>();
          now_.heading = begins[2].item<double>();
        }
      } else if (!(ended <= begun) && !std::isfinite(begun)) {
        refuse({{}, 0, "clip " + clip_.name}, "an objective that is not finite, expected motion like what the model was trained on");
      }
      result.after = std::min(begun, ended);
      const Tensor found = torch::tensor({now_.x, now_.y, now_.heading}, torch::kDouble).to(number_);
      const Seen seen = see(now_, motion, found);
      const Tensor features = seen.features.squeeze(1);
      bool changed = judge(first + 1, torch::cat({seen.root.squeeze(1), features.narrow(1, 3, 1), seen.heading, features.narrow(1, 4, d - 4)}, 1), m);
      if (free) changed = judge(first, raw_start(now_, found).unsqueeze(0), m0) || changed;
      result.motion = motion;
      result.rows = seen.rows.squeeze(1).to(torch::kFloat);
      const Tensor contacts = model_.contacts_of(seen);
      if (!changed && torch::equal(contacts, motion.contacts)) break;
      if (run + 1 < options_.lbfgs.rereads) motion.contacts = contacts;
    }
    return result;
  }

  // Places and headings that the steps lead to, (T, 3).
  Tensor path_of(const Motion& motion, const Tensor& start) const {
    const Tensor x = (motion.states.squeeze(1).to(torch::kDouble) * deviation_ + mean_).narrow(1, 0, 3), turns = x.select(1, 2), s0 = start.to(torch::kDouble);
    const Tensor heading = s0[2] + turns.cumsum(0), before = heading - turns, c = before.cos(), s = before.sin();
    return torch::stack({s0[0] + (c * x.select(1, 0) - s * x.select(1, 1)).cumsum(0), s0[1] + (s * x.select(1, 0) + c * x.select(1, 1)).cumsum(0), heading}, 1).to(number_);
  }

  const MotionModel& model_;
  const Terms& terms_;
  const MapSettings& settings_;
  const PlanOptions& options_;
  const Clip& clip_;
  torch::Dtype number_;
  Tensor mean_, deviation_;
  Values values_;
  std::vector<double> limit_;  // of each group: distance beyond which it is left out
  Suspects suspects_;          // whose marks change
  Marks candidates_;           // as they were at first
  Eigen::ArrayXXd off_;
  features::FeatureMatrix guess_;
  Eigen::RowVectorXd start_values_;
  std::vector<std::array<std::uint8_t, 2>> contacts_;
  Carried now_;                // in the frame of place_
  features::Placement place_;
  Tensor overlap_noise_;
};

}  // namespace

void MapSettings::validate() const {
  for (const auto& [name, value] : {std::pair{"sigma_root", sigma_root}, {"sigma_angle", sigma_angle}, {"outlier_sigmas", outlier_sigmas}})
    if (!(value > 0) || !std::isfinite(value)) refuse_usage(fmt::format("{} is {}, expected a number above 0", name, value));
}

MapDenoised denoise_map(const MotionModel& model, const Terms& terms, const MapSettings& settings, const PlanOptions& options, const Clip& clip) {
  settings.validate();
  options.validate();
  const Where where{{}, 0, "clip " + clip.name};
  if (!clip.skeleton) refuse(where, "no skeleton, expected the model's");
  train::check_alike(*clip.skeleton, clip.frame_rate_hz, model.reference(), where, "the model");
  if (clip.frames() < 2) refuse(where, fmt::format("{} frames, expected at least 2", clip.frames()), "motion-select --min-seconds leaves such clips out");
  return Problem(model, terms, settings, options, clip).solve();
}

}  // namespace mocap::control
