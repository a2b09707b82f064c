// steer - make motion that obeys speeds and directions as they come.
#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <numbers>

#include "libmocap/base/error.hpp"
#include "libmocap/base/log.hpp"
#include "libmocap/cli/tool.hpp"
#include "libmocap/cli/validators.hpp"
#include "libmocap/formats/steering_commands.hpp"
#include "libmocap/metrics/clip_figures.hpp"
#include "libmocap/skeleton/forward_kinematics.hpp"
#include "libmocap/store/archive.hpp"
#include "libmodels/control/steering.hpp"
#include "libmodels/nn/blas.hpp"
#include "libmodels/tools/control_options.hpp"

namespace {

using namespace mocap;

constexpr double kMostSeconds = 24 * 3600.0;

double percentile(std::vector<double> values, double share) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  std::sort(values.begin(), values.end());
  return values[std::min(values.size() - 1, static_cast<std::size_t>(std::ceil(share * static_cast<double>(values.size()))) - (share > 0 ? 1 : 0))];
}

nlohmann::json number_or_null(double x) { return std::isfinite(x) ? nlohmann::json(x) : nlohmann::json(); }

class Steer final : public cli::Tool {
 public:
  std::string name() const override { return "steer"; }
  std::string synopsis() const override { return "Make motion that obeys commands of speed and direction as they come"; }
  std::string description() const override {
    return "A command is a line `time speed heading`: seconds, m/s, degrees counter-clockwise from +X; it counts from the first window on that begins at its time or later. Time is that of the motion, never the clock: the "
           "same lines give the same motion, and the tool waits for a line that it has to know. Lines that are empty or start with # are passed over; a malformed one is named by its number and ends the run, or is skipped with --lenient. "
           "The motion ends --tail seconds after the last command. Without -o, frames are written to standard output as CSV as soon as their window is found: the time, then the places of all joints in metres (or their "
           "rotations), then the contacts. How fast it went is told on standard error: frames a second, and how long windows took.";
  }
  std::vector<cli::Example> examples() const override {
    return {{"printf '0 1.2 0\\n4 1.2 90\\n8 2.8 90\\n' | steer -m lstm.h5 - -o steered.h5", "walk, turn left, run"},
            {"my-joystick | steer -m lstm.h5 --refiner refiner.h5 - | my-viewer", "live: every window is written as soon as it is found"},
            {"steer -m lstm.h5 commands.txt -o steered.h5 --json", "how each command was obeyed"}};
  }
  std::vector<std::string> references() const override { return {"Wang, Chai, Xia 2018, section 5.3"}; }
  cli::Traits traits() const override {
    cli::Traits t;
    t.inputs = cli::Inputs::one;
    t.output = cli::Output::file;
    t.output_required = false;
    t.random = true;
    t.report = true;
    t.network = true;
    t.input_help = "lines of commands; '-' for standard input";
    t.output_help = "motion archive instead of CSV on standard output; '-' writes it to standard output";
    return t;
  }
  std::vector<std::string> version_lines() const override { return {nn::compute_libraries()}; }
  std::vector<std::string> non_content_options() const override { return {"--columns"}; }

  void options(CLI::App& app) override {
    auto& plan = control_.plan();
    plan.window = 20;
    plan.overlap = 10;
    plan.swarm.particles = 48;
    plan.swarm.spread = 0.5;
    plan.swarm.rounds = 0;
    plan.lbfgs.iterations = 20;
    plan.lbfgs.rereads = 1;
    control_.add_models(app);
    app.add_flag("--lenient", lenient_, "skip malformed lines with a warning");
    app.add_option("--tail", tail_, "for which the last command goes on")->check(cli::non_negative("SECONDS"))->capture_default_str();
    app.add_option("--columns", columns_, "of the CSV: places of the joints in the world (m), or the root's place and local rotations (wxyz)")->check(cli::one_of({"positions", "rotations"}))->capture_default_str();
    app.add_option("--speed-sigma", settings_.speed_sigma, "deviation of a window's mean speed from the command's")->check(cli::positive("MPS"))->capture_default_str();
    app.add_option("--direction-sigma", settings_.direction_sigma, "deviation of the heading at its end")->check(cli::positive("RADIANS"))->capture_default_str();
    app.add_option("--turn-limit", turn_limit_, "fastest turn that is asked for")->check(cli::positive("DEGREES/S"))->capture_default_str();
    control_.add_search(app);
  }

  Exit run(cli::Context& context) override {
    nn::use_one_blas_thread();
    const cli::InputFile& input = context.inputs().at(0);
    const std::string output = context.common().output;
    if (input.path == "-" && (control_.generator() == "-" || control_.refiner() == "-")) refuse_usage("commands and a model both from standard input, expected one of them to be a file");
    if (context.common().json && (output.empty() || output == "-")) refuse_usage("--json needs -o FILE: frames are written to standard output");
    auto plan = control_.plan();
    plan.seed = context.seed();
    plan.swarm.threads = context.threads();
    plan.validate();
    settings_.turn_limit = turn_limit_ * std::numbers::pi / 180;
    const auto models = control_.load();
    std::optional<control::MotionModel> model;
    try {
      model.emplace(models.generator, models.refines());
    } catch (const Error& e) {
      throw e.in_file(models.refiner ? control_.refiner() : control_.generator());
    }
    formats::SteeringCommandReader reader(input.path, lenient_);
    std::vector<control::Command> commands;
    auto ahead = reader.next();
    if (!ahead) refuse({input.path == "-" ? "<stdin>" : input.path, 0, {}}, "0 commands, expected at least one line of time, speed and heading");
    control::Command now = *ahead;

    const double rate = model->reference().frame_rate_hz;
    const control::Terms terms = control_.terms(*model);
    control::Terms first = terms;
    first.push_back(control::speed_term(now.speed, settings_.speed_sigma));
    control::Carried start = control::best_start(*model, *models.sampler, models.generator.starts, 0, 0, now.heading, first, plan);
    control::Shown shown(model->reference(), start);
    control::Steering steering(*model, *models.sampler, std::move(start), terms, settings_, plan);
    if (output.empty()) context.print(head(*model->reference().skeleton));

    std::vector<double> latencies;
    std::int64_t frames = 1;  // found so far
    std::optional<std::int64_t> end;
    Clip clip;
    const auto took_from = std::chrono::steady_clock::now();
    double waited = 0;
    while (!end || frames < *end) {
      const double time = static_cast<double>(frames - 1) / rate;
      const auto wait_from = std::chrono::steady_clock::now();
      // Whatever is asked for by now has to be known, and so whether anything comes later.
      while (ahead && ahead->time <= time) {
        now = *ahead;
        commands.push_back(now);
        ahead = reader.next();
        if (!ahead) end = 1 + std::llround((now.time + tail_) * rate);
      }
      if (time > kMostSeconds) refuse({input.path == "-" ? "<stdin>" : input.path, 0, {}}, "commands of more than a day");
      if (end && frames >= *end) break;
      const auto from = std::chrono::steady_clock::now();
      waited += std::chrono::duration<double>(from - wait_from).count();
      const control::Planned planned = steering.next(now);
      const std::int64_t kept = std::min(planned.rows.size(0), end ? *end - frames : planned.rows.size(0));
      shown.add(planned.rows.narrow(0, 0, kept));
      frames += kept;
      const Clip piece = shown.piece();
      if (output.empty()) {
        context.print(rows(piece, frames - static_cast<std::int64_t>(piece.frames()), rate));
        std::fflush(stdout);
      } else {
        append(clip, piece);
      }
      latencies.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - from).count());
    }
    const double took = std::chrono::duration<double>(std::chrono::steady_clock::now() - took_from).count() - waited;
    if (latencies.empty()) {  // --tail 0 after one command at 0: the start alone
      const Clip piece = shown.piece();
      if (output.empty())
        context.print(rows(piece, 0, rate));
      else
        append(clip, piece);
    }
    log::info("{} frames, {:.1f} a second; windows took {:.0f} ms in the median, {:.0f} ms at the 99th percentile", frames, static_cast<double>(frames - 1) / took, 1000 * percentile(latencies, 0.5), 1000 * percentile(latencies, 0.99));
    if (reader.skipped() > 0) log::warn("{} malformed lines were skipped", reader.skipped());
    if (output.empty()) return Exit::ok;

    store::ArchiveHeader header;
    header.skeleton = model->reference().skeleton;
    header.frame_rate_hz = rate;
    header.contacts_rule = "model";
    header.history = models.history;
    std::vector<HistoryInput> inputs = {{input.label, reader.sha256()}};
    inputs.insert(inputs.end(), models.inputs.begin(), models.inputs.end());
    header.history.push_back(context.history_entry(std::move(inputs)));
    store::ArchiveWriter writer(output, context.overwrite(), header);
    clip.name = "steered";
    writer.add(clip);
    writer.finish();
    if (context.common().json) context.print(report(clip, commands, latencies, static_cast<double>(frames - 1) / took).dump(1) + "\n");
    return Exit::ok;
  }

 private:
  std::string head(const Skeleton& s) const {
    std::string line = "time_s";
    const bool rotations = columns_ == "rotations";
    if (rotations) line += ",root_x,root_y,root_z";
    for (const auto& joint : s.joint_names)
      for (const char axis : std::string_view(rotations ? "wxyz" : "xyz")) line += fmt::format(",{}_{}", joint, axis);
    return line + ",left_contact,right_contact\n";
  }

  std::string rows(const Clip& piece, std::int64_t first, double rate) const {
    std::string text;
    Pose pose;
    for (std::size_t t = 0; t < piece.frames(); ++t) {
      text += fmt::format("{:.6g}", static_cast<double>(first + static_cast<std::int64_t>(t)) / rate);
      const auto joints = static_cast<std::size_t>(piece.skeleton->joint_count());
      const auto local = std::span(piece.rotations).subspan(t * joints, joints);
      if (columns_ == "rotations") {
        const auto& p = piece.root_position[t];
        text += fmt::format(",{:.5f},{:.5f},{:.5f}", p.x(), p.y(), p.z());
        for (const auto& q : local) text += fmt::format(",{:.6f},{:.6f},{:.6f},{:.6f}", q.w(), q.x(), q.y(), q.z());
      } else {
        forward_kinematics(*piece.skeleton, local, piece.root_position[t], pose);
        for (const Vector3& p : pose.positions) text += fmt::format(",{:.5f},{:.5f},{:.5f}", p.x(), p.y(), p.z());
      }
      text += fmt::format(",{},{}\n", piece.contacts[t][0], piece.contacts[t][1]);
    }
    return text;
  }

  static void append(Clip& clip, const Clip& piece) {
    if (!clip.skeleton) {
      clip = piece;
      return;
    }
    clip.rotations.insert(clip.rotations.end(), piece.rotations.begin(), piece.rotations.end());
    clip.root_position.insert(clip.root_position.end(), piece.root_position.begin(), piece.root_position.end());
    clip.contacts.insert(clip.contacts.end(), piece.contacts.begin(), piece.contacts.end());
  }

  static nlohmann::json report(const Clip& clip, const std::vector<control::Command>& commands, const std::vector<double>& latencies, double frames_per_second) {
    nlohmann::json list = nlohmann::json::array();
    const auto obeyed = control::obeyed(clip, commands);
    for (std::size_t i = 0; i < commands.size(); ++i)
      list.push_back({{"time_s", commands[i].time},
                      {"speed_mps", commands[i].speed},
                      {"heading_deg", commands[i].heading * 180 / std::numbers::pi},
                      {"settled_s", obeyed[i].settled_s ? nlohmann::json(*obeyed[i].settled_s) : nlohmann::json()},
                      {"reached_speed_mps", obeyed[i].speed},
                      {"reached_heading_deg", obeyed[i].heading * 180 / std::numbers::pi}});
    const auto figures = metrics::clip_figures(clip);
    return {{"frames", clip.frames()},
            {"frames_per_second", frames_per_second},
            {"window_latency_median_s", number_or_null(percentile(latencies, 0.5))},
            {"window_latency_p99_s", number_or_null(percentile(latencies, 0.99))},
            {"skate_mps", number_or_null(figures.skate_mps)},
            {"contact_speed_mps", number_or_null(figures.contact_speed_mps)},
            {"commands", list}};
  }

  tools::ControlOptions control_;
  control::SteeringSettings settings_;
  bool lenient_ = false;
  double tail_ = 3, turn_limit_ = 140;
  std::string columns_ = "positions";
};

}  // namespace

int main(int argc, char** argv) { return mocap::cli::run<Steer>(argc, argv); }
