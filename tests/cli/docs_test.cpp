#include "libmocap/cli/docs.hpp"

#include <gtest/gtest.h>

#include "libmocap/cli/progress.hpp"
#include "libmocap/cli/usage_error.hpp"
#include "sample_tool.hpp"

namespace mocap::cli {
namespace {

TEST(Docs, ShowUnitsDefaultsAndNothingOfTheMachine) {
  Parsed p({});
  std::vector<std::string> none;
  p.app.add_option("INPUT", none, "an input");
  const auto page = [](const std::string& text) { return [text](const std::string& part) { return text.find(part) != std::string::npos; }; };
  const auto markdown = page(markdown_page(p.tool, p.app)), help = page(help_text(p.tool, p.app)), man = page(man_page(p.tool, p.app));
  EXPECT_TRUE(markdown("| `--rate HZ` | rate \\| of things; a number above 0 [default: 30] |"));
  EXPECT_TRUE(markdown("[default: all usable cores]"));
  EXPECT_FALSE(markdown("default: 7"));
  EXPECT_TRUE(help("--attr TEXT"));
  EXPECT_TRUE(help("; repeatable"));
  EXPECT_TRUE(markdown("; 2 values [default: [0,0.5]] |"));
  EXPECT_TRUE(man("\\fB\\-\\-labels FILE.tsv\\fR"));
}

TEST(Usage, TheNearestOptionIsNamed) {
  const Parsed p({});
  EXPECT_EQ(nearest_option(p.app, "--ratr"), "--rate");
  EXPECT_EQ(nearest_option(p.app, "--conut=3"), "--count");
  EXPECT_EQ(nearest_option(p.app, "--wavelength"), "");
  EXPECT_EQ(nearest_option(p.app, "-x"), "");
}

TEST(ProgressText, RateAndTimeLeft) {
  EXPECT_EQ(progress_text(123, 2500, "files", 45.25), "123/2500 files, 45.2 files/s, 0:53 left");
  EXPECT_EQ(progress_text(1, 10000, "steps", 1.0), "1/10000 steps, 1.0 steps/s, 2:46:39 left");
  EXPECT_EQ(progress_text(0, 10, "files", 0), "0/10 files, 0.0 files/s, -:-- left");
}

}  // namespace
}  // namespace mocap::cli
