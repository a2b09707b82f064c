#include "libmodels/tools/control_options.hpp"

#include "libmocap/base/error.hpp"
#include "libmocap/cli/validators.hpp"
#include "libmodels/tools/history_input.hpp"

namespace mocap::tools {

void ControlOptions::add_models(CLI::App& app, bool generator_required, const std::string& model_help, const std::string& refiner_help) {
  CLI::Option* model = app.add_option("-m,--model", generator_, model_help)->check(cli::path());
  if (generator_required) model->required();
  app.add_option("--refiner", refiner_, refiner_help)->check(cli::path());
}

void ControlOptions::add_search(CLI::App& app, bool swarm) {
  app.add_option("--window", plan_.window, "frames looked for at a time")->check(cli::whole(2, 10000, "FRAMES"))->capture_default_str();
  app.add_option("--overlap", plan_.overlap, "of them looked for again by the next window")->check(cli::whole(0, 9999, "FRAMES"))->capture_default_str();
  if (swarm) {
    app.add_option("--particles", plan_.swarm.particles, "motions of the particle swarm that finds a start")->check(cli::whole(1, 100000, "MOTIONS"))->capture_default_str();
    app.add_option("--spread", plan_.swarm.spread, "deviation of the noise that they are first drawn with; 1: as the generator samples")->check(cli::positive("FACTOR"))->capture_default_str();
  app.add_option("--rounds", plan_.swarm.rounds, "moves of the swarm; 0: the best of the motions as they are drawn")->check(cli::whole(0, 100000, "MOVES"))->capture_default_str();
  }
  app.add_option("--iterations", plan_.lbfgs.iterations, "most iterations of each run of L-BFGS")->check(cli::whole(1, 100000, "ITERATIONS"))->capture_default_str();
  app.add_option("--rereads", plan_.lbfgs.rereads, "runs, before each of which contacts are read from the network")->check(cli::whole(1, 1000, "RUNS"))->capture_default_str();
  app.add_option("--noise-sigma", noise_sigma_, "deviation of the noise on the network's input, standardised")->check(cli::positive("DEVIATION"))->capture_default_str();
  app.add_option("--contact-sigma", contact_sigma_, "deviation of the way of a foot that is down from one frame to the next")->check(cli::positive("METRES"))->capture_default_str();
  app.add_option("--height-sigma", height_sigma_, "deviation of its height from where feet rest")->check(cli::positive("METRES"))->capture_default_str();
}

control::Terms ControlOptions::terms(const control::MotionModel& model) const {
  return {control::prior(), control::noise_prior(noise_sigma_), control::contact_term(contact_sigma_, height_sigma_, model.rest_height())};
}

ControlOptions::Models ControlOptions::load() const {
  if (generator_ == "-" && refiner_ == "-") refuse_usage("-m - and --refiner -: expected one of them to be a file");
  Models m;
  std::string digest;
  const store::ModelFile file = store::read_model(generator_, &digest);
  m.generator = lstm_gmm::read(file, generator_);
  m.history = file.history;
  m.inputs.push_back(history_input(generator_, digest));
  m.sampler = std::make_unique<lstm_gmm::Sampler>(*m.generator.network);
  if (!refiner_.empty()) {
    const store::ModelFile other = store::read_model(refiner_, &digest);
    m.refiner = refiner::read(other, refiner_);
    m.inputs.push_back(history_input(refiner_, digest));
  }
  return m;
}

int ControlOptions::joint(const Skeleton& skeleton, const std::string& name) {
  for (std::size_t j = 0; j < skeleton.joint_names.size(); ++j)
    if (skeleton.joint_names[j] == name) return j == 0 ? -1 : static_cast<int>(j);
  std::string list;
  for (const auto& joint : skeleton.joint_names) list += (list.empty() ? "" : ", ") + joint;
  refuse_usage("no joint '" + name + "', expected one of " + list);
}

}  // namespace mocap::tools
