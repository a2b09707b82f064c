#include "libmocap/base/history.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <memory>

#include "libmocap/base/error.hpp"
#include "tests/base/temporary_folder.hpp"

namespace mocap {
namespace {

History sample() {
  History h;
  h.push_back({"canonicalize", "0.1.0", "abc", {"canonicalize", "--fps=30", "it's; $(touch x)", ""}, std::nullopt, {{"walk 1.bvh", std::string(64, 'a')}, {"-", ""}}});
  h.push_back({"sample", "0.2.0", "def", {"sample", "--attr", "action=w\xc3\xa4lking"}, 0xffffffffffffffffULL, {}});
  return h;
}

TEST(History, RoundTripsThroughJsonLines) {
  const std::string text = to_json_lines(sample());
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 2);
  const History back = parse_history(text, "f");
  EXPECT_EQ(to_json_lines(back), text);
  ASSERT_EQ(back.size(), 2u);
  EXPECT_EQ(back[0].argv, sample()[0].argv);
  EXPECT_FALSE(back[0].seed.has_value());
  EXPECT_EQ(back[0].inputs[0].path, "walk 1.bvh");
  EXPECT_EQ(back[1].seed, 0xffffffffffffffffULL);
  EXPECT_EQ(back[1].commit, "def");
}

TEST(History, KeysHaveAFixedOrder) {
  EXPECT_EQ(to_json_lines({{"t", "1", "c", {"t"}, 5, {{"p", "s"}}}}),
            R"({"tool":"t","version":"1","commit":"c","argv":["t"],"seed":5,"inputs":[{"path":"p","sha256":"s"}]})" "\n");
}

TEST(History, EmptyTextIsAnEmptyHistory) {
  EXPECT_TRUE(parse_history("", "f").empty());
  EXPECT_TRUE(parse_history("\n\n", "f").empty());
  EXPECT_EQ(to_json_lines({}), "");
}

TEST(History, BytesThatAreNoUtf8BecomeReplacementMarks) {
  const std::string text = to_json_lines({{"t", "1", "c", {"\xff"}, std::nullopt, {}}});
  EXPECT_NE(text.find("\xef\xbf\xbd"), std::string::npos);
  EXPECT_NO_THROW(parse_history(text, "f"));
}

TEST(History, DamageIsRefusedNamingTheLine) {
  const std::string good = to_json_lines({{"t", "1", "c", {"t"}, std::nullopt, {}}});
  for (const std::string bad : {"{", "[]", "3", "null", "{}", R"({"tool":1,"version":"1","argv":[]})", R"({"tool":"t","version":"1","argv":"x"})",
                                R"({"tool":"t","version":"1","argv":[],"seed":"x"})", R"({"tool":"t","version":"1","argv":[],"inputs":[1]})",
                                R"({"tool":"t","version":"1","argv":[],"seed":-1})", R"({"tool":"t","version":"1","argv":[],"inputs":{"a":1}})",
                                R"({"tool":"t","version":"1"})", R"({"tool":"t","argv":[]})", R"({"version":"1","argv":[]})", R"({"tool":"t","version":"1","argv":[["x"]]})",
                                R"({"tool":"t","version":"1","argv":[3]})", R"({"tool":["t"],"version":"1","argv":[]})", R"({"tool":"t","version":"1","argv":[],"commit":null})",
                                R"({"tool":"t","version":"1","argv":[],"seed":1.5})", R"({"tool":"t","version":"1","argv":[],"seed":[1]})",
                                R"({"tool":"t","version":"1","argv":[],"inputs":[{"path":"p"}]})", R"({"tool":"t","version":"1","argv":[],"inputs":[{"path":"p","sha256":1}]})",
                                R"({"tool":"t","version":"1","argv":[]} x)", R"({"tool":"t","version":"1","argv":[])"}) {
    try {
      parse_history(good + bad + "\n", "file.h5");
      ADD_FAILURE() << bad;
    } catch (const Error& e) {
      EXPECT_EQ(e.status(), Exit::data);
      EXPECT_EQ(e.where().file, "file.h5");
      EXPECT_EQ(e.where().object, "history line 2") << bad;
    }
  }
}

// The script is what a shell makes of it: each argument arrives as it was, and nothing else is run.
TEST(History, ShellScriptPassesArgumentsUnchanged) {
  testing::TemporaryFolder folder;
  History h = sample();
  h[0].tool = "canonicalize\ntouch " + (folder / "injected");
  h[0].inputs[0].path = "a\ntouch " + (folder / "injected");
  h[0].version = "1\r\ntouch " + (folder / "injected");
  h[0].argv = {"printf", "<%s>", "it's; $(false)", "", "two\nlines", "a*", "plain-1.0"};
  h[1].argv = {"true"};
  testing::put(folder / "script", to_shell(h));
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(::popen(("sh " + (folder / "script")).c_str(), "r"), ::pclose);
  std::string out(1000, '\0');
  out.resize(std::fread(out.data(), 1, out.size(), pipe.get()));
  EXPECT_EQ(out, "<it's; $(false)><><two\nlines><a*><plain-1.0>");
  EXPECT_EQ(folder.names(), std::vector<std::string>{"script"});
}

TEST(History, WhatIsNotKnownIsPassedOver) {
  const History h = parse_history(R"({"new":{"tool":[1,{"path":null}]},"tool":"t","version":"1","argv":["t"],"inputs":[{"size":[3,{"path":2}],"path":"p","sha256":"s"}],"last":[[[]]]})" "\n", "f");
  ASSERT_EQ(h.size(), 1u);
  EXPECT_EQ(h[0].tool, "t");
  EXPECT_EQ(h[0].argv, std::vector<std::string>{"t"});
  ASSERT_EQ(h[0].inputs.size(), 1u);
  EXPECT_EQ(h[0].inputs[0].path, "p");
}

// The quick way to the inputs and the parser give the same: a blank after the colon sends a text down the other way.
TEST(History, InputsAreTheSameHoweverTheyAreRead) {
  for (const std::string path : {"a.bvh", "", "two words/#1 {x}.bvh", "],", "quoted \\\" end", "back\\\\slash", "l\xc3\xa4ufer", "\\u00e4"}) {
    const std::string head = R"({"tool":"t","version":"1","commit":"c","argv":["t","--x=,[{"],"seed":5,"inputs":)";
    const std::string inputs = "[{\"path\":\"" + path + "\",\"sha256\":\"s\"},{\"path\":\"b\",\"sha256\":\"\"}]}\n";
    std::string slow = head + inputs;
    slow.insert(slow.find("[{\"path"), " ");
    EXPECT_EQ(to_json_lines(parse_history(head + inputs, "f")), to_json_lines(parse_history(slow, "f"))) << path;
    EXPECT_EQ(parse_history(head + inputs, "f")[0].inputs.size(), 2u);
  }
  for (const std::string bad : {R"({"tool":"t","version":"1","argv":["t"]},"inputs":[{"path":"p","sha256":"s"}]})", R"({"tool":"t","version":"1","argv":["t","inputs":[{"path":"p","sha256":"s"}]})",
                                R"({"tool":"t","version":"1","argv":["t"],"inputs":[{"path":"p","sha256":"s"}])"})
    EXPECT_THROW(parse_history(bad, "f"), Error) << bad;
}

HistoryEntry entry(const std::string& tool, const std::vector<std::string>& inputs) {
  HistoryEntry e{tool, "1", "c", {tool}, std::nullopt, {}};
  for (const auto& i : inputs) e.inputs.push_back({i, "s"});
  return e;
}

std::string merged(const std::vector<History>& histories) {
  HistoryUnion all;
  for (const auto& h : histories) all.add(h);
  return to_json_lines(all.merged());
}

TEST(History, AUnionDoesNotDependOnOrderOrGrouping) {
  const std::vector<History> parts = {{entry("convert", {"c"}), entry("clean", {"c.npz"})}, {entry("convert", {"a"})}, {entry("record", {}), entry("convert", {"b", "a"})}, {}};
  const std::string all = merged(parts);
  EXPECT_EQ(all, to_json_lines({entry("record", {}), entry("convert", {"a", "b", "c"}), entry("clean", {"c.npz"})}));
  EXPECT_EQ(all, merged({parts[3], parts[2], parts[0], parts[1]}));
  HistoryUnion left, right;
  left.add(parts[0]), left.add(parts[2]), right.add(parts[1]);
  EXPECT_EQ(all, merged({right.merged(), left.merged()}));
}

TEST(History, AUnionKeepsWhatWasDoneTwice) {
  const History twice = {entry("smooth", {"a"}), entry("cut", {}), entry("smooth", {"b"})};
  EXPECT_EQ(merged({twice}), to_json_lines(twice));
  EXPECT_EQ(merged({twice, twice}), to_json_lines(twice));
  // Two histories that contradict each other still give one result.
  EXPECT_EQ(merged({{entry("a", {}), entry("b", {})}, {entry("b", {}), entry("a", {})}}), merged({{entry("b", {}), entry("a", {})}, {entry("a", {}), entry("b", {})}}));
}

}  // namespace
}  // namespace mocap
