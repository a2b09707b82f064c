// Curves on the ground to be followed: tables of points (CSV) and drawings (SVG).
#pragma once
#include <string>
#include <string_view>

#include "libmocap/base/sha256.hpp"
#include "libmocap/math/ground_curve.hpp"

namespace mocap::io {

struct CurveReadOptions {
  std::string id;                 // of the SVG element to read; "": the first that is drawn
  double metres_per_unit = 0.01;  // SVG: 100 user units to the metre
  double tolerance = 0.001;       // SVG: how far the polyline may be from the drawn curve, metres
};

// Parses the text of one file; a text whose first character is '<' is SVG, any other CSV. UTF-8; byte-order mark, CRLF, LF and lone CR accepted. Errors carry the line, for SVG
// also the object ("path loop"); no file name (Error::in_file adds it).
//
// CSV   One point a line: x and y in metres, a comma, tab or blanks between. Blank lines and lines that start with # are skipped. The first line that is left may be the header
//       `x,y`. Numbers are correctly rounded. The options have no say; an id is refused.
//
// SVG   The first path, polyline or polygon in document order that is not in defs, symbol, clipPath, mask, marker or pattern; or the one with the id, wherever it is.
//       Path data: M L H V C S Q T A Z, absolute and relative, implicit repetition, compact numbers (1.5.5, 1-2, the flags in a1 1 0 0110 10); Z and polygons end where they
//       start. With A the product of the `transform` attributes from the root down to the element (matrix translate scale rotate skewX skewY) a user point q becomes
//           p = metres_per_unit diag(1, -1) A q,           metres: SVG's y points down.
//       viewBox, units of width and height, nested svg, `use` and style sheets are not looked at: the scale is metres_per_unit whatever a page looks like.
//       Curves become chords. Bezier curves are halved until max(|p1|, |p2|) <= 4/3 tolerance, distances of the inner control points from the chord: the curve is no further than
//       3/4 of that from it. Arcs are first brought into centre form (SVG 1.1, F.6.5 and F.6.6: radii that are too small are scaled up, a radius of 0 is a straight line), then
//       cut into equal angles h with sigma (1 - cos(h/2)) <= tolerance, sigma the longer half axis after the transforms. Ends of pieces are exact.
//
// Refused (Error(data)): fewer than 2 different points; more than a million points; coordinates beyond GroundCurve::kFarthest; what is no number where one is due, nan and infinity
// included; a line without exactly two numbers; UTF-16, NUL bytes; XML that is not well-formed; no such element, one without data, data that break off or do not start with M
// (an SVG viewer would draw the part before: a curve that ends too soon is no help here); a path with a second subpath that draws; unknown transforms. Entities of a document
// type are not expanded. Error(usage): metres_per_unit or tolerance not finite and above 0.
//
// Cost: linear in the text and the points; depth is not limited by the stack.
GroundCurve parse_curve(std::string_view text, const CurveReadOptions& options = {});

// parse_curve() of a file, .gz too, or of standard input for "-"; errors name it. At most 64 MiB, expanded. `digest`, where given, receives the SHA-256 of the file's own bytes.
GroundCurve read_curve(const std::string& path, const CurveReadOptions& options = {}, Digest* digest = nullptr);

// CSV with the header x,y and shortest numbers that read back as the same doubles: parse_curve(write_curve_csv(c)) has the points of c to the bit, where they are at most a million.
std::string write_curve_csv(const GroundCurve& curve);

}  // namespace mocap::io
