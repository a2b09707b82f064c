#include <gtest/gtest.h>

#include "folder.hpp"
#include "sample_tool.hpp"

namespace mocap::cli {
namespace {

TEST(Provenance, DefaultsAreEffectiveValues) { EXPECT_EQ(Parsed({}).argv(), (Strings{"sample-tool", "--count=3", "--ramp=0", "--ramp=0.5", "--rate=30"})); }

TEST(Provenance, SpellingAndOrderDoNotMatter) {
  const Strings expected{"sample-tool", "--attr=b=1", "--attr=a=2", "--count=4", "--labels=l.tsv", "--mirror", "--ramp=0.1", "--ramp=1", "--rate=25"};
  EXPECT_EQ(Parsed({"--ramp", "0.10", "1", "--rate", "25.0", "--mirror", "--attr", "b=1", "--attr", "a=2", "--labels", "/data/x/l.tsv", "--count", "4"}).argv(), expected);
  EXPECT_EQ(Parsed({"--count=4", "--attr=b=1", "--labels=l.tsv", "--attr=a=2", "--rate=2.5e1", "--ramp=1e-1", "1.0", "--mirror"}).argv(), expected);
}

TEST(Provenance, WhatDoesNotChangeContentIsLeftOut) {
  EXPECT_EQ(Parsed({"-j", "9", "-o", "out", "--report", "r.txt", "--no-mirror"}).argv(), (Strings{"sample-tool", "--count=3", "--mirror=false", "--ramp=0", "--ramp=0.5", "--rate=30"}));
}

TEST(Provenance, SameWorkLooksAtTheLastCommandOnly) {
  HistoryEntry now{"t", "1", "c", {"t", "--a=1"}, 1, {{"x", "00"}}};
  EXPECT_FALSE(same_work({}, now));
  HistoryEntry older = now;
  older.version = "0";
  older.commit = "d";
  EXPECT_TRUE(same_work({{"before", "1", "c", {"before"}, {}, {}}, older}, now));
  EXPECT_FALSE(same_work({older, {"after", "1", "c", {"after"}, {}, {}}}, now));
  for (int change = 0; change < 5; ++change) {
    HistoryEntry other = now;
    if (change == 0) other.argv.back() = "--a=2";
    if (change == 1) other.seed = 2;
    if (change == 2) other.inputs[0].sha256 = "01";
    if (change == 3) other.inputs.push_back({"y", "00"});
    if (change == 4) other.tool = "u";
    EXPECT_FALSE(same_work({other}, now)) << change;
  }
}

TEST(Provenance, ARerunReplacesOnlyItsOwnOutputs) {
  const Folder folder;
  folder.file("out", "x");
  Parsed p({});
  p.common.skip_existing = true;
  Context context(p.tool, p.app, p.common);
  const HistoryEntry now = context.history_entry({{"x", "00"}});
  HistoryEntry changed = now;
  changed.inputs[0].sha256 = "01";
  EXPECT_TRUE(context.up_to_date("out", now, [&](const std::string&) { return History{now}; }));
  EXPECT_FALSE(context.up_to_date("out", now, [&](const std::string&) { return History{changed}; }));
  EXPECT_FALSE(context.up_to_date("absent", now, [&](const std::string&) -> History { throw std::logic_error("not read"); }));
  EXPECT_THROW(context.up_to_date("out", now, [](const std::string&) { return History{}; }), Error);
  EXPECT_THROW(context.up_to_date("out", now, [](const std::string&) -> History { throw Error(Exit::data, {}, "damaged"); }), Error);
  p.common.force = true;
  EXPECT_FALSE(Context(p.tool, p.app, p.common).up_to_date("out", now, [](const std::string&) { return History{}; }));
}

}  // namespace
}  // namespace mocap::cli
