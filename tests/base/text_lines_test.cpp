#include "libmocap/base/text_lines.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include "libmocap/base/error.hpp"
#include "libmocap/base/output_file.hpp"

namespace mocap {
namespace {

TEST(ReadLines, KeepsNumbersAndLeavesOutWhatIsBlank) {
  const std::string path = temporary_file("lines"), text = "\xef\xbb\xbf" "one\r\n\r\n\n two\nthree";
  write_file(path, text, Overwrite::allow);
  Digest digest{};
  const auto lines = read_lines(path, &digest);
  ::unlink(path.c_str());
  ASSERT_EQ(lines.size(), 3u);
  EXPECT_EQ(lines[0].text, "one");
  EXPECT_EQ(lines[0].number, 1);
  EXPECT_EQ(lines[1].text, " two");
  EXPECT_EQ(lines[1].number, 4);
  EXPECT_EQ(lines[2].text, "three");
  EXPECT_EQ(lines[2].number, 5);
  EXPECT_EQ(digest, sha256(text));
  EXPECT_THROW(read_lines(path), Error);
}

}  // namespace
}  // namespace mocap
