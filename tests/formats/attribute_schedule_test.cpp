#include "libmocap/formats/attribute_schedule.hpp"

#include <gtest/gtest.h>

#include "libmocap/base/error.hpp"
#include "libmocap/base/output_file.hpp"
#include "tests/base/temporary_folder.hpp"

namespace mocap::formats {
namespace {

AttributeSchedules read(const std::string& text) {
  const testing::TemporaryFolder folder;
  write_file(folder / "s.tsv", text, Overwrite::allow);
  return AttributeSchedules::read(folder / "s.tsv");
}

std::string refusal(const std::string& text) {
  try {
    (void)read(text);
  } catch (const Error& e) {
    EXPECT_EQ(e.status(), Exit::data);
    const std::string what = e.what();
    return what.substr(what.find("s.tsv"));
  }
  return "accepted";
}

TEST(AttributeSchedules, EmptyCellsKeepTheValueBefore) {
  const auto s = read("\xef\xbb\xbf# by hand\r\nstart\taction\tgender\r\n0\twalking\t\n\n2.5\tjogging\tmale\n4\t\tfemale\n");
  EXPECT_EQ(s.attributes(), (std::vector<std::string>{"action", "gender"}));
  EXPECT_EQ(s.header_line(), 2);
  EXPECT_EQ(s.sha256().size(), 64u);
  ASSERT_EQ(s.all().size(), 1u);
  const auto& rows = s.all()[0].rows;
  ASSERT_EQ(rows.size(), 3u);
  EXPECT_EQ(s.all()[0].clip, "");
  EXPECT_FALSE(s.all()[0].end_s);
  EXPECT_EQ(rows[0].attributes, (Attributes{{"action", "walking"}}));
  EXPECT_EQ(rows[1].start_s, 2.5);
  EXPECT_EQ(rows[1].line, 5);
  EXPECT_EQ(rows[2].attributes, (Attributes{{"action", "jogging"}, {"gender", "female"}}));
}

TEST(AttributeSchedules, SeveralClipsMayBeMixed) {
  const auto s = read("clip\tend\tstart\taction\nb\t1\t0\tx\na\t\t0\ty\nb\t3.5\t1\ty\na\t2\t1\tx\n");
  ASSERT_EQ(s.all().size(), 2u);
  EXPECT_EQ(s.all()[0].clip, "b");
  EXPECT_EQ(s.all()[0].end_s, 3.5);
  EXPECT_EQ(s.all()[0].rows[1].attributes.at("action"), "y");
  EXPECT_EQ(s.all()[1].end_s, 2);
}

TEST(AttributeSchedules, Refusals) {
  const std::string h = "start\tend\taction\n";
  EXPECT_EQ(refusal(""), "s.tsv: an empty table, expected a header line with a column 'start'");
  EXPECT_EQ(refusal(h), "s.tsv: a table without rows, expected one that starts at 0");
  EXPECT_EQ(refusal("time\taction\n"), "s.tsv:1: a header without a column 'start', expected tab-separated names with 'start' among them");
  EXPECT_EQ(refusal("start\tend\n"), "s.tsv:1: a header without a column for an attribute, expected one at least");
  EXPECT_EQ(refusal("start\taction\taction\n"), "s.tsv:1: a header with two columns 'action'");
  EXPECT_EQ(refusal("start\t\taction\n"), "s.tsv:1: a header with a column without a name");
  EXPECT_EQ(refusal(h + "0\t1\n"), "s.tsv:2: 2 columns, expected 3 as in the header");
  EXPECT_EQ(refusal(h + "0.5\t1\tx\n"), "s.tsv:2: a gap: the first row starts at 0.5 s, expected 0");
  EXPECT_EQ(refusal(h + "0\t1\tx\n\n2\t3\ty\n"), "s.tsv:4: a gap: a start at 2 s, expected the 1 s at which line 2 ends");
  EXPECT_EQ(refusal(h + "0\t3\tx\n2\t4\ty\n"), "s.tsv:3: a start at 2 s, before line 2 ends at 3 s");
  EXPECT_EQ(refusal(h + "0\t\tx\n2\t\ty\n1\t\tx\n"), "s.tsv:4: a start at 1 s, expected one after the 2 s of line 3");
  EXPECT_EQ(refusal(h + "0\t\tx\n0\t\ty\n"), "s.tsv:3: a start at 0 s, expected one after the 0 s of line 2");
  EXPECT_EQ(refusal(h + "0\t0\tx\n"), "s.tsv:2: an end that is not after the start");
  for (const char* time : {"", "x", "-1", "nan", "1e999", "1s"}) EXPECT_EQ(refusal(h + time + "\t\tx\n"), "s.tsv:2:start: '" + std::string(time) + "', expected seconds");
  EXPECT_EQ(refusal("clip\tstart\taction\n\t0\tx\n"), "s.tsv:2:clip: an empty name, expected that of the clip");
  EXPECT_EQ(refusal("clip\tstart\taction\na\t0\tx\nb\t1\tx\n"), "s.tsv:3: a gap: the first row of b starts at 1 s, expected 0");
  EXPECT_EQ(refusal(h + "0\t1\tx\n1\t\ty\n"), "accepted");
}

}  // namespace
}  // namespace mocap::formats
