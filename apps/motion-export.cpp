// motion-export - motion as other programs read it: BVH or AMASS-layout npz, one file per clip.
#include <fmt/core.h>
#include <unistd.h>

#include "libmocap/cli/clip_outputs.hpp"
#include "libmocap/cli/tool.hpp"
#include "libmocap/cli/validators.hpp"
#include "libmocap/clip/world_frame.hpp"
#include "libmocap/formats/motion_input.hpp"
#include "libmocap/io/bvh.hpp"
#include "libmocap/io/npz.hpp"

namespace {

using namespace mocap;

// The inverse of to_metres_z_up: lengths in `unit_m` metres, and with `y_up` the axes (x,y,z) -> (y,z,x), a cyclic
// permutation, so that a figure facing +X with Z up faces +Z with Y up. Rotations turn with the axes.
Clip in_axes_of_file(Clip clip, double unit_m, bool y_up) {
  const auto turn = [&](const Vector3& v) -> Vector3 { return y_up ? Vector3(v.y(), v.z(), v.x()) : v; };
  const auto place = [&](Vector3& v) { v = turn(v) / unit_m; };
  auto skeleton = std::make_shared<Skeleton>(*clip.skeleton);
  for (auto& offset : skeleton->rest_offsets) place(offset);
  for (auto& site : skeleton->end_sites) place(site.offset);
  for (auto& p : clip.root_position) place(p);
  for (auto& p : clip.translations) place(p);
  for (auto& q : clip.rotations) {
    const Vector3 v = turn(q.vec());
    q = Quaternion(q.w(), v.x(), v.y(), v.z());
  }
  clip.skeleton = std::move(skeleton);
  return clip;
}

class Export final : public cli::Tool {
 public:
  std::string name() const override { return "motion-export"; }
  std::string synopsis() const override { return "Write the clips of motion archives as BVH or AMASS-layout npz, one file per clip"; }
  std::string description() const override {
    return "BVH files have the archive's skeleton with its End Sites and open in Blender and elsewhere. npz files have the AMASS SMPL+H layout "
           "(canonical body only; always metres, Z up). It is installed as `export` too, a name that every shell takes for its own builtin unless it is called by its path.";
  }
  std::vector<cli::Example> examples() const override {
    return {{"motion-export samples.h5 -o bvh/", "every clip of an archive as BVH: Y up, centimetres"},
            {"motion-export samples.h5 --format npz -o amass/", "for tools that read AMASS"},
            {"sample -m model.h5 -n 1 -o - | motion-export - --up z --unit m -o walk.bvh", "one clip from a pipe to one file"}};
  }
  std::vector<std::string> references() const override {
    return {"Mahmood et al. 2019, AMASS: archive of motion capture as surface shapes (npz layout)"};
  }
  cli::Traits traits() const override {
    cli::Traits t;
    t.inputs = cli::Inputs::many;
    t.output = cli::Output::file_or_folder;
    t.batch = true;
    t.input_help = "motion archives, BVH or npz";
    t.output_help = "folder for one file per clip, or one file that ends in .bvh or .npz; '-' writes standard output and takes one clip";
    return t;
  }
  void options(CLI::App& app) override {
    format_option_ = app.add_option("--format", format_, "file format; without it the ending of -o decides, otherwise bvh")->check(cli::one_of({"bvh", "npz"}));
    bvh_options_ = {
        app.add_option("--up", up_, "axis that points up (bvh)")->check(cli::one_of({"y", "z"})),
        app.add_option("--unit", unit_, "length unit (bvh)")->check(cli::one_of({"cm", "m", "mm", "in"})),
        app.add_option("--order", order_, "rotation channels, outermost first (bvh)")->check(cli::one_of({"XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX"})),
    };
  }

  Exit run(cli::Context& context) override {
    const std::string& output = context.common().output;
    if (format_option_->count() == 0 && output.ends_with(".npz")) format_ = "npz";
    if (output.ends_with(format_ == "npz" ? ".bvh" : ".npz")) refuse_usage(fmt::format("-o {}: expected a name that fits --format {}", output, format_));
    for (const CLI::Option* option : bvh_options_)
      if (format_ == "npz" && option->count() > 0) refuse_usage(option->get_name() + ": an option of bvh, npz is always metres, Z up");
    cli::ClipOutputs outputs(context, "." + format_);
    if (output == "-" && format_ == "npz") check_output(output, context.overwrite());
    return context.for_each<Opened>(
        [&](const cli::InputFile& file) {
          Opened o;
          o.input = formats::open_motion(file.path, file.label);
          o.entry = context.history_entry({{file.label, o.input->sha256()}});
          o.archive = o.input->format() == "archive";
          if (!o.archive) o.bytes = to_bytes(o, o.input->read(0));
          return o;
        },
        [&](const cli::InputFile& file, Opened&& o) {
          if (!o.archive) return publish(context, outputs, o, outputs.path_for(file), o.bytes);
          const std::size_t clips = o.input->size();
          if (outputs.one_file() && clips != 1)
            refuse_usage(fmt::format("{}: {} clips for one output, expected a folder to write to", file.label, clips));
          for (std::size_t i = 0; i < clips; ++i) {
            const Clip clip = o.input->read(i);
            publish(context, outputs, o, outputs.path_for(file, clip.name), to_bytes(o, clip));
          }
        });
  }

 private:
  struct Opened {
    std::unique_ptr<formats::MotionInput> input;
    HistoryEntry entry;
    bool archive = false;
    std::string bytes;  // of a file of one clip, made on the worker thread; archives are converted clip by clip
  };

  std::string to_bytes(const Opened& o, const Clip& clip) const {
    if (format_ == "npz") {
      History history = o.input->history();
      history.push_back(o.entry);
      return io::format_npz(io::to_amass_layout(clip, history));
    }
    const double unit_m = unit_ == "m" ? 1.0 : metres_per(unit_ == "mm" ? Unit::millimetre : unit_ == "in" ? Unit::inch : Unit::centimetre);
    io::BvhWriteOptions options;
    options.order = order_;
    return io::format_bvh(in_axes_of_file(clip, unit_m, up_ == "y"), options);
  }

  void publish(cli::Context& context, const cli::ClipOutputs& outputs, const Opened& o, const std::string& path, const std::string& bytes) const {
    if (format_ == "npz") {
      const auto read = [](const std::string& existing) { return io::parse_motion_npz(read_file(existing)).history; };
      if (context.up_to_date(path, o.entry, read)) return;
    } else if (context.common().skip_existing && path != "-" && ::access(path.c_str(), F_OK) == 0) {
      // BVH carries no history: the text itself tells, and another text may be somebody's work.
      if (read_file(path) == bytes) return;
      if (!context.common().force) throw Error(Exit::io, {path, 0, {}}, "exists already with other content", "use -f to replace it");
    }
    outputs.write(context, path, bytes, format_ == "bvh");
  }

  std::string format_ = "bvh", up_ = "y", unit_ = "cm", order_ = "ZYX";
  CLI::Option* format_option_ = nullptr;
  std::vector<CLI::Option*> bvh_options_;
};

}  // namespace

int main(int argc, char** argv) { return mocap::cli::run<Export>(argc, argv); }
