// A tool with one option of each kind, and its parsed command line.
#pragma once
#include <string>
#include <vector>

#include "libmocap/cli/config_file.hpp"
#include "libmocap/cli/tool.hpp"
#include "libmocap/cli/validators.hpp"

namespace mocap::cli {

class Sample final : public Tool {
 public:
  std::string name() const override { return "sample-tool"; }
  std::string synopsis() const override { return "Do nothing"; }
  std::vector<Example> examples() const override { return {{"sample-tool x", "nothing"}}; }
  Traits traits() const override { return {}; }
  void options(CLI::App& app) override {
    app.add_option("--rate", rate, "rate | of things")->check(positive("HZ"));
    app.add_option("--count", count, "count")->check(whole(1));
    app.add_option("--attr", attr, "attribute")->allow_extra_args(false);
    app.add_option("--ramp", ramp, "from, to")->expected(2)->allow_extra_args(false)->check(between(0, 1));
    app.add_option("--labels", labels, "table")->check(path("FILE.tsv"));
    app.add_option("--report", report, "report")->check(path());
    app.add_flag("--mirror,!--no-mirror", mirror, "mirror");
    app.add_option("-j,--threads", threads, "threads")->check(whole(1))->default_str("all usable cores");
    app.add_option("-o,--output", output, "output");
  }
  std::vector<std::string> non_content_options() const override { return {"--report"}; }
  Exit run(Context&) override { return Exit::ok; }

  double rate = 30;
  int count = 3, threads = 7;
  std::vector<std::string> attr;
  std::vector<double> ramp{0, 0.5};
  std::string labels, report, output;
  bool mirror = false;
};

struct Parsed {
  explicit Parsed(const std::vector<std::string>& args) {
    app.option_defaults()->always_capture_default();
    app.config_formatter(std::make_shared<ConfigFile>("sample-tool"));
    tool.options(app);
    app.parse(std::vector<std::string>(args.rbegin(), args.rend()));
  }
  std::vector<std::string> argv() const { return normalised_argv(app, tool, common); }
  CLI::App app;
  Sample tool;
  Common common;
};
using Strings = std::vector<std::string>;

}  // namespace mocap::cli
