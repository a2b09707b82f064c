// bvh2npz - mocap files to npz, one per clip, source skeleton and frame rate kept.
#include <fmt/core.h>

#include "libmocap/base/log.hpp"
#include "libmocap/cli/clip_outputs.hpp"
#include "libmocap/cli/reading_options.hpp"
#include "libmocap/cli/tool.hpp"
#include "libmocap/formats/motion_input.hpp"
#include "libmocap/io/npz.hpp"

namespace {

using namespace mocap;

class Bvh2Npz final : public cli::Tool {
 public:
  std::string name() const override { return "bvh2npz"; }
  std::string synopsis() const override { return "Convert motion files to npz, one per clip, in metres with Z up"; }
  std::string description() const override {
    return "Reads BVH, AMC with its ASF, npz and motion archives and writes NumPy files that keep the skeleton and the frame rate of the source: poses (axis-angle, "
           "radians), trans (metres), joint_names, parents, rest_offsets, rates and the history. numpy.load reads them.";
  }
  std::vector<cli::Example> examples() const override {
    return {{"bvh2npz walk.bvh -o walk.npz", "one file"},
            {"bvh2npz cmu/ -o npz/ --rejects rejects.tsv", "a folder with its subfolders; files that cannot be read in a table"},
            {"zcat walk.bvh.gz | bvh2npz - --up y --unit cm -o - > walk.npz", "as a filter, with unit and axis given"}};
  }
  std::vector<std::string> references() const override {
    return {"Mahmood et al. 2019, AMASS: archive of motion capture as surface shapes (names of the arrays)"};
  }
  cli::Traits traits() const override {
    cli::Traits t;
    t.inputs = cli::Inputs::many;
    t.output = cli::Output::file_or_folder;
    t.batch = true;
    t.input_help = "BVH, AMC, npz or motion archives";
    t.output_help = "folder for one file per clip, or one file that ends in .npz; '-' writes standard output and takes one clip";
    return t;
  }
  void options(CLI::App& app) override { reading_.add(app); }

  Exit run(cli::Context& context) override {
    cli::ClipOutputs outputs(context, ".npz");
    if (context.common().output == "-") check_output("-", context.overwrite());  // a terminal is refused before any work
    const formats::ReadOptions reading = reading_.options();
    const std::vector<HistoryInput> option_files = cli::ReadingOptions::files(reading);
    const Exit status = context.for_each<Opened>(
        [&](const cli::InputFile& file) {
          Opened o;
          o.input = formats::open_motion(file.path, file.label, reading);
          std::vector<HistoryInput> inputs = option_files;
          inputs.push_back({file.label, o.input->sha256()});
          for (auto& companion : o.input->companions()) inputs.push_back(std::move(companion));
          o.entry = context.history_entry(std::move(inputs));
          o.archive = o.input->format() == "archive";
          if (!o.archive) o.bytes = to_npz(o, o.input->read(0));
          return o;
        },
        [&](const cli::InputFile& file, Opened&& o) {
          const auto publish = [&](const std::string& path, const std::string& bytes) {
            if (!context.up_to_date(path, o.entry, read_history)) outputs.write(context, path, bytes);
          };
          cli::ReadingOptions::report(*o.input, file.label);
          if (!o.archive) return publish(outputs.path_for(file), o.bytes);
          const std::size_t clips = o.input->size();
          if (outputs.one_file() && clips != 1)
            refuse_usage(fmt::format("{}: {} clips for one output, expected a folder to write to", file.label, clips));
          for (std::size_t i = 0; i < clips; ++i) {
            const Clip clip = o.input->read(i);
            publish(outputs.path_for(file, clip.name), to_npz(o, clip));
          }
        });
    cli::ReadingOptions::report_unused(reading, context);
    return status;
  }

 private:
  struct Opened {
    std::unique_ptr<formats::MotionInput> input;
    HistoryEntry entry;
    bool archive = false;
    std::string bytes;  // of a file of one clip, made on the worker thread; archives are converted clip by clip
  };

  static std::string to_npz(const Opened& o, const Clip& clip) {
    History history = o.input->history();
    history.push_back(o.entry);
    return io::format_npz(io::to_source_layout(clip, history));
  }
  static History read_history(const std::string& path) { return io::parse_motion_npz(read_file(path)).history; }

  cli::ReadingOptions reading_;
};

}  // namespace

int main(int argc, char** argv) { return mocap::cli::run<Bvh2Npz>(argc, argv); }
