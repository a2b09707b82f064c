#include "libmocap/draw/selection.hpp"

#include <gtest/gtest.h>

#include "libmocap/base/error.hpp"

namespace mocap::draw {
namespace {

using Numbers = std::vector<std::size_t>;

TEST(EvenlyChosen, SpreadsOverTheWhole) {
  EXPECT_EQ(evenly_chosen(3, 8), (Numbers{0, 1, 2}));
  EXPECT_EQ(evenly_chosen(10, 5), (Numbers{0, 2, 4, 6, 8}));
  EXPECT_EQ(evenly_chosen(7, 3), (Numbers{0, 2, 4}));
  EXPECT_EQ(evenly_chosen(0, 3), Numbers{});
  EXPECT_EQ(evenly_chosen(5, 1), Numbers{0});
}

TEST(ClipsNamed, ByNameOrNumberFromOne) {
  const std::vector<std::string> names = {"walk", "3", "run"};
  EXPECT_EQ(clips_named(names, {"run", "1", "walk"}), (Numbers{2, 0, 0}));
  EXPECT_EQ(clips_named(names, {"3"}), Numbers{1});  // a name goes before a number
  for (const char* wanted : {"0", "4", "jump", "-1", "1x", "", "99999999999999999999999"}) {
    try {
      clips_named(names, {wanted});
      ADD_FAILURE() << wanted;
    } catch (const Error& e) {
      EXPECT_EQ(e.status(), Exit::usage);
      EXPECT_NE(std::string(e.what()).find("1 to 3"), std::string::npos);
    }
  }
}

Numbers flat(const std::vector<Pair>& pairs) {
  Numbers out;
  for (const auto& p : pairs) {
    out.push_back(p.first);
    out.push_back(p.second);
  }
  return out;
}

TEST(PairByAttributes, TakesTheFirstOfEachCombinationBothHave) {
  const std::vector<Attributes> real = {{{"action", "walk"}, {"gender", "f"}, {"subject", "1"}}, {{"action", "run"}, {"gender", "m"}, {"subject", "2"}},
                                        {{"action", "run"}, {"gender", "m"}, {"subject", "3"}}, {{"action", "jump"}, {"gender", "f"}, {"subject", "1"}}};
  const std::vector<Attributes> sampled = {{{"action", "run"}, {"gender", "f"}}, {{"action", "walk"}, {"gender", "f"}}, {{"action", "run"}, {"gender", "m"}}};
  EXPECT_EQ(flat(pair_by_attributes(real, sampled)), (Numbers{1, 2, 0, 1}));
}

TEST(PairByAttributes, IgnoresEmptyValuesAndUnlabelledClips) {
  const std::vector<Attributes> real = {{}, {{"action", ""}}, {{"action", "walk"}, {"style", ""}}};
  const std::vector<Attributes> sampled = {{{"action", "walk"}, {"style", "x"}}};
  EXPECT_EQ(flat(pair_by_attributes(real, sampled)), (Numbers{2, 0}));
}

TEST(PairByAttributes, WithoutCommonAttributesPairsByPosition) {
  EXPECT_EQ(flat(pair_by_attributes({{}, {}, {{"a", "1"}}}, {{{"b", "1"}}, {}})), (Numbers{0, 0, 1, 1}));
  EXPECT_TRUE(pair_by_attributes({{{"a", "1"}}}, {{{"a", "2"}}}).empty());
  EXPECT_TRUE(pair_by_attributes({}, {{}}).empty());
}

}  // namespace
}  // namespace mocap::draw
