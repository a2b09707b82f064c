#include "libmocap/io/asf.hpp"
#include "tests/fuzz/target.hpp"

namespace mocap::fuzz {
namespace {

constexpr const char* kAsf =
    "# a skeleton\n:version 1.10\n:name test\n:units\n  mass 1.0\n  length 0.45\n  angle deg\n:root\n  order TX TY TZ RX RY RZ\n  axis XYZ\n  position 0 0 0\n  orientation 0 0 0\n:bonedata\n"
    "  begin\n    id 1\n    name thigh\n    direction 0 -1 0\n    length 4.5\n    axis 0 0 20 XYZ\n    dof rx ry rz\n    limits (-160.0 20.0)\n           (-70.0 70.0)\n           (-60.0 70.0)\n  end\n"
    "  begin\n    name shin\n    direction 0 -1 0.1\n    length 4\n    axis 0 0 20 XYZ\n    dof rx\n  end\n:hierarchy\n  begin\n    root thigh\n    thigh shin\n  end\n";

}  // namespace

std::vector<std::string> seeds() {
  return {std::string(kAsf) + "\x01:FULLY-SPECIFIED\n:DEGREES\n1\nroot 1 2 3 4 5 6\nthigh 10 20 30\nshin 40\n2\nroot 1 2 3 4 5 7\nthigh 10 20 31\nshin 41\n",
          std::string(kAsf) + "\x01#!OML:ASF\n:RADIANS\n:SAMPLES-PER-SECOND 60\n5\nthigh 0 0 0\nroot 0 0 0 0 0 0\nshin -.5\n", kAsf};
}

std::vector<std::string> words() {
  return {":units", ":root", ":bonedata", ":hierarchy", "begin", "end", "name ", "direction ", "length ", "axis ", "dof rx ry rz", "dof l", "limits (-1 1)", "XYZ", "rad", "id ", "\x01", ":DEGREES", ":RADIANS", ":FULLY-SPECIFIED", "root ", "thigh ", "shin "};
}

// The skeleton, then after a byte of 1 the motion.
void one(std::string_view bytes) {
  const auto cut = bytes.find('\x01');
  const io::Asf asf = io::parse_asf(bytes.substr(0, cut));
  if (cut == std::string_view::npos) return;
  for (const bool lenient : {false, true}) {
    io::AmcFile file;
    try {
      file = io::parse_amc(bytes.substr(cut + 1), asf, {lenient});
    } catch (...) {
      if (!lenient) continue;
      throw;
    }
    file.clip.validate();
    require(file.clip.frames() > 0, "an AMC that is read has frames");
  }
}

}  // namespace mocap::fuzz
