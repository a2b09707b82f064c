#include "libmocap/cli/config_file.hpp"

#include <gtest/gtest.h>

#include <sstream>

#include "sample_tool.hpp"

namespace mocap::cli {
namespace {

std::vector<CLI::ConfigItem> items(const std::string& text) {
  std::istringstream in(text);
  return ConfigFile("sample-tool").from_config(in);
}

TEST(ConfigFile, TomlAndIniForms) {
  const auto list = items("# comment\nrate = 25.5  # hz\nlabels = \"a # b, \\\"c\\\"\\\\\"\r\n\n; ini\nmirror\nattr = [\"x=1\", 'y\\z',\n  bare ] # end\n[other]\nrate = 1\n[sample-tool]\ncount=4");
  ASSERT_EQ(list.size(), 5u);
  EXPECT_EQ(list[0].name, "rate");
  EXPECT_EQ(list[0].inputs, Strings{"25.5"});
  EXPECT_EQ(list[1].inputs, Strings{"a # b, \"c\"\\"});
  EXPECT_EQ(list[2].name, "mirror");
  EXPECT_EQ(list[2].inputs, Strings{"true"});
  EXPECT_EQ(list[3].inputs, (Strings{"x=1", "y\\z", "bare"}));
  EXPECT_EQ(list[4].name, "count");
}

TEST(ConfigFile, RefusesWithTheLine) {
  const std::pair<const char*, long> cases[] = {{"\nrate =\n", 2},     {"a = \"x\n", 1},    {"a = 'x", 1},       {"a = 1\na = 2", 2}, {"[x\n", 1},
                                                {"a = [1, 2\n", 2},    {"a = \"x\" y", 1},  {"a = [1 2\n3]", 2}, {"a = \"\\q\"", 1},  {"a = [1,,2]", 1}};
  for (const auto& [text, line] : cases) {
    try {
      items(text);
      ADD_FAILURE() << text;
    } catch (const Error& e) {
      EXPECT_EQ(e.status(), Exit::usage) << text;
      EXPECT_NEAR(static_cast<double>(e.where().line), static_cast<double>(line), 1) << text << " " << e.what();
    }
  }
}

TEST(ConfigFile, TheEffectiveOptionsReadBackAsThemselves) {
  const Parsed p({"--rate", "1e1", "--attr", "a,b", "--attr", "c \"d#\\ ]", "--mirror"});
  const std::string text = effective_config(p.app, "sample-tool");
  EXPECT_EQ(text.find("threads"), std::string::npos);
  Strings args;
  for (const auto& item : items(text))
    for (const auto& value : item.inputs) args.push_back("--" + item.name + "=" + value);
  EXPECT_EQ(effective_config(Parsed(args).app, "sample-tool"), text);
  EXPECT_EQ(Parsed(args).tool.attr, p.tool.attr);
}

}  // namespace
}  // namespace mocap::cli
