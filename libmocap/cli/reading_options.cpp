#include "libmocap/cli/reading_options.hpp"

#include "libmocap/cli/validators.hpp"

namespace mocap::cli {

void ReadingOptions::add(CLI::App& app) {
  app.add_option("--unit", unit_, "length unit of the input; auto goes by the ASF or the length of the legs; cmu is 1/0.45 inch")
      ->check(one_of({"auto", "m", "cm", "mm", "in", "cmu"}));
  app.add_option("--up", up_, "axis that points up in the input; auto goes by the rest pose")->check(one_of({"auto", "y", "z"}));
  app.add_option("--first-frame", first_frame_, "keep or drop a first frame that is a calibration pose; auto drops it where it is one")
      ->check(one_of({"auto", "keep", "drop"}));
  app.add_flag("--lenient", lenient_, "keep the whole frames of a file whose rows or frame count do not fit, with a warning");
  app.add_option("--asf", asf_, "skeleton of AMC files; else each one's is looked for beside it: the same name, its beginning up to a '_', or the only one")
      ->check(path("FILE"));
}

formats::ReadOptions ReadingOptions::options() const {
  formats::ReadOptions o;
  o.unit = unit_ == "m"     ? Unit::metre
           : unit_ == "cm"  ? Unit::centimetre
           : unit_ == "mm"  ? Unit::millimetre
           : unit_ == "in"  ? Unit::inch
           : unit_ == "cmu" ? Unit::cmu
                            : Unit::automatic;
  o.up = up_ == "y" ? UpAxis::y : up_ == "z" ? UpAxis::z : UpAxis::automatic;
  o.first_frame = first_frame_ == "keep" ? FirstFrame::keep : first_frame_ == "drop" ? FirstFrame::drop : FirstFrame::automatic;
  o.lenient = lenient_;
  o.asf = asf_;
  return o;
}

}  // namespace mocap::cli
