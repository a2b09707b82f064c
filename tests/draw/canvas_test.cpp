#include "libmocap/draw/canvas.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>

#include "libmocap/base/error.hpp"
#include "tests/base/temporary_folder.hpp"
#include "tests/draw/picture.hpp"

namespace mocap::draw {
namespace {

using testing::Picture;

constexpr Color kRed{1, 0, 0}, kWhite{1, 1, 1};

// What Debian's Python says of a file: the output of `expression` with the bytes as `data`.
std::string python(const std::string& bytes, const std::string& expression) {
  testing::TemporaryFolder folder;
  testing::put(folder / "f", bytes);
  testing::put(folder / "p.py", "import sys, zlib, xml.etree.ElementTree as xml\ndata = open(sys.argv[1], 'rb').read()\nprint(" + expression + ", end='')\n");
  EXPECT_EQ(std::system(("/usr/bin/python3 " + (folder / "p.py") + " " + (folder / "f") + " > " + (folder / "out")).c_str()), 0);
  return testing::slurp(folder / "out");
}

TEST(ImageFormat, FollowsTheEnding) {
  EXPECT_EQ(image_format_of("a.png"), ImageFormat::png);
  EXPECT_EQ(image_format_of("folder.svg/a.PNG"), ImageFormat::png);
  EXPECT_EQ(image_format_of("a.svg"), ImageFormat::svg);
  EXPECT_EQ(image_format_of("-"), ImageFormat::png);
  for (const char* name : {"a.jpg", "png", "", "a.svgz", "a.png.bak"}) {
    try {
      image_format_of(name);
      ADD_FAILURE() << name;
    } catch (const Error& e) {
      EXPECT_EQ(e.status(), Exit::usage);
    }
  }
}

TEST(Canvas, DrawsWhereItIsTold) {
  Canvas c(ImageFormat::png, 100, 50);
  c.line({10, 25}, {90, 25}, kRed, 4);
  c.disc({50, 10}, 5, {0, 0, 1});
  c.rectangle({0, 40}, {20, 10}, {0, 1, 0});
  const Picture p(c.finish());
  ASSERT_TRUE(p.valid());
  EXPECT_EQ(p.width(), 100);
  EXPECT_EQ(p.height(), 50);
  EXPECT_TRUE(p.is({50, 25}, kRed));
  EXPECT_TRUE(p.is({50, 28}, kWhite));
  EXPECT_TRUE(p.is({50, 10}, {0, 0, 1}));
  EXPECT_TRUE(p.is({50, 17}, kWhite));
  EXPECT_TRUE(p.is({10, 45}, {0, 1, 0}));
  EXPECT_TRUE(p.is({99, 49}, kWhite));
}

TEST(Canvas, RefusesSizesThatCannotBe) {
  for (const double side : {0.0, -1.0, 0.5, 32001.0, 1e300, std::nan("")}) {
    EXPECT_THROW(Canvas(ImageFormat::png, side, 100), Error) << side;
    EXPECT_THROW(Canvas(ImageFormat::svg, 100, side), Error) << side;
  }
}

TEST(Canvas, AnyBytesCanBeWritten) {
  for (const ImageFormat format : {ImageFormat::png, ImageFormat::svg}) {
    Canvas c(format, 600, 100);
    for (const std::string text : {"plain", "Läufer 走", "\xff\xfe broken", "cut \xe2\x80", "line\nbreak", "\xed\xa0\x80 surrogate", "", "\xc0\xaf"})
      c.text({10, 50}, text, 12, kRed);
    EXPECT_NO_THROW(c.finish());
  }
}

TEST(Canvas, AlignsTextByItsWidth) {
  Canvas c(ImageFormat::png, 300, 60);
  const double width = c.text_width("HHHH", 20);
  EXPECT_GT(width, 20);
  EXPECT_GT(c.text_width("HHHH", 20, true), 0);
  c.text({200, 40}, "HHHH", 20, kRed, Align::right);
  const Picture p(c.finish());
  int left = 300, right = 0;
  for (int x = 0; x < 300; ++x)
    for (int y = 0; y < 60; ++y)
      if (!p.is({x, y}, kWhite)) {
        left = std::min(left, x);
        right = std::max(right, x);
      }
  EXPECT_LE(right, 200);
  EXPECT_NEAR(left, 200 - width, 5);
}

TEST(Canvas, ShortensTextToFit) {
  Canvas c(ImageFormat::png, 100, 100);
  EXPECT_EQ(c.fitting("short", 12, 500), "short");
  const std::string cut = c.fitting("a rather long caption that cannot fit", 12, 80);
  EXPECT_LE(c.text_width(cut, 12), 80);
  EXPECT_EQ(cut.substr(cut.size() - 3), "\xe2\x80\xa6");
  EXPECT_EQ(cut.substr(0, 3), "a r");
  EXPECT_EQ(c.fitting("x", 12, 0), "");
  EXPECT_LE(c.text_width(c.fitting(std::string(1000000, 'w'), 12, 300), 12), 300);
  const std::string umlauts = c.fitting("\xc3\xa4\xc3\xa4\xc3\xa4\xc3\xa4\xc3\xa4\xc3\xa4\xc3\xa4\xc3\xa4\xc3\xa4\xc3\xa4", 12, 50);
  EXPECT_GT(umlauts.size(), 3u);
  EXPECT_EQ(umlauts.size() % 2, 1u);  // whole characters and three bytes of ellipsis
}

TEST(Canvas, EqualCallsGiveEqualBytes) {
  for (const ImageFormat format : {ImageFormat::png, ImageFormat::svg}) {
    const auto draw = [&] {
      Canvas c(format, 200, 100);
      c.text({10, 20}, "same", 14, kRed, Align::left, true);
      c.polyline({{0, 0}, {50, 70}, {100, 20}}, {0, 0, 1}, 3, 4);
      return c.finish("a description");
    };
    const std::string first = draw();
    Canvas between(format, 10, 10);  // cairo counts surfaces
    EXPECT_EQ(draw(), first);
  }
}

TEST(Canvas, DescriptionTravelsInThePng) {
  const std::string text = "{\"a\": \"\xc3\xa4 <&>\"}\nline two";
  Canvas c(ImageFormat::png, 20, 20);
  const std::string bytes = c.finish(text);
  EXPECT_TRUE(Picture(bytes).valid());
  // Chunk by chunk: length, type, body, CRC.
  testing::TemporaryFolder folder;
  testing::put(folder / "f.png", bytes);
  testing::put(folder / "p.py", R"(
import struct, sys, zlib
data = open(sys.argv[1], 'rb').read()
assert data[:8] == b'\x89PNG\r\n\x1a\n'
at, kinds = 8, []
while at < len(data):
    length, kind = struct.unpack('>I4s', data[at:at + 8])
    body = data[at + 8:at + 8 + length]
    assert struct.unpack('>I', data[at + 8 + length:at + 12 + length])[0] == zlib.crc32(kind + body)
    kinds.append(kind)
    if kind == b'iTXt':
        keyword, flag, method, language, translated, text = body[:11], body[12], body[13], body[14:15], body[15:16], body[16:]
        assert (keyword, body[11], flag, method, language, translated) == (b'Description', 0, 0, 0, b'\0', b'\0')
        sys.stdout.buffer.write(text)
    at += 12 + length
assert kinds[0] == b'IHDR' and kinds[-1] == b'IEND' and kinds.count(b'iTXt') == 1
)");
  ASSERT_EQ(std::system(("/usr/bin/python3 " + (folder / "p.py") + " " + (folder / "f.png") + " > " + (folder / "out")).c_str()), 0);
  EXPECT_EQ(testing::slurp(folder / "out"), text);
}

TEST(Canvas, SvgIsWellFormedAndCarriesTheDescription) {
  Canvas c(ImageFormat::svg, 120, 80);
  c.text({10, 20}, "a < b & c", 14, kRed);
  c.line({0, 0}, {50, 70}, kRed, 3);
  const std::string bytes = c.finish("one <two> & \"three\"");
  EXPECT_EQ(python(bytes, "xml.fromstring(data).tag"), "{http://www.w3.org/2000/svg}svg");
  EXPECT_EQ(python(bytes, "xml.fromstring(data).find('{*}metadata').text"), "one <two> & \"three\"");
  Canvas plain(ImageFormat::svg, 120, 80);
  EXPECT_EQ(python(plain.finish(), "xml.fromstring(data).find('{*}metadata')"), "None");
}

}  // namespace
}  // namespace mocap::draw
