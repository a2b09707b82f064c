#include <fcntl.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include "libmocap/base/error.hpp"
#include "libmocap/base/output_file.hpp"
#include "tests/base/temporary_folder.hpp"

namespace mocap {
namespace {

using testing::put;
using testing::TemporaryFolder;

std::string gzip(const std::string& text) {
  z_stream z{};
  EXPECT_EQ(deflateInit2(&z, 6, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY), Z_OK);
  std::string out(deflateBound(&z, text.size()) + 32, '\0');
  z.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(text.data()));
  z.avail_in = static_cast<uInt>(text.size());
  z.next_out = reinterpret_cast<Bytef*>(out.data());
  z.avail_out = static_cast<uInt>(out.size());
  EXPECT_EQ(deflate(&z, Z_FINISH), Z_STREAM_END);
  out.resize(z.total_out);
  deflateEnd(&z);
  return out;
}

// Not compressible, longer than zlib's and the reader's blocks.
std::string noise(std::size_t size) {
  std::string s(size, '\0');
  std::uint32_t x = 1;
  for (char& c : s) c = static_cast<char>((x = x * 1664525 + 1013904223) >> 24);
  return s;
}

class ReadFile : public ::testing::Test {
 protected:
  std::string read(const std::string& bytes, std::size_t limit = 1u << 30) {
    put(folder_ / "f", bytes);
    return read_file(folder_ / "f", limit);
  }
  void expect_refused(const std::string& bytes, std::size_t limit = 1u << 30) {
    try {
      read(bytes, limit);
      ADD_FAILURE() << "nothing thrown";
    } catch (const Error& e) {
      EXPECT_EQ(e.status(), Exit::data);
      EXPECT_EQ(e.where().file, folder_ / "f");
    }
  }
  TemporaryFolder folder_;
};

TEST_F(ReadFile, PlainBytesComeBackAsTheyAre) {
  for (const std::string& text : {std::string(), std::string("x"), std::string("\x1f", 1), noise(600000)}) EXPECT_EQ(read(text), text);
}

TEST_F(ReadFile, GzipIsExpandedByContent) {
  for (const std::string& text : {std::string(), std::string("x"), noise(1 << 18), noise((1 << 18) + 1), std::string(5000000, 'a')})
    EXPECT_EQ(read(gzip(text)), text);
}

TEST_F(ReadFile, GzipMembersInARowAreOneText) {
  EXPECT_EQ(read(gzip("one ") + gzip("") + gzip("two")), "one two");
  const std::string a = noise(1 << 18), b = noise(300000);
  EXPECT_EQ(read(gzip(a) + gzip(b)), a + b);
}

TEST_F(ReadFile, EveryTruncationOfGzipIsRefused) {
  const std::string packed = gzip("a short text, compressed once");
  for (std::size_t n = 2; n < packed.size(); ++n) expect_refused(packed.substr(0, n));
  const std::string large = gzip(noise(700000));
  for (const std::size_t n : {large.size() - 1, large.size() - 8, large.size() / 2}) expect_refused(large.substr(0, n));
  expect_refused(gzip("one") + packed.substr(0, 20));
}

TEST_F(ReadFile, DamagedGzipIsRefused) {
  std::string packed = gzip(noise(1000));
  packed[500] = static_cast<char>(packed[500] ^ 1);
  expect_refused(packed);
  expect_refused(gzip("text") + "rubbish behind it");
}

TEST_F(ReadFile, LimitsBoundThePlainAndTheExpandedSize) {
  EXPECT_EQ(read(std::string(100, 'a'), 100).size(), 100u);
  expect_refused(std::string(101, 'a'), 100);
  EXPECT_EQ(read(gzip(std::string(100000, 'a')), 100000).size(), 100000u);
  expect_refused(gzip(std::string(100001, 'a')), 100000);
}

TEST_F(ReadFile, ASparseGiantIsRefusedWithoutMemoryForIt) {
  put(folder_ / "f", "");
  std::filesystem::resize_file(folder_ / "f", std::uintmax_t{1} << 42);
  try {
    read_file(folder_ / "f");
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.status(), Exit::data);
  }
}

TEST_F(ReadFile, MissingFilesAndFoldersAreRefused) {
  for (const std::string& path : {folder_ / "absent", folder_.path(), folder_ / "absent/deeper"}) {
    try {
      read_file(path);
      FAIL();
    } catch (const Error& e) {
      EXPECT_EQ(e.status(), Exit::data);
      EXPECT_EQ(e.where().file, path);
    }
  }
}

TEST_F(ReadFile, StandardInputIsCalledSo) {
  put(folder_ / "f", gzip("from a pipe"));
  const int kept = ::dup(STDIN_FILENO), file = ::open((folder_ / "f").c_str(), O_RDONLY);
  ::dup2(file, STDIN_FILENO);
  EXPECT_EQ(read_file("-"), "from a pipe");
  put(folder_ / "f", "\x1f\x8b rubbish");
  ::lseek(STDIN_FILENO, 0, SEEK_SET);
  try {
    read_file("-");
    ADD_FAILURE();
  } catch (const Error& e) {
    EXPECT_EQ(e.where().file, "<stdin>");
  }
  ::dup2(kept, STDIN_FILENO);
  ::close(kept);
  ::close(file);
}

}  // namespace
}  // namespace mocap
