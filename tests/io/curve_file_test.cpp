#include "libmocap/io/curve_file.hpp"

#include <bit>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <numbers>
#include <random>
#include <sstream>

#include "tests/io/io_test_support.hpp"

namespace mocap::io {
namespace {

using test::data;
using test::error_of;
using Points = std::vector<Vector2>;

constexpr double kPi = std::numbers::pi;

Points points_of(std::string_view text, const CurveReadOptions& options = {}) { return parse_curve(text, options).points(); }
std::string failure(std::string_view text, const CurveReadOptions& options = {}, Exit status = Exit::data) {
  const Error e = error_of([&] { parse_curve(text, options); });
  EXPECT_EQ(e.status(), status) << e.what();
  return Error(e.status(), {"f", e.where().line, e.where().object}, e.message()).what();
}

// One user unit is a metre, y up: the numbers are those of the path data.
const CurveReadOptions kMetres{"", 1, 0.001};
std::string svg(const std::string& d) { return "<svg><g transform='scale(1,-1)'>\n<path d=\"" + d + "\"/>\n</g></svg>"; }
Points drawn(const std::string& d) { return points_of(svg(d), kMetres); }
std::string refusal(const std::string& d) { return failure(svg(d), kMetres); }

bool same_bits(const GroundCurve& a, const GroundCurve& b) {
  const auto bits = [](double v) { return std::bit_cast<std::uint64_t>(v); };
  return std::equal(a.points().begin(), a.points().end(), b.points().begin(), b.points().end(),
                    [&](const Vector2& p, const Vector2& q) { return bits(p.x()) == bits(q.x()) && bits(p.y()) == bits(q.y()); });
}

TEST(CurveCsv, EveryWayToWriteIt) {
  const Points expected{{0, 0}, {1.5, -2}, {3, 0.25}};
  for (const char* text : {"0,0\n1.5,-2\n3,.25\n", "x,y\n0,0\n1.5,-2\n3,.25", "0 0\r\n1.5 -2\r\n3 .25\r\n", "0\t0\r1.5\t-2\r3\t.25\r", "\xef\xbb\xbfX , Y\n 0 , 0 \n1.5,\t-2\n+3 ,.25",
                           "# a loop, walked\n\n  # by hand\nx\ty\n\n0,0\n \t\n1.5 , -2e0\n#\n0.3e1   25e-2\n# end", "0,0\n0,0\n1.5,-2\n3,0.25\n3,0.25\n"})
    EXPECT_EQ(points_of(text), expected) << text;
}

TEST(CurveCsv, RefusesWithTheLine) {
  EXPECT_EQ(failure("0,0\n\n#\nabc,1\n"), "f:4: 'abc', expected two numbers x,y in metres");
  EXPECT_EQ(failure("0,0\r\n1,1\r\n2;3\r\n"), "f:3: '2;3', expected two numbers x,y in metres");
  EXPECT_EQ(failure("0,0\r1\r"), "f:2: 1 number, expected two numbers x,y in metres");
  EXPECT_EQ(failure("1,2,3\n"), "f:1: 3 numbers, expected two numbers x,y in metres");
  EXPECT_EQ(failure("1,5 2,5\n"), "f:1: 4 numbers, expected two numbers x,y in metres");
  EXPECT_EQ(failure("1,2,\n"), "f:1: nothing beside a comma, expected two numbers x,y in metres");
  EXPECT_EQ(failure("0 0\n,2\n"), "f:2: nothing beside a comma, expected two numbers x,y in metres");
  EXPECT_EQ(failure("1,,2\n"), "f:1: nothing beside a comma, expected two numbers x,y in metres");
  EXPECT_EQ(failure("x,y\nx,y\n"), "f:2: 'x', expected two numbers x,y in metres");  // one header
  EXPECT_EQ(failure("0,0\nx,y\n"), "f:2: 'x', expected two numbers x,y in metres");
  EXPECT_EQ(failure("x,y,z\n"), "f:1: 'x', expected two numbers x,y in metres");
  EXPECT_EQ(failure("0,nan\n"), "f:1: 'nan', expected two numbers x,y in metres");
  EXPECT_EQ(failure("0,0\n-inf 1\n"), "f:2: '-inf', expected two numbers x,y in metres");
  EXPECT_EQ(failure("1e400,0\n"), "f:1: '1e400', expected two numbers x,y in metres");
  EXPECT_EQ(failure("0x10,0\n"), "f:1: '0x10', expected two numbers x,y in metres");
  EXPECT_EQ(failure("0,0\n0,-2e9\n"), "f:2: '-2e9', expected metres within +-1e+09");
  EXPECT_EQ(failure("0,0\n1," + std::string(50, '\x01')), "f:2: '" + std::string(40, '?') + "...', expected two numbers x,y in metres");
  EXPECT_EQ(failure(""), "f: a curve of 0 different points, expected at least 2");
  EXPECT_EQ(failure(" \n# nothing\nx,y\n"), "f: a curve of 0 different points, expected at least 2");
  EXPECT_EQ(failure("1,2\n1,2\n"), "f: a curve of 1 different points, expected at least 2");
  EXPECT_EQ(failure(std::string("0,0\n1,\0 1\n", 10)), "f:2: a NUL byte, expected text");
  EXPECT_EQ(failure("\xff\xfe" "1"), "f:1: UTF-16 text, expected UTF-8");
  EXPECT_EQ(failure("\xfe\xff" "1"), "f:1: UTF-16 text, expected UTF-8");
  EXPECT_EQ(failure("0,0\n1,1\n", {"loop", 0.01, 0.001}), "f: a table of points, expected SVG with the id 'loop'");
}

TEST(CurveCsv, AMillionPointsAndNoMore) {
  std::string text;
  for (int i = 0; i < 500000; ++i) text += "0,0\n1,0\n";
  EXPECT_EQ(points_of(text).size(), 1000000u);
  EXPECT_EQ(failure(text + "2,2\n"), "f:1000001: another point, expected at most 1000000");
}

TEST(CurveCsv, WrittenAndReadAgainIsTheSame) {
  std::mt19937_64 random(11);
  const auto number = [&] {
    for (;;) {
      // Any bits at all, and numbers as they occur.
      const double v = random() % 2 ? std::bit_cast<double>(static_cast<std::uint64_t>(random())) : std::ldexp(static_cast<double>(static_cast<std::int64_t>(random())), -60);
      if (std::abs(v) <= GroundCurve::kFarthest) return v;
    }
  };
  for (int i = 0; i < 500; ++i) {
    Points points;
    for (std::uint64_t n = 2 + random() % 40; n > 0; --n) points.push_back({number(), number()});
    const GroundCurve curve(points);
    const std::string text = write_curve_csv(curve);
    const GroundCurve again = parse_curve(text);
    ASSERT_TRUE(same_bits(again, curve)) << text;
    EXPECT_EQ(write_curve_csv(again), text);
  }
  EXPECT_EQ(write_curve_csv(GroundCurve({{0, -0.0}, {0.1, 1e-5}, {3, 1e9}})), "x,y\n0,-0\n0.1,1e-05\n3,1000000000\n");
}

TEST(CurveSvg, LinesInEveryNotation) {
  const Points square{{0, 0}, {2, 0}, {2, 3}, {0, 3}, {0, 0}};
  for (const char* d : {"M0 0L2 0L2 3L0 3Z", "M 0,0 2,0 2,3 0,3 z", "m0 0 2 0 0 3-2 0z", "M0,0h2v3h-2V0", "M0 0H2V3H0V0z", "m0 0h1 1v1 1 1h-2z", "M 0 0\nL\t2 0 , 2 3\r\n0 3\fz ", "M0 0L2,.0.2e1+3-0 3 0 0",
                        "M 9 9 M0 0 2 0 2 3 0 3Z M 5 5", "M0 0&#10;L2 0&#xA;&#x9;2 3&#13;&#10;0,3&#32;z", "M0 0L2 0 2 3 0 3zz", "M5 5z M0 0 2 0 2 3 0 3z"}) {
    EXPECT_EQ(drawn(d).front(), square.front()) << d;
    EXPECT_EQ(drawn(d).back(), square.back()) << d;
    EXPECT_EQ(parse_curve(svg(d), kMetres).length(), 10) << d;
  }
  EXPECT_EQ(drawn("M0 0L2 0L2 3L0 3Z"), square);
  EXPECT_EQ(drawn("m0 0 2 0 0 3-2 0z"), square);
  EXPECT_EQ(drawn("M1.5.5-1-2"), (Points{{1.5, 0.5}, {-1, -2}}));
  EXPECT_EQ(drawn("M1e1-2E-1+.5+5."), (Points{{10, -0.2}, {0.5, 5}}));
  EXPECT_EQ(drawn("m1 1m1 1l1 0"), (Points{{2, 2}, {3, 2}}));  // m is relative to the m before
}

TEST(CurveSvg, ScaleAndFlip) {
  EXPECT_EQ(points_of("<svg><path d='M 100 -200 L 300 400'/></svg>"), (Points{{1, 2}, {3, -4}}));
  EXPECT_EQ(points_of("<svg><path d='M 100 -200 L 300 400'/></svg>", {"", 0.5, 0.001}), (Points{{50, 100}, {150, -200}}));
}

TEST(CurveSvg, ArcFlagsWithoutSeparators) {
  for (const char* d : {"M0 0a1 1 0 0 1 10 10", "M0 0a1 1 0 0110 10", "M0 0a1,1,0,0,1,10,10", "M0 0a1 1 0 01 10 10", "M0 0a1 1 0 0,110,10"})
    EXPECT_EQ(drawn(d), drawn("M 0 0 A 1 1 0 0 1 10 10")) << d;
  EXPECT_EQ(drawn("M0 0a5 5 0 015 5 5 5 0 10.5.5").back(), Vector2(5.5, 5.5));  // repeated
}

TEST(CurveSvg, ArcsAreCircles) {
  // A three-quarter circle about (0, 0), both ways round; the polyline is inside it by the tolerance at most, and made of no more points than that takes.
  for (double tolerance : {0.1, 1e-3, 1e-5, 1e-9}) {
    const CurveReadOptions options{"", 1, tolerance};
    const GroundCurve c = parse_curve(svg("M 2 0 A 2 2 0 1 1 0 -2"), options);  // from +X through +Y and -X
    double deepest = 0;
    for (std::size_t i = 0; i + 1 < c.points().size(); ++i) {
      EXPECT_NEAR(c.points()[i].norm(), 2, 4e-15);
      deepest = std::max(deepest, 2 - ((c.points()[i] + c.points()[i + 1]) / 2).norm());
    }
    EXPECT_LE(deepest, tolerance * (1 + 1e-6) + 1e-15);
    EXPECT_GE(deepest, tolerance * 0.5);
    EXPECT_NEAR(c.length(), 3 * kPi, 3 * kPi * tolerance);
    EXPECT_GT(c.point_at(c.length() / 3).y(), 1.9);
    EXPECT_EQ(c.points().back(), Vector2(0, -2));
    const GroundCurve back = parse_curve(svg("M 2 0 A 2 2 0 0 0 0 -2"), options);
    EXPECT_NEAR(back.length(), kPi, kPi * tolerance);
  }
  // Whole circles in two halves, as drawing programs write them.
  const GroundCurve circle = parse_curve(svg("M -3 0 a 3 3 0 1 0 6 0 a 3 3 0 1 0 -6 0 z"), {"", 1, 1e-6});
  EXPECT_NEAR(circle.length(), 6 * kPi, 1e-5);
  for (const Vector2& p : circle.points()) EXPECT_NEAR(p.norm(), 3, 1e-14);
}

TEST(CurveSvg, ArcsAtTheirLimits) {
  EXPECT_EQ(drawn("M 0 0 A 0 5 0 0 1 3 4"), (Points{{0, 0}, {3, 4}}));               // no radius: a line
  EXPECT_EQ(drawn("M 0 0 A 5 5 0 1 1 0 0 L 1 1"), (Points{{0, 0}, {1, 1}}));         // no way to go
  EXPECT_EQ(drawn("M 0 0 A 1e300 1e300 0 0 1 3 4 L 5 5").front(), Vector2(0, 0));    // as good as a line
  const GroundCurve scaled = parse_curve(svg("M -5 0 A 1 1 0 0 1 5 0"), kMetres);    // too small: a half circle over both ends
  EXPECT_NEAR(scaled.length(), 5 * kPi, 0.01);
  for (const Vector2& p : scaled.points()) EXPECT_NEAR(p.norm(), 5, 1e-14);
  // A circle of a thousand kilometres: 1 m of it bends by c^2 / 8 r.
  const GroundCurve huge = parse_curve(svg("M 0 0 A 1e6 1e6 0 0 0 1 0"), {"", 1, 1e-9});
  EXPECT_NEAR(huge.point_at(0.5).y(), 1.25e-7, 1e-11);
  EXPECT_NEAR(huge.point_at(0.5).x(), 0.5, 1e-11);
}

TEST(CurveSvg, BezierCurvesWithinTheTolerance) {
  // Against the polynomial itself, and with no more points than that takes.
  const auto cubic = [](double t) {
    const double u = 1 - t;
    return Vector2(u * u * u * Vector2(0, 0) + 3 * u * u * t * Vector2(8, 0) + 3 * u * t * t * Vector2(-4, 3) + t * t * t * Vector2(4, 3));
  };
  std::size_t before = 0;
  for (double tolerance : {1e-2, 1e-3, 1e-4, 1e-5, 1e-6}) {
    const GroundCurve c = parse_curve(svg("M0 0C8 0-4 3 4 3"), {"", 1, tolerance});
    double worst = 0, s = 0;
    for (int k = 0; k <= 20000; ++k) {
      const auto n = c.nearest(cubic(k / 20000.0), s, s + 0.1);
      s = n.s;
      worst = std::max(worst, n.distance);
    }
    EXPECT_LE(worst, tolerance);
    EXPECT_GE(worst, tolerance / 8);
    if (before) {
      EXPECT_LT(c.points().size(), 4.5 * static_cast<double>(before));  // sqrt(10), and halves do not fit
    }
    before = c.points().size();
  }
  EXPECT_EQ(drawn("M0 0C1 0 2 0 3 0"), (Points{{0, 0}, {3, 0}}));              // straight
  EXPECT_EQ(drawn("M0 0Q1 1 2 0T4 0").size() % 2, 1u);                         // two equal halves
  EXPECT_EQ(drawn("M0 0T4 0"), (Points{{0, 0}, {4, 0}}));                      // nothing to reflect
  EXPECT_EQ(drawn("M0 0C0 1 1 1 1 0T2 0").back(), Vector2(2, 0));
  EXPECT_EQ(drawn("M0 0C0 1 1 1 1 0Q1 0 2 0"), drawn("M0 0C0 1 1 1 1 0T2 0"));  // T after C: nothing to reflect
  EXPECT_EQ(drawn("M0 0Q1 1 2 0C2 0 3 1 4 0"), drawn("M0 0Q1 1 2 0S3 1 4 0"));  // S after Q
  EXPECT_EQ(drawn("M0 0C0 1 1 1 1 0C1-1 2-1 2 0"), drawn("M0 0C0 1 1 1 1 0S2-1 2 0"));
  EXPECT_EQ(drawn("M0 0C0 0 0 0 0 0L1 0"), (Points{{0, 0}, {1, 0}}));          // of no length
  EXPECT_GT(drawn("M0 0C9 0 9 0 0 0").size(), 2u);                             // out and back: control points on the line of the chord
  EXPECT_NEAR(parse_curve(svg("M0 0C9 0 9 0 0 0"), kMetres).length(), 2 * 6.75, 0.002);
}

// tests/data/curve/reference.py has the same curves in other words.
TEST(CurveSvg, AgreesWithNumPy) {
  std::map<std::string, Points> samples;
  std::map<std::string, double> lengths;
  std::istringstream table(data("curve/reference.tsv"));
  for (std::string line; std::getline(table, line);) {
    std::istringstream cells(line);
    std::string name, x, y;
    std::getline(cells, name, '\t') && std::getline(cells, x, '\t') && std::getline(cells, y, '\t');
    if (x == "length")
      lengths[name] = std::stod(y);
    else
      samples[name].push_back({std::stod(x), std::stod(y)});
  }
  ASSERT_EQ(samples.size(), 6u);
  ASSERT_EQ(lengths.size(), 6u);
  for (const auto& [name, points] : samples) {
    SCOPED_TRACE(name);
    const std::size_t blank = name.find(' ');
    for (double tolerance : {1e-3, 1e-7}) {
      const GroundCurve c = parse_curve(data("curve/" + name.substr(0, blank)), {name.substr(blank + 1), 0.01, tolerance});
      EXPECT_LT((c.points().front() - points.front()).norm(), 1e-14);
      EXPECT_LT((c.points().back() - points.back()).norm(), 1e-14);
      double s = 0;
      for (const Vector2& p : points) {
        const auto n = c.nearest(p, s - 1e-6, std::min(s + 3.5, c.length()));
        EXPECT_LE(n.distance, tolerance + 1e-12) << "at " << s << " m";
        s = std::max(s, n.s);
      }
      EXPECT_NEAR(s, c.length(), 1e-9);
      EXPECT_LE(c.length(), lengths.at(name) + 2e-6);  // chords; NumPy's are short ones
      EXPECT_GE(c.length(), lengths.at(name) - (tolerance > 1e-4 ? 0.02 : 2e-6));
    }
  }
}

TEST(CurveSvg, CompactDataIsTheSameToTheBit) {
  const std::string text = data("curve/commands.svg");
  EXPECT_TRUE(same_bits(parse_curve(text), parse_curve(text, {"all", 0.01, 0.001})));  // the first that is drawn
  EXPECT_TRUE(same_bits(parse_curve(text), parse_curve(text, {"compact", 0.01, 0.001})));
  EXPECT_EQ(points_of(text, {"not-drawn", 0.01, 0.001}), (Points{{0, 0}, {0.01, -0.01}}));
}

TEST(CurveSvg, Transforms) {
  const auto moved = [](const std::string& transform) { return points_of("<svg><path transform='" + transform + "' d='M 1 0 L 1 -2'/></svg>", kMetres); };
  EXPECT_EQ(moved(""), (Points{{1, 0}, {1, 2}}));
  EXPECT_EQ(moved("translate(3)"), (Points{{4, 0}, {4, 2}}));
  EXPECT_EQ(moved(" translate ( 3 , -4 ) "), (Points{{4, 4}, {4, 6}}));
  EXPECT_EQ(moved("scale(2)"), (Points{{2, 0}, {2, 4}}));
  EXPECT_EQ(moved("scale(2-1)"), (Points{{2, 0}, {2, -2}}));
  EXPECT_EQ(moved("rotate(90)"), (Points{{0, -1}, {2, -1}}));  // from +X to SVG's +Y, which is down
  EXPECT_EQ(moved("rotate(-270)"), moved("rotate(90)"));
  EXPECT_EQ(moved("rotate(180 1 0)"), (Points{{1, 0}, {1, -2}}));
  EXPECT_EQ(moved("matrix(1 2 3 4 5 6)"), (Points{{6, -8}, {0, 0}}));
  EXPECT_LT((moved("skewX(45)")[1] - Vector2(-1, 2)).norm(), 1e-15);
  EXPECT_LT((moved("skewY(45)")[1] - Vector2(1, 1)).norm(), 1e-15);
  EXPECT_EQ(moved("translate(3) scale(2)"), (Points{{5, 0}, {5, 4}}));  // the last acts first
  EXPECT_EQ(moved("scale(2),translate(3)"), (Points{{8, 0}, {8, 4}}));
}

TEST(CurveSvg, PolylinesAndWhichIsRead) {
  const std::string text =
      "<?xml version='1.0'?><s:svg xmlns:s='http://www.w3.org/2000/svg'><s:clipPath><s:path d='M 0 0 L 9 9'/></s:clipPath><s:rect id='box'/>\n"
      "<s:g><s:polyline id='a' points='0,0 1,0 , 1-1'/></s:g><s:polygon id='b' points='0 0 1 0 1 -1'/><s:path id='c' d='M0 0 5 5'/></s:svg>";
  const auto of = [&](const char* id) { return points_of(text, {id, 1, 0.001}); };
  EXPECT_EQ(of(""), (Points{{0, 0}, {1, 0}, {1, 1}}));
  EXPECT_EQ(of("a"), of(""));
  EXPECT_EQ(of("b"), (Points{{0, 0}, {1, 0}, {1, 1}, {0, 0}}));
  EXPECT_EQ(of("c"), (Points{{0, 0}, {5, -5}}));
  EXPECT_EQ(failure(text, {"box", 1, 0.001}), "f:1:rect box: an element 'rect', expected a path, polyline or polygon");
  EXPECT_EQ(failure(text, {"d", 1, 0.001}), "f: no element with the id 'd', expected a path, polyline or polygon");
  EXPECT_EQ(error_of([&] { of("d"); }).hint(), "ids here: 'a', 'b', 'c'");
  std::string many = "<svg>";
  for (int i = 0; i < 9; ++i) many += "<path id='" + std::to_string(i) + "'/>";
  EXPECT_EQ(error_of([&] { parse_curve(many + "</svg>", {"d", 1, 0.001}); }).hint(), "ids here: '0', '1', '2', '3', '4', '5', '6', '7', ...");
  for (const char* hidden : {"defs", "symbol", "clipPath", "mask", "marker", "pattern"})
    EXPECT_EQ(points_of("<svg><" + std::string(hidden) + "><g><path d='M0 0 9 9'/></g></" + hidden + "><path d='M0 0 1 0'/></svg>", kMetres), (Points{{0, 0}, {1, 0}}));
}

TEST(CurveSvg, RefusesPathDataWithItsPlace) {
  EXPECT_EQ(refusal(""), "f:2:path: no data, expected a path that starts with M");
  EXPECT_EQ(refusal(" \n "), "f:3:path: no data, expected a path that starts with M");
  EXPECT_EQ(refusal("L 1 1"), "f:2:path: 'L', expected M: a path starts with it");
  EXPECT_EQ(refusal("z"), "f:2:path: 'z', expected M: a path starts with it");
  EXPECT_EQ(refusal("M 0 0\nL 1 1\n\nX 3"), "f:5:path: 'X', expected a command: M L H V C S Q T A Z");
  EXPECT_EQ(refusal("M 0 0\r\nL 1 1\r\nB 3"), "f:4:path: 'B', expected a command: M L H V C S Q T A Z");
  EXPECT_EQ(refusal("M 0 0\rL 1 1\r\rbcd 3"), "f:5:path: 'bcd', expected a command: M L H V C S Q T A Z");
  EXPECT_EQ(refusal("M 0 0&#10;L 1 1&#10;b"), "f:2:path: 'b', expected a command: M L H V C S Q T A Z");
  EXPECT_EQ(refusal("M 0 0 L 1"), "f:2:path: the end of the data after 1 of the 2 numbers of L, expected a number");
  EXPECT_EQ(refusal("M 0 0 c 1 2 3 4 L 5 6"), "f:2:path: 'L' after 4 of the 6 numbers of c, expected a number");
  EXPECT_EQ(refusal("M 0 0 L 1 2 3"), "f:2:path: the end of the data after 1 of the 2 numbers of L, expected a number");
  EXPECT_EQ(refusal("M 0 0 L 1 2, z"), "f:2:path: 'z' after 0 of the 2 numbers of L, expected a number");
  EXPECT_EQ(refusal("M,0 0"), "f:2:path: ',' after 0 of the 2 numbers of M, expected a number");
  EXPECT_EQ(refusal("M 0,,0"), "f:2:path: ',' after 1 of the 2 numbers of M, expected a number");
  EXPECT_EQ(refusal("M 0 0 H"), "f:2:path: the end of the data after 0 of the 1 number of H, expected a number");
  EXPECT_EQ(refusal("M 0 0 H 1em"), "f:2:path: 'em', expected a command: M L H V C S Q T A Z");
  EXPECT_EQ(refusal("M 0 0 L . 1"), "f:2:path: '.' after 0 of the 2 numbers of L, expected a number");
  EXPECT_EQ(refusal("M 0 0 L nan 1"), "f:2:path: 'nan' after 0 of the 2 numbers of L, expected a number");
  EXPECT_EQ(refusal("M 0 0 L -1e999 1"), "f:2:path: '-1e999', expected a finite number");
  EXPECT_EQ(refusal("M 0 0 A 1 1 0 2 0 3 3"), "f:2:path: '2' as a flag of A, expected 0 or 1");
  EXPECT_EQ(refusal("M 0 0 A 1 1 0 1"), "f:2:path: the end of the data as a flag of A, expected 0 or 1");
  EXPECT_EQ(refusal("M 0 0 1 1 z 5 5"), "f:2:path: '5', expected a command: M L H V C S Q T A Z");
  EXPECT_EQ(refusal("M 0 0 L &a; 1"), "f:2:path: '&a;' after 0 of the 2 numbers of L, expected a number");  // entities stay as they are written
  const std::string second = "a second subpath, expected one: nobody can walk two";
  EXPECT_EQ(refusal("M 0 0 L 1 1\nM 2 2\nL 3 3"), "f:4:path: " + second);
  EXPECT_EQ(refusal("M 0 0 L 1 1 z\nl 3 3"), "f:3:path: " + second);
  EXPECT_EQ(refusal("M 0 0 L 1 1\nM 2 2 3 3"), "f:3:path: " + second);
  EXPECT_NE(error_of([&] { drawn("M0 0 1 1M2 2 3 3"); }).hint(), "");
  EXPECT_EQ(refusal("M 1 1"), "f:2:path: a curve of 0 different points, expected at least 2");
  EXPECT_EQ(refusal("M 1 1 z"), "f:2:path: a curve of 0 different points, expected at least 2");
  EXPECT_EQ(refusal("M 1 1 l 0 0 h 0 z"), "f:2:path: a curve of 1 different points, expected at least 2");
  EXPECT_EQ(refusal("M 0 0\nL 2e9 0"), "f:3:path: a point at (2e+09, 0) m, expected metres within +-1e+09");
  EXPECT_EQ(refusal("M 0 0 C 0 9e9 1 0 1 1"), "f:2:path: a point at (0, 9e+09) m, expected metres within +-1e+09");
  EXPECT_EQ(refusal("M -9e8 0 A 9e8 9e8 0 1 1 1e8 9e8"), "f:2:path: a curve of more points than 1000000, expected at most as many");
  EXPECT_EQ(refusal("M -9e8 0 C 9e8 9e8 -9e8 9e8 9e8 0 C -9e8 9e8 9e8 9e8 -9e8 0 C 9e8 -9e8 -9e8 -9e8 9e8 0"), "f:2:path: a curve of more points than 1000000, expected at most as many");
  EXPECT_EQ(refusal("M 0 0 A 1e100 1e100 0 1 1 1 0"), "f:2:path: a curve of more points than 1000000, expected at most as many");  // round the long way
}

TEST(CurveSvg, RefusesDocumentsWithTheirPlace) {
  EXPECT_EQ(failure("<svg>\n<path d='M 0 0'\n</svg>"), "f:3: error parsing start element tag, expected well-formed SVG");
  EXPECT_EQ(failure("<svg>\r\n\r\n<g></h></svg>"), "f:3: start-end tags mismatch, expected well-formed SVG");
  EXPECT_EQ(failure("\n<!-- "), "f:2: error parsing comment, expected well-formed SVG");
  EXPECT_EQ(failure("\n<svg a='"), "f:2: error parsing element attribute, expected well-formed SVG");
  EXPECT_EQ(failure("<!-- empty -->"), "f:1: no document element found, expected well-formed SVG");
  EXPECT_EQ(failure("<html><p>no</p></html>"), "f: no element that draws a curve, expected a path, polyline or polygon");
  EXPECT_EQ(failure("<svg>\n\n<path\n id='loop'/></svg>"), "f:3:path loop: an element without d, expected the curve in it");
  EXPECT_EQ(failure("<svg>\n<polyline d='M0 0'/></svg>"), "f:2:polyline: an element without points, expected the curve in it");
  EXPECT_EQ(failure("<svg>\n<polyline points=''/></svg>"), "f:2:polyline: no points, expected pairs of numbers");
  EXPECT_EQ(failure("<svg>\n<polyline\n\npoints='0 0\n1 1 2'/></svg>"), "f:5:polyline: the end of the data after 1 of the 2 numbers of a point, expected a number");
  EXPECT_EQ(failure("<svg><polygon id='p' points='0 0 1 x'/></svg>"), "f:1:polygon p: 'x' after 1 of the 2 numbers of a point, expected a number");
  EXPECT_EQ(failure("<svg><polygon points='1 1, 1 1'/></svg>"), "f:1:polygon: a curve of 1 different points, expected at least 2");
  const auto transform = [](const std::string& t) { return failure("<svg>\n<g id='layer' transform='\n" + t + "'><path d='M0 0 1 1'/></g></svg>"); };
  EXPECT_EQ(transform("turn(3)"), "f:3:g layer: 'turn(3)', expected a transform: matrix translate scale rotate skewX skewY");
  EXPECT_EQ(transform("rotate(1) 3"), "f:3:g layer: '3', expected a transform: matrix translate scale rotate skewX skewY");
  EXPECT_EQ(transform("scale 3"), "f:3:g layer: '3' after scale, expected '('");
  EXPECT_EQ(transform("scale"), "f:3:g layer: the end of the data after scale, expected '('");
  EXPECT_EQ(transform("scale()"), "f:3:g layer: ')' after 0 of the numbers of scale, expected a number");
  EXPECT_EQ(transform("scale(1"), "f:3:g layer: the end of the data after 1 of the numbers of scale, expected ')'");
  EXPECT_EQ(transform("rotate(45deg)"), "f:3:g layer: 'deg)' after 1 of the numbers of rotate, expected ')'");
  EXPECT_EQ(transform("rotate(1 2)"), "f:3:g layer: rotate with 2 numbers, expected 1 or 3");
  EXPECT_EQ(transform("matrix(1 2 3\n4 5)"), "f:4:g layer: matrix with 5 numbers, expected 6");
  EXPECT_EQ(transform("skewX(1 2)"), "f:3:g layer: another number of skewX, expected 1");
  EXPECT_EQ(transform("scale(1e300) scale(1e300)"), "f:3:path: a point that is not finite, expected metres");
  EXPECT_EQ(failure("<svg><path transform='scale(1e5)' d='M 0 0 A 1e306 1e306 0 0 1 1 0'/></svg>"), "f:1:path: an arc whose radius is not finite, expected metres");
  EXPECT_EQ(transform("scale(0)"), "f:3:path: a curve of 1 different points, expected at least 2");
}

TEST(CurveSvg, EntitiesAndDepthDoNoHarm) {
  // A bomb of entities is nothing but text here; nesting takes no stack.
  EXPECT_EQ(points_of("<!DOCTYPE svg [<!ENTITY a 'aaaaaaaa'><!ENTITY b '&a;&a;&a;'><!ENTITY c SYSTEM 'file:///etc/passwd'>]><svg><text>&b;&c;</text><path d='M0 0 1 0'/></svg>", kMetres),
            (Points{{0, 0}, {1, 0}}));
  std::string deep;
  for (int i = 0; i < 300000; ++i) deep += "<g>";
  deep += "<path d='M0 0 1 0'/>";
  for (int i = 0; i < 300000; ++i) deep += "</g>";
  EXPECT_EQ(points_of(deep, kMetres).size(), 2u);
}

TEST(CurveFile, OptionsAreChecked) {
  for (double wrong : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    EXPECT_NE(failure("0,0\n1,1", {"", wrong, 0.001}, Exit::usage).find("f: a scale in metres per unit of "), std::string::npos);
    EXPECT_NE(failure("0,0\n1,1", {"", 0.01, wrong}, Exit::usage).find("f: a tolerance in metres of "), std::string::npos);
  }
  EXPECT_EQ(error_of([] { read_curve("/nowhere", {"", 0, 1}); }).status(), Exit::usage);
}

TEST(CurveFile, ReadsFilesPlainAndGzipped) {
  const test::TemporaryFolder folder;
  const std::string plain = folder.path / "curve.csv", wrong = folder.path / "wrong.svg";
  write_file(plain, "x,y\n0,0\n1,0\n", Overwrite::refuse);
  ASSERT_EQ(std::system(("gzip -k " + plain).c_str()), 0);
  write_file(wrong, "<svg>\n<path id='k' d='M 0 0 K'/></svg>", Overwrite::refuse);
  Digest digest{}, packed{};
  EXPECT_EQ(read_curve(plain, {}, &digest).points(), (Points{{0, 0}, {1, 0}}));
  EXPECT_EQ(read_curve(plain + ".gz", {}, &packed).points(), (Points{{0, 0}, {1, 0}}));
  EXPECT_EQ(to_hex(digest), to_hex(sha256("x,y\n0,0\n1,0\n")));
  EXPECT_NE(to_hex(digest), to_hex(packed));
  EXPECT_EQ(std::string(error_of([&] { read_curve(wrong); }).what()), wrong + ":2:path k: 'K', expected a command: M L H V C S Q T A Z");
  EXPECT_EQ(error_of([&] { read_curve(folder.path / "none.csv"); }).where().file, folder.path / "none.csv");
  EXPECT_EQ(error_of([&] { read_curve(folder.path); }).message(), "is a folder, expected a file");
}

TEST(CurveFile, ReadsStandardInput) {
  const test::TemporaryFolder folder;
  const std::string file = folder.path / "curve.csv";
  write_file(file, "0,0\n1,0\n", Overwrite::refuse);
  ASSERT_TRUE(std::freopen(file.c_str(), "r", stdin));
  EXPECT_EQ(read_curve("-").points(), (Points{{0, 0}, {1, 0}}));
  write_file(file, "0,0\n1\n", Overwrite::allow);
  ASSERT_TRUE(std::freopen(file.c_str(), "r", stdin));
  EXPECT_EQ(std::string(error_of([] { read_curve("-"); }).what()), "<stdin>:2: 1 number, expected two numbers x,y in metres");
}

// Damaged at random: a curve of finite points, or refused.
TEST(CurveFile, MutationsAreReadOrRefused) {
  std::mt19937 random(13);
  const auto below = [&](std::size_t n) { return static_cast<std::size_t>(random()) % n; };
  const std::vector<std::string> words = {"M", "z", "a1 1 0 01", "C", "s", "T", " ", "\n", "\r", "1e400", "1e9", "1e-320", "nan", "-", ".", ",", "#", "&#10;", "&", "<", "/>", "\"", "<path d='",
                                          "transform='scale(", "rotate(90)", ")", "<!--", "<![CDATA[", "<!DOCTYPE", "\xff", "\xef\xbb\xbf", "x,y\n", "2\n"};
  const auto damaged = [&](std::string s) {
    for (std::size_t k = 1 + below(4); k > 0; --k) {
      const std::size_t at = below(s.size() + 1);
      switch (below(5)) {
        case 0: s.erase(at, below(20)); break;
        case 1: s.insert(at, words[below(words.size())]); break;
        case 2: if (at < s.size()) s[at] = static_cast<char>(random()); break;
        case 3: if (below(4) == 0) s.resize(at); break;
        default: s.insert(at, s.substr(below(s.size() + 1), below(60)));
      }
    }
    return s;
  };
  const std::string commands = data("curve/commands.svg"), transforms = data("curve/transforms.svg");
  const std::vector<std::pair<std::string, std::string>> seeds = {  // and the id to read
      {commands, ""}, {commands, "compact"}, {data("curve/arcs.svg"), ""}, {transforms, "bent"}, {transforms, "closed"}, {"<svg><path d='M0 0C8 0-4 3 4 3s1 1 2 2a1 1 0 0110 10z'/></svg>", ""},
      {"<svg><polyline transform='rotate(30)' points='0,0 100,0 1-100'/></svg>", ""}, {"x,y\n0,0\n1.5,-2e-1\n# turn\n3\t4\n\n5 6\r\n", ""}, {"0 0\n1 1\n2 0\n", ""}};
  std::size_t whole = 0, refused = 0, without_line = 0;
  for (int i = 0; i < 20000; ++i) {
    const auto& [seed, id] = seeds[below(seeds.size())];
    const std::string text = damaged(seed);
    try {
      const GroundCurve c = parse_curve(text, {id, 0.01, 0.01});
      EXPECT_GE(c.points().size(), 2u);
      for (const Vector2& p : c.points()) ASSERT_TRUE(p.allFinite());
      EXPECT_TRUE(std::isfinite(c.length()));
      ++whole;
    } catch (const Error& e) {
      EXPECT_EQ(e.status(), Exit::data) << e.what();
      ++refused;
      without_line += e.where().line == 0;
    }
  }
  EXPECT_GT(whole, 3000u);
  EXPECT_GT(refused, 4000u);
  EXPECT_GT(refused - without_line, 3000u);
}

}  // namespace
}  // namespace mocap::io
