#include "libmocap/io/curve_file.hpp"
#include "tests/fuzz/target.hpp"

namespace mocap::fuzz {

std::vector<std::string> seeds() {
  return {"x,y\n0,0\n1,0.5\n2 1\n3\t-1e1\n", "# points\r\n0 0\r\n.5,-.5\r\n",
          "<svg xmlns=\"http://www.w3.org/2000/svg\"><defs><path d=\"M0 0L9 9\"/></defs><g transform=\"translate(10,20) rotate(30) scale(2)\"><path id=\"p\" d=\"M0,0 l10 0 C20,0 30,10 30,20 s5-5 10 0 Q1 2 3 4 t5 5 A5 7 30 1 0 40 40 h5 v-5 z\"/></g></svg>",
          "<svg><polyline points=\"0,0 10,0 10,10\"/></svg>", "<svg><polygon transform=\"matrix(1 0 0 1 5 5) skewX(10)\" points=\"0 0 5 5 5 0\"/></svg>"};
}

std::vector<std::string> words() { return {"x,y", "<path d=\"", "<polyline points=\"", "transform=\"", "matrix(1 0 0 1 0 0)", "rotate(90 1 1)", "scale(0)", "A1 1 0 0110 10", "M", "z", "C", "q", "&lt;", "<!--", "<![CDATA[", "<!DOCTYPE a [<!ENTITY b \"c\">]>", "/>", "</svg>", "id=\""}; }

void one(std::string_view bytes) {
  const GroundCurve curve = io::parse_curve(bytes);
  require(curve.length() > 0, "a curve that is read has a length");
  if (curve.points().size() > 1000000) return;
  require(io::parse_curve(io::write_curve_csv(curve)).points() == curve.points(), "a curve read, written and read has its points to the bit");
}

}  // namespace mocap::fuzz
