#include "libmocap/draw/scatter.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <functional>
#include <set>

#include "libmocap/base/error.hpp"
#include "tests/base/temporary_folder.hpp"
#include "tests/draw/picture.hpp"

namespace mocap::draw {
namespace {

using testing::Picture;

constexpr Color kWhite{1, 1, 1};

Scatter square() {
  Scatter s;
  s.title = "Läufer & <Springer>";
  s.x_label = "across";
  s.y_label = "up";
  s.legend = "action";
  s.circles = "real";
  s.crosses = "generated";
  s.groups = {"walking", "absent", "running"};
  s.points = {{0, 0, 0, Mark::circle}, {2, 0, 2, Mark::cross}, {2, 2, -1, Mark::circle}, {0, 2, 2, Mark::cross}};
  return s;
}

TEST(Scatter, MarksLieWhereTheyBelong) {
  const ScatterOptions o{700, 500, 8};
  const auto places = scatter_places(square(), o);
  ASSERT_EQ(places.size(), 4u);
  // One scale, y up.
  EXPECT_NEAR(places[1].x() - places[0].x(), places[1].y() - places[2].y(), 1e-9);
  EXPECT_GT(places[1].x(), places[0].x() + 100);
  EXPECT_LT(places[3].y(), places[0].y() - 100);
  const Picture p(scatter(square(), o, ImageFormat::png));
  ASSERT_TRUE(p.valid());
  EXPECT_EQ(p.width(), 700);
  EXPECT_EQ(p.height(), 500);
  // A circle is open, a cross is filled at its centre and empty beside it.
  EXPECT_TRUE(p.is(places[0], kWhite));
  EXPECT_TRUE(p.is(places[0] + Vector2(8, 0), group_color(0)));
  EXPECT_TRUE(p.is(places[0] + Vector2(0, -8), group_color(0)));
  EXPECT_TRUE(p.is(places[1], group_color(2)));
  EXPECT_TRUE(p.is(places[1] + Vector2(5, 5), group_color(2)));
  EXPECT_TRUE(p.is(places[1] + Vector2(5, -5), group_color(2)));
  EXPECT_TRUE(p.is(places[1] + Vector2(8, 0), kWhite));
  EXPECT_TRUE(p.is(places[2] + Vector2(8, 0), group_color(-1)));
  // The legend has what occurs: two groups and none.
  EXPECT_GT(p.count(group_color(0)), 60);
  EXPECT_EQ(p.count(group_color(1)), 0);
  EXPECT_GT(p.count(group_color(-1)), 60);
}

TEST(Scatter, CrossesOfOtherOrderLieOnTop) {
  Scatter s = square();
  s.points = {{0, 0, 0, Mark::cross}, {0, 0, 2, Mark::cross}, {1, 1, 0, Mark::circle}};
  const Picture p(scatter(s, {700, 500, 8}, ImageFormat::png));
  EXPECT_TRUE(p.is(scatter_places(s, {700, 500, 8})[0], group_color(2)));
}

TEST(Scatter, OnePointAndOneLineStayInside) {
  for (const auto& points : {std::vector<ScatterPoint>{{5, 5, 0, Mark::circle}}, {{1, 7, 0, Mark::circle}, {1, 9, 0, Mark::circle}}, {{-1e300, 1, 0, Mark::circle}, {1e300, 1, 0, Mark::cross}}, {{1e-300, 0, 0, Mark::circle}, {0, 0, 0, Mark::cross}}}) {
    Scatter s = square();
    s.points = points;
    for (const Vector2& at : scatter_places(s, {700, 500, 4})) {
      EXPECT_GE(at.x(), 16 + 4);
      EXPECT_LE(at.x(), 700 - 16 - 4);
      EXPECT_GE(at.y(), 54 + 4);
      EXPECT_LE(at.y(), 500 - 32 - 4);
    }
    EXPECT_TRUE(Picture(scatter(s, {700, 500, 4}, ImageFormat::png)).valid());
  }
}

TEST(Scatter, ColoursDiffer) {
  std::set<std::array<double, 3>> seen;
  for (int g = -1; g < 30; ++g) {
    const Color c = group_color(g);
    EXPECT_TRUE(seen.insert({c.red, c.green, c.blue}).second) << g;
    for (const double v : {c.red, c.green, c.blue}) EXPECT_TRUE(v >= 0 && v <= 1);
    EXPECT_LT(0.2126 * c.red + 0.7152 * c.green + 0.0722 * c.blue, 0.85) << "too pale on white: " << g;
  }
  EXPECT_EQ(group_color(30).red, group_color(0).red);
}

// What Debian's Python says of an SVG: the output of `expression`, with `root` its tree.
std::string python(const std::string& svg, const std::string& expression) {
  testing::TemporaryFolder folder;
  testing::put(folder / "f", svg);
  testing::put(folder / "p.py", "import sys, xml.etree.ElementTree as xml\nroot = xml.fromstring(open(sys.argv[1], 'rb').read())\nprint(" + expression + ", end='')\n");
  EXPECT_EQ(std::system(("/usr/bin/python3 " + (folder / "p.py") + " " + (folder / "f") + " > " + (folder / "out")).c_str()), 0);
  return testing::slurp(folder / "out");
}

TEST(Scatter, SvgIsWellFormedAndHoldsEveryMark) {
  const std::string svg = scatter(square(), {700, 500, 4}, ImageFormat::svg, "a <history> & more");
  EXPECT_EQ(python(svg, "root.tag + ' ' + root.get('viewBox')"), "{http://www.w3.org/2000/svg}svg 0 0 700 500");
  EXPECT_EQ(python(svg, "root.find('{http://www.w3.org/2000/svg}metadata').text"), "a <history> & more");
  // Strokes: 2 rings and 2 crosses of two lines, and one of each in the legend.
  EXPECT_EQ(python(svg, "sum(1 for e in root.iter('{http://www.w3.org/2000/svg}path') if 'fill:none' in e.get('style'))"), "9");
  EXPECT_EQ(svg, scatter(square(), {700, 500, 4}, ImageFormat::svg, "a <history> & more"));
}

TEST(Scatter, LegendEndsWhereThePageDoes) {
  Scatter s = square();
  s.groups.clear();
  for (int g = 0; g < 60; ++g) {
    s.groups.push_back("a class with a long name, number " + std::to_string(g));
    s.points.push_back({static_cast<double>(g % 7), static_cast<double>(g / 7), g, Mark::circle});
  }
  const Picture p(scatter(s, {700, 400, 4}, ImageFormat::png));
  ASSERT_TRUE(p.valid());
  // Nothing below the frame in the legend's column, nothing beyond the margin.
  for (int x = 500; x < 700; ++x)
    for (int y = 400 - 32 + 8; y < 400; ++y) EXPECT_TRUE(p.is({x, y}, kWhite)) << x << " " << y;
  for (int x = 690; x < 700; ++x)
    for (int y = 0; y < 400; ++y) EXPECT_TRUE(p.is({x, y}, kWhite)) << x << " " << y;
}

TEST(Scatter, Refuses) {
  const auto message = [](const std::function<void()>& body, Exit status) -> std::string {
    try {
      body();
    } catch (const Error& e) {
      EXPECT_EQ(e.status(), status);
      return e.what();
    }
    return "nothing was thrown";
  };
  Scatter s = square();
  EXPECT_NE(message([&] { scatter(s, {200, 500, 4}, ImageFormat::png); }, Exit::usage).find("at least 300 x 200"), std::string::npos);
  EXPECT_NE(message([&] { scatter(s, {700, 500, 0}, ImageFormat::png); }, Exit::usage).find("marks of 0"), std::string::npos);
  EXPECT_NE(message([&] { scatter(s, {40000, 500, 4}, ImageFormat::png); }, Exit::usage).find("1 to 32000"), std::string::npos);
  s.points[1].x = NAN;
  EXPECT_NE(message([&] { scatter(s, {700, 500, 4}, ImageFormat::png); }, Exit::data).find("point 2 lies at nan"), std::string::npos);
  s = square();
  s.points[3].group = 3;
  EXPECT_NE(message([&] { scatter(s, {700, 500, 4}, ImageFormat::png); }, Exit::data).find("point 4 is of group 3"), std::string::npos);
  s.points.clear();
  EXPECT_NE(message([&] { scatter(s, {700, 500, 4}, ImageFormat::png); }, Exit::data).find("0 points"), std::string::npos);
}

}  // namespace
}  // namespace mocap::draw
