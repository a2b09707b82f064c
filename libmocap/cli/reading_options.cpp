#include "libmocap/cli/reading_options.hpp"

#include <filesystem>

#include "libmocap/base/log.hpp"
#include "libmocap/cli/validators.hpp"
#include "libmocap/formats/rate_rules.hpp"
#include "libmocap/io/body_model.hpp"

namespace mocap::cli {

void ReadingOptions::add(CLI::App& app) {
  app.add_option("--unit", unit_, "length unit of the input; auto goes by the ASF or the length of the legs; cmu is 1/0.45 inch")
      ->check(one_of({"auto", "m", "dm", "cm", "mm", "in", "cmu"}));
  app.add_option("--up", up_, "axis that points up in the input; auto goes by the rest pose")->check(one_of({"auto", "y", "z"}));
  app.add_option("--first-frame", first_frame_, "keep or drop a first frame that is a calibration pose; auto drops it where it is one")
      ->check(one_of({"auto", "keep", "drop"}));
  app.add_flag("--lenient", lenient_, "keep the whole frames of a file whose rows or frame count do not fit, with a warning");
  app.add_option("--fps-override", rates_, "tab-separated table: pattern, rate; the rate of files whose label or path a shell pattern fits")->check(path("FILE.tsv"));
  app.add_option("--asf", asf_, "skeleton of AMC files; else each one's is looked for beside it: the same name, its beginning up to a '_', or the only one")
      ->check(path("FILE"));
}

formats::ReadOptions ReadingOptions::options() const {
  formats::ReadOptions o;
  o.unit = unit_ == "m"     ? Unit::metre
           : unit_ == "dm"  ? Unit::decimetre
           : unit_ == "cm"  ? Unit::centimetre
           : unit_ == "mm"  ? Unit::millimetre
           : unit_ == "in"  ? Unit::inch
           : unit_ == "cmu" ? Unit::cmu
                            : Unit::automatic;
  o.up = up_ == "y" ? UpAxis::y : up_ == "z" ? UpAxis::z : UpAxis::automatic;
  o.first_frame = first_frame_ == "keep" ? FirstFrame::keep : first_frame_ == "drop" ? FirstFrame::drop : FirstFrame::automatic;
  o.lenient = lenient_;
  if (!rates_.empty()) o.rates = formats::RateRules::read(rates_);
  o.asf = asf_;
  return o;
}

void ReadingOptions::report(const formats::MotionInput& input, const std::string& label) {
  for (const auto& note : input.notes()) log::debug("{}: {}", label, note);
  for (const auto& doubt : input.doubts()) log::warn("{}: {}", label, doubt);
}

std::vector<HistoryInput> ReadingOptions::files(const formats::ReadOptions& options) {
  std::vector<HistoryInput> out;
  const auto add = [&](const std::string& path, const std::string& sha256) { out.push_back({std::filesystem::path(path).filename().string(), sha256}); };
  if (options.rates) add(options.rates->path(), options.rates->sha256());
  if (options.body_model) add(options.body_model->path(), options.body_model->sha256());
  return out;
}

void ReadingOptions::report_unused(const formats::ReadOptions& options, const Context& context) {
  if (!options.rates) return;
  const auto level = context.common().shard.empty() ? log::Level::warning : log::Level::debug;
  for (const auto& rule : options.rates->unused())
    log::write(level, fmt::format("{}:{}: the pattern '{}' set no file's rate", options.rates->path(), rule.line, rule.pattern));
}

}  // namespace mocap::cli
