#include "libmocap/io/svg_curve.hpp"

#include <fast_float/fast_float.h>
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <iterator>
#include <limits>
#include <numbers>
#include <pugixml.hpp>
#include <string>
#include <utility>

#include "libmocap/base/error.hpp"

namespace mocap::io {
namespace {

using Affine = Eigen::Affine2d;

constexpr const char* kShapes = "a path, polyline or polygon";

// Reading position in the value of an attribute as it stands in the file.
class Scanner {
 public:
  // `value` is a part of `text`.
  Scanner(std::string_view text, std::string_view value, std::string object)
      : text_(text), p_(value.data()), end_(value.data() + value.size()), object_(std::move(object)) {
    skip_space();
  }

  const char* at() const { return p_; }
  bool done() const { return p_ == end_; }
  char ahead() const { return done() ? '\0' : *p_; }
  void step() { ++p_; }

  [[noreturn]] void fail(const char* at, const std::string& what, std::string hint = {}) const {
    refuse({{}, line_at(text_, static_cast<std::size_t>(at - text_.data())), object_}, what, std::move(hint));
  }
  [[noreturn]] void fail(const std::string& what, std::string hint = {}) const { fail(p_, what, std::move(hint)); }

  void skip_space() {
    while (const std::size_t n = space_ahead()) p_ += n;
  }
  // Over space with at most one comma in it; whether there was one.
  bool skip_comma() {
    skip_space();
    if (ahead() != ',') return false;
    step();
    skip_space();
    return true;
  }
  bool number_ahead() const { return number_end() != p_; }

  // For a message: `of` says what of, "the 6 numbers of C".
  double number(std::size_t index, const std::string& of) {
    const char* const next = number_end();
    if (next == p_) fail(fmt::format("{} after {} of the {}, expected a number", shown(), index, of));
    double v = 0;
    fast_float::from_chars(p_ + (*p_ == '+'), next, v);
    if (!std::isfinite(v)) fail(fmt::format("{}, expected a finite number", quoted({p_, static_cast<std::size_t>(next - p_)})));
    p_ = next;
    return v;
  }
  bool flag() {
    if (ahead() != '0' && ahead() != '1') fail(fmt::format("{} as a flag of A, expected 0 or 1", shown()));
    return *p_++ == '1';
  }
  // A run of ASCII letters.
  std::string_view word() {
    const char* const first = p_;
    while (!done() && ((*p_ >= 'a' && *p_ <= 'z') || (*p_ >= 'A' && *p_ <= 'Z'))) ++p_;
    return {first, static_cast<std::size_t>(p_ - first)};
  }
  std::string shown() const {
    if (done()) return "the end of the data";
    const char* last = p_ + 1;
    while (*p_ != ',' && last != end_ && std::string_view(" \t\r\n,&").find(*last) == std::string_view::npos) ++last;
    return quoted({p_, static_cast<std::size_t>(last - p_)});
  }

 private:
  // Bytes of one space character ahead, 0 where there is none. Some writers escape the line breaks of an attribute.
  std::size_t space_ahead() const {
    static constexpr std::string_view kSpaces[] = {" ", "\t", "\n", "\r", "\f", "&#10;", "&#xA;", "&#xa;", "&#13;", "&#xD;", "&#xd;", "&#9;", "&#x9;", "&#32;", "&#x20;"};
    const std::string_view rest(p_, static_cast<std::size_t>(end_ - p_));
    for (const std::string_view space : kSpaces)
      if (rest.starts_with(space)) return space.size();
    return 0;
  }
  // Where the longest number of SVG's grammar ahead ends; p_ where there is none.
  const char* number_end() const {
    const auto digits = [&](const char* q) {
      while (q != end_ && *q >= '0' && *q <= '9') ++q;
      return q;
    };
    const auto sign = [&](const char* q) { return q + (q != end_ && (*q == '+' || *q == '-')); };
    const char* const first = sign(p_);
    const char* q = digits(first);
    std::ptrdiff_t count = q - first;
    if (q != end_ && *q == '.') {
      const char* const decimals = q + 1;
      q = digits(decimals);
      count += q - decimals;
    }
    if (count == 0) return p_;
    if (q != end_ && (*q == 'e' || *q == 'E')) {
      const char* const exponent = sign(q + 1);
      if (const char* const e = digits(exponent); e != exponent) q = e;
    }
    return q;
  }

  std::string_view text_;
  const char* p_;
  const char* end_;
  std::string object_;
};

double distance_to_segment(const Vector2& p, const Vector2& a, const Vector2& b) {
  const Vector2 d = b - a;
  const double squared = d.squaredNorm();
  const double t = squared > 0 ? std::clamp(d.dot(p - a) / squared, 0.0, 1.0) : 0.0;
  return (p - a - t * d).norm();
}

// Turns what is drawn into points in metres. A failure is told at the scanner's place.
class Flattener {
 public:
  Flattener(const Scanner& scanner, const Affine& to_metres, double tolerance, std::vector<Vector2>& out)
      : scanner_(scanner), to_metres_(to_metres), tolerance_(tolerance), out_(out) {}

  void point(const Vector2& user) { add(metres(user)); }

  // From p0, which is there already, to p3.
  void cubic(const Vector2& p0, const Vector2& p1, const Vector2& p2, const Vector2& p3) {
    // Only a tolerance finer than doubles are comes near: rounding then keeps control points off their chord.
    constexpr int kDeepest = 60;
    struct Piece {
      std::array<Vector2, 4> p;
      int depth;
    };
    std::vector<Piece> todo{{{metres(p0), metres(p1), metres(p2), metres(p3)}, 0}};
    while (!todo.empty()) {
      const auto [p, depth] = todo.back();
      todo.pop_back();
      // The distance from the chord is a convex function, so that of the curve is at most the Bernstein sum of those of its control points: 3t(1-t) max.
      if (depth == kDeepest || 0.75 * std::max(distance_to_segment(p[1], p[0], p[3]), distance_to_segment(p[2], p[0], p[3])) <= tolerance_) {
        add(p[3]);
        continue;
      }
      const Vector2 a = (p[0] + p[1]) / 2, b = (p[1] + p[2]) / 2, c = (p[2] + p[3]) / 2, ab = (a + b) / 2, bc = (b + c) / 2, middle = (ab + bc) / 2;
      todo.push_back({{middle, bc, c, p[3]}, depth + 1});
      todo.push_back({{p[0], a, ab, middle}, depth + 1});
    }
  }

  // SVG 1.1, F.6.5 and F.6.6, in the space where the ellipse is the unit circle: there the ends are m + w and m - w, m their middle, and the centre is m + e,
  //   e = +-sqrt(1 - |w|^2) (w_y, -w_x) / |w|,   + where large != sweep;  the arc spans 2 atan2(|w|, sqrt(1 - |w|^2)) or the rest of the circle.
  void arc(const Vector2& from, double rx, double ry, double turn_deg, bool large, bool sweep, const Vector2& to) {
    rx = std::abs(rx), ry = std::abs(ry);
    if (from == to) return;
    const double turn = turn_deg * std::numbers::pi / 180;
    const Eigen::Matrix2d axes = Eigen::Rotation2Dd(turn).toRotationMatrix();
    const Vector2 half = axes.transpose() * ((from - to) / 2);
    Vector2 w(half.x() / rx, half.y() / ry);
    double n = std::hypot(w.x(), w.y());
    if (!std::isfinite(n) || n == 0) return point(to);  // a radius of 0, or so large that nothing is left of the curve
    if (n > 1) {
      rx *= n, ry *= n, w /= n;
      n = 1;
    }
    const double height = std::sqrt((1 - n) * (1 + n));
    const Vector2 centre = (large != sweep ? height : -height) * Vector2(w.y(), -w.x()) / n, first = w - centre;
    const double start = std::atan2(first.y(), first.x()), less = 2 * std::atan2(n, height);
    const double span = (large ? 2 * std::numbers::pi - less : less) * (sweep ? 1 : -1);

    const Vector2 u = to_metres_.linear() * axes.col(0) * rx, v = to_metres_.linear() * axes.col(1) * ry;
    // Scaled, so that squares of huge radii stay finite.
    const double scale = std::max({u.cwiseAbs().maxCoeff(), v.cwiseAbs().maxCoeff(), std::numeric_limits<double>::min()});
    const double uu = (u / scale).squaredNorm(), vv = (v / scale).squaredNorm();
    const double sigma = scale * std::sqrt((uu + vv + std::hypot(uu - vv, 2 * (u / scale).dot(v / scale))) / 2);
    if (!std::isfinite(sigma)) scanner_.fail("an arc whose radius is not finite, expected metres");
    // 1 - cos(h/2) = 2 sin^2(h/4)
    const double step = std::min(4 * std::asin(std::min(1.0, std::sqrt(tolerance_ / 2 / sigma))), std::numbers::pi / 2), pieces = std::ceil(std::abs(span) / step);
    if (pieces > static_cast<double>(kMostCurvePoints)) too_many();
    // Relative to the start: of a huge circle the difference of two far points would not be left.
    const Vector2 origin = metres(from);
    for (double k = 1; k < pieces; ++k) {
      const double angle = span * (k / pieces), middle = start + angle / 2;
      add(origin + 2 * std::sin(angle / 2) * (std::cos(middle) * v - std::sin(middle) * u));
    }
    point(to);
  }

 private:
  [[noreturn]] void too_many() const {
    scanner_.fail(fmt::format("a curve of more points than {}, expected at most as many", kMostCurvePoints), "a larger tolerance or fewer metres to the unit make it less fine");
  }
  Vector2 metres(const Vector2& user) const { return checked(to_metres_ * user); }
  Vector2 checked(const Vector2& p) const {
    if (!p.allFinite()) scanner_.fail("a point that is not finite, expected metres");
    if (p.cwiseAbs().maxCoeff() > GroundCurve::kFarthest) scanner_.fail(fmt::format("a point at ({:g}, {:g}) m, expected metres within +-{:g}", p.x(), p.y(), GroundCurve::kFarthest));
    return p;
  }
  void add(const Vector2& p) {
    (void)checked(p);
    if (out_.size() == kMostCurvePoints) too_many();
    out_.push_back(p);
  }

  const Scanner& scanner_;
  const Affine& to_metres_;
  double tolerance_;
  std::vector<Vector2>& out_;
};

std::size_t numbers_of(char command) {
  switch (command) {
    case 'M': case 'L': case 'T': return 2;
    case 'H': case 'V': return 1;
    case 'C': return 6;
    case 'S': case 'Q': return 4;
    case 'A': return 7;
    default: return 0;
  }
}

class PathData {
 public:
  PathData(Scanner& scanner, Flattener& flattener) : scanner_(scanner), flattener_(flattener) {}

  void run() {
    if (scanner_.done()) scanner_.fail("no data, expected a path that starts with M");
    for (bool first = true; !scanner_.done(); first = false) {
      command_at_ = scanner_.at();
      const char letter = scanner_.ahead();
      const bool relative = letter >= 'a' && letter <= 'z';
      char command = relative ? static_cast<char>(letter - 32) : letter;
      const std::size_t count = numbers_of(command);
      if (count == 0 && command != 'Z') scanner_.fail(fmt::format("{}, expected a command: M L H V C S Q T A Z", scanner_.shown()));
      if (first && command != 'M') scanner_.fail(fmt::format("{}, expected M: a path starts with it", scanner_.shown()));
      scanner_.step();
      scanner_.skip_space();
      if (command == 'Z') {
        close();
        continue;
      }
      const std::string of = fmt::format("{} number{} of {}", count, count == 1 ? "" : "s", letter);
      do {
        std::array<double, 7> a{};
        for (std::size_t k = 0; k < count; ++k) {
          if (k) scanner_.skip_comma();
          a[k] = command == 'A' && (k == 3 || k == 4) ? scanner_.flag() : scanner_.number(k, of);
        }
        draw(command, relative, a);
        if (command == 'M') command = 'L';
      } while (scanner_.skip_comma() || scanner_.number_ahead());
    }
  }

 private:
  void draw(char command, bool relative, const std::array<double, 7>& a) {
    const Vector2 base = relative ? now_ : Vector2(0, 0);
    const auto pair = [&](std::size_t k) { return Vector2(base + Vector2(a[k], a[k + 1])); };
    if (command == 'M') {
      now_ = start_ = pair(0);
      open_ = false;
      before_ = 'M';
      return;
    }
    begin();
    const Vector2 from = now_;
    // S and T continue the curve before, if it is of their kind.
    const auto reflected = [&](char kind) { return Vector2(before_ == kind ? 2 * from - control_ : from); };
    switch (command) {
      case 'L': flattener_.point(now_ = pair(0)); break;
      case 'H': flattener_.point(now_ = Vector2(base.x() + a[0], from.y())); break;
      case 'V': flattener_.point(now_ = Vector2(from.x(), base.y() + a[0])); break;
      case 'C': case 'S': {
        const bool smooth = command == 'S';
        const Vector2 p1 = smooth ? reflected('C') : pair(0);
        control_ = pair(smooth ? 0 : 2);
        now_ = pair(smooth ? 2 : 4);
        flattener_.cubic(from, p1, control_, now_);
        command = 'C';
        break;
      }
      case 'Q': case 'T': {
        const bool smooth = command == 'T';
        control_ = smooth ? reflected('Q') : pair(0);
        now_ = pair(smooth ? 0 : 2);
        flattener_.cubic(from, from + 2.0 / 3 * (control_ - from), now_ + 2.0 / 3 * (control_ - now_), now_);
        command = 'Q';
        break;
      }
      default:
        now_ = pair(5);
        flattener_.arc(from, a[0], a[1], a[2], a[3] != 0, a[4] != 0, now_);
    }
    before_ = command;
  }

  void begin() {
    if (open_) return;
    if (drawn_) scanner_.fail(command_at_, "a second subpath, expected one: nobody can walk two", "join them in the drawing, or give the part to follow a path and an id of its own");
    open_ = drawn_ = true;
    flattener_.point(now_);
  }

  void close() {
    if (open_) flattener_.point(start_);
    now_ = start_;
    open_ = false;
    before_ = 'Z';
  }

  Scanner& scanner_;
  Flattener& flattener_;
  const char* command_at_ = nullptr;
  Vector2 now_{0, 0}, start_{0, 0}, control_{0, 0};
  char before_ = 'Z';
  bool open_ = false;   // now_ is among the points
  bool drawn_ = false;  // a subpath was
};

void read_points(Scanner& scanner, Flattener& flattener, bool closed) {
  if (scanner.done()) scanner.fail("no points, expected pairs of numbers");
  Vector2 first(0, 0);
  std::size_t count = 0;
  do {
    Vector2 p(0, 0);
    for (int k = 0; k < 2; ++k) {
      if (k) scanner.skip_comma();
      p[k] = scanner.number(static_cast<std::size_t>(k), "2 numbers of a point");
    }
    flattener.point(p);
    if (count++ == 0) first = p;
  } while (scanner.skip_comma() || !scanner.done());
  if (closed) flattener.point(first);
}

// Degrees; exact where the angle is a multiple of 90.
Eigen::Matrix2d rotation(double degrees) {
  int quarters = 0;
  const double rest = std::remquo(degrees, 90, &quarters) * std::numbers::pi / 180;
  double c = std::cos(rest), s = std::sin(rest);
  for (int k = quarters & 3; k > 0; --k) {
    const double old = c;
    c = -s;
    s = old;
  }
  return (Eigen::Matrix2d() << c, -s, s, c).finished();
}

Affine parse_transform(Scanner& scanner) {
  Affine all = Affine::Identity();
  while (!scanner.done()) {
    const char* const at = scanner.at();
    const std::string shown = scanner.shown(), name(scanner.word());
    scanner.skip_space();
    struct Kind {
      std::string_view name;
      std::array<std::size_t, 2> counts;  // of numbers
    };
    static constexpr Kind kKinds[] = {{"matrix", {6, 6}}, {"translate", {1, 2}}, {"scale", {1, 2}}, {"rotate", {1, 3}}, {"skewX", {1, 1}}, {"skewY", {1, 1}}};
    const auto* const kind = std::find_if(std::begin(kKinds), std::end(kKinds), [&](const Kind& k) { return k.name == name; });
    if (kind == std::end(kKinds)) scanner.fail(at, fmt::format("{}, expected a transform: matrix translate scale rotate skewX skewY", shown));
    if (scanner.ahead() != '(') scanner.fail(fmt::format("{} after {}, expected '('", scanner.shown(), name));
    scanner.step();
    scanner.skip_space();
    std::array<double, 6> a{};
    const auto [least, most] = kind->counts;
    const std::string expected = least == most ? fmt::format("{}", least) : fmt::format("{} or {}", least, most);
    std::size_t count = 0;
    do {
      if (count == most) scanner.fail(fmt::format("another number of {}, expected {}", name, expected));
      a[count] = scanner.number(count, fmt::format("numbers of {}", name));
      ++count;
    } while (scanner.skip_comma() || scanner.number_ahead());
    if (scanner.ahead() != ')') scanner.fail(fmt::format("{} after {} of the numbers of {}, expected ')'", scanner.shown(), count, name));
    if (count != least && count != most) scanner.fail(fmt::format("{} with {} numbers, expected {}", name, count, expected));
    scanner.step();
    scanner.skip_comma();
    Affine one = Affine::Identity();
    if (name == "matrix")
      one.matrix().topRows<2>() << a[0], a[2], a[4], a[1], a[3], a[5];
    else if (name == "translate")
      one.translation() = Vector2(a[0], a[1]);
    else if (name == "scale")
      one.linear() = Vector2(a[0], count == 2 ? a[1] : a[0]).asDiagonal();
    else if (name == "rotate")
      one = Eigen::Translation2d(a[1], a[2]) * Affine(rotation(a[0])) * Eigen::Translation2d(-a[1], -a[2]);
    else if (name == "skewX")
      one.linear()(0, 1) = std::tan(a[0] * std::numbers::pi / 180);
    else
      one.linear()(1, 0) = std::tan(a[0] * std::numbers::pi / 180);
    all = all * one;
  }
  return all;
}

class Document {
 public:
  // `text` stays as it is and lends its bytes to scanners: the parser works in a copy at the same offsets, values left as written.
  explicit Document(std::string_view text) : text_(text), copy_(text) {
    const auto result = document_.load_buffer_inplace(copy_.data(), copy_.size(), pugi::parse_minimal, pugi::encoding_utf8);
    if (result) return;
    std::string what = result.description();
    if (!what.empty() && what[0] >= 'A' && what[0] <= 'Z') what[0] = static_cast<char>(what[0] + 32);
    refuse({{}, line_at(text_, static_cast<std::size_t>(std::max<std::ptrdiff_t>(result.offset, 0))), {}}, fmt::format("{}, expected well-formed SVG", what));
  }

  pugi::xml_node find(const std::string& id) const;

  [[noreturn]] void fail(const pugi::xml_node& node, const std::string& what) const {
    const std::ptrdiff_t at = node.offset_debug();
    refuse({{}, at < 0 ? 0 : line_at(text_, static_cast<std::size_t>(at)), object(node)}, what);
  }
  // Of an attribute the node has.
  Scanner scan(const pugi::xml_node& node, const char* attribute) const {
    const char* const value = node.attribute(attribute).value();
    const std::less<> before;
    if (before(value, copy_.data()) || before(copy_.data() + copy_.size(), value)) fail(node, fmt::format("{} without a value, expected one", attribute));
    return Scanner(text_, text_.substr(static_cast<std::size_t>(value - copy_.data()), std::char_traits<char>::length(value)), object(node));
  }

  // Without the prefix of a namespace.
  static std::string_view name(const pugi::xml_node& node) {
    const std::string_view name = node.name();
    return name.substr(name.find(':') + 1);
  }
  static bool is_shape(const pugi::xml_node& node) { return name(node) == "path" || name(node) == "polyline" || name(node) == "polygon"; }
  static std::string object(const pugi::xml_node& node) {
    std::string s(name(node));
    if (const std::string_view id = node.attribute("id").value(); !id.empty()) s += " " + std::string(id);
    s.resize(std::min<std::size_t>(s.size(), 60));
    for (char& c : s)
      if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '?';
    return s;
  }

 private:
  std::string_view text_;
  std::string copy_;
  pugi::xml_document document_;
};

pugi::xml_node Document::find(const std::string& id) const {
  static constexpr std::string_view kUndrawn[] = {"defs", "symbol", "clipPath", "mask", "marker", "pattern"};
  std::string ids;
  std::size_t listed = 0;
  pugi::xml_node node = document_;
  bool inside = true;  // whether the children of `node` are next
  for (;;) {
    if (inside && node.first_child()) {
      node = node.first_child();
    } else {
      while (node && !node.next_sibling()) node = node.parent();
      node = node.next_sibling();
      if (!node) break;
    }
    inside = true;
    const std::string_view own = node.attribute("id").value();
    if (id.empty()) {
      if (is_shape(node)) return node;
      inside = std::find(std::begin(kUndrawn), std::end(kUndrawn), name(node)) == std::end(kUndrawn);
    } else if (own == id) {
      if (!is_shape(node)) fail(node, fmt::format("an element {}, expected {}", quoted(name(node)), kShapes));
      return node;
    } else if (is_shape(node) && !own.empty() && ++listed <= 8) {
      ids += (ids.empty() ? "" : ", ") + quoted(own);
    }
  }
  if (id.empty()) refuse({}, fmt::format("no element that draws a curve, expected {}", kShapes));
  refuse({}, fmt::format("no element with the id {}, expected {}", quoted(id), kShapes), ids.empty() ? "" : "ids here: " + ids + (listed > 8 ? ", ..." : ""));
}

}  // namespace

std::vector<Vector2> parse_svg_curve(std::string_view text, const CurveReadOptions& options) {
  const Document document(text);
  const pugi::xml_node shape = document.find(options.id);
  Affine to_metres = Affine::Identity();
  for (pugi::xml_node node = shape; node; node = node.parent()) {
    if (!node.attribute("transform")) continue;
    Scanner scanner = document.scan(node, "transform");
    to_metres = parse_transform(scanner) * to_metres;
  }
  to_metres = Affine(Vector2(options.metres_per_unit, -options.metres_per_unit).asDiagonal()) * to_metres;

  const bool path = Document::name(shape) == "path";
  const char* const attribute = path ? "d" : "points";
  if (!shape.attribute(attribute)) document.fail(shape, fmt::format("an element without {}, expected the curve in it", attribute));
  Scanner scanner = document.scan(shape, attribute);
  std::vector<Vector2> points;
  Flattener flattener(scanner, to_metres, options.tolerance, points);
  if (path)
    PathData(scanner, flattener).run();
  else
    read_points(scanner, flattener, Document::name(shape) == "polygon");
  if (std::adjacent_find(points.begin(), points.end(), std::not_equal_to<>()) == points.end())
    document.fail(shape, fmt::format("a curve of {} different points, expected at least 2", points.empty() ? 0 : 1));
  return points;
}

}  // namespace mocap::io
