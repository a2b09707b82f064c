#include "libmocap/cli/validators.hpp"

#include <gtest/gtest.h>

namespace mocap::cli {
namespace {

std::string check(const CLI::Validator& validator, std::string text) { return validator(text); }

TEST(Validators, PlainDecimalNumbersOnly) {
  for (const char* text : {"0", "-1.5", "+2", ".5", "1e3", "1E-3", "010"}) EXPECT_TRUE(parse_number(text)) << text;
  EXPECT_DOUBLE_EQ(*parse_number("-1.5"), -1.5);
  EXPECT_DOUBLE_EQ(*parse_number("+2"), 2);
  for (const char* text : {"", "nan", "inf", "-inf", "infinity", "0x10", "1,5", "1.5 ", " 1", "1e400", "--1", "+-1", "1f", "1_000"})
    EXPECT_FALSE(parse_number(text)) << text;
}

TEST(Validators, WholeNumbersAreNotReadAsOctal) {
  EXPECT_EQ(parse_whole("0"), 0);
  EXPECT_EQ(parse_whole("-12"), -12);
  EXPECT_EQ(parse_whole("9223372036854775807"), 9223372036854775807);
  for (const char* text : {"", "-", "010", "-010", "0x10", "1.0", "1e3", "9223372036854775808", "1 ", "1,000"}) EXPECT_FALSE(parse_whole(text)) << text;
}

TEST(Validators, SayWhatWasFoundAndExpected) {
  EXPECT_EQ(check(positive("HZ"), "30"), "");
  EXPECT_EQ(check(positive("HZ"), "0"), "'0', expected a number above 0");
  EXPECT_EQ(check(positive("HZ"), "nan"), "'nan', expected a number above 0");
  EXPECT_EQ(check(non_negative(), "0"), "");
  EXPECT_EQ(check(non_negative(), "-1e-9"), "'-1e-9', expected a number of at least 0");
  EXPECT_EQ(check(between(0, 1), "1"), "");
  EXPECT_EQ(check(between(0, 1), "1.01"), "'1.01', expected a number from 0 to 1");
  EXPECT_EQ(check(number(), "1,5"), "'1,5', expected a number");
  EXPECT_EQ(check(whole(1, 64), "64"), "");
  EXPECT_EQ(check(whole(1, 64), "65"), "'65', expected a whole number from 1 to 64");
  EXPECT_EQ(check(whole(1), "0"), "'0', expected a whole number of at least 1");
  EXPECT_EQ(check(one_of({"y", "z"}), "z"), "");
  EXPECT_EQ(check(one_of({"y", "z"}), "Z"), "'Z', expected one of y, z");
  EXPECT_EQ(check(path(), ""), "an empty path");
}

}  // namespace
}  // namespace mocap::cli
