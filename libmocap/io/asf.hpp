// Acclaim skeleton (ASF) and motion (AMC) files, the format of the CMU database.
//
// A bone's values in the AMC fill the `dof` its ASF lists, in the order listed, the others are 0. With M the product of the
// dof rotations about fixed axes, the first listed turning first (rx ry rz: M = Rz Ry Rx), and C the bone's `axis`
// (a b c XYZ: C = Rz(c) Ry(b) Rx(a); values and turns in the order of the letters):
//
//   L = C M C^-1,   G = G_parent L,   tip = tip_parent + G (length direction)
//
// direction is in global axes. Translations t (dof tx ty tz) move the bone's base by C t in its parent. The root has M and t
// in its `order`; `position` and `orientation` (turns in the order of its `axis`) are a frame that all motion is in:
// G = O M, p = position + O t.
//
// The skeleton has the root and one joint per bone, depth first in the order of :hierarchy. A joint sits at the base of its
// bone, which is the tip of its parent's: its offset is the parent's length * direction, 0 below the root. Bones without
// children get an End Site at their own tip. That is the hierarchy of the BVH conversions of the CMU data.
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "libmocap/clip/clip.hpp"

namespace mocap::io {

struct Asf {
  struct Joint {
    std::string written;                  // the name as both files spell it
    std::array<std::uint8_t, 6> dofs{};   // in the order of the AMC's values: 0 1 2 for tx ty tz, 3 4 5 for rx ry rz
    std::uint8_t count = 0;
    Quaternion axis = Quaternion::Identity();  // C; of the root O
  };
  std::shared_ptr<const Skeleton> skeleton;  // file units and axes
  std::vector<Joint> joints;                 // [J]; joints[0] is the root
  std::vector<Joint> outside;                // bones with no place under the root: left out, their AMC lines too
  double metres_per_unit = 0;                // 0.0254 / `length` of :units; 0 where it has none
  bool radians = false;                      // `angle` of :units
  std::vector<std::string> notes;
};

// Parses the text of an ASF. Errors carry line and object ("bone lfemur"); no file name (Error::in_file adds it).
//
// Accepted: sections, and properties of a bone, in any order; # comments; tabs, CRLF, LF and CR mixed, blank lines, UTF-8
// BOM; keywords in any case; absent ids, limits, dof, axis (none: 0 0 0) and :units (angles: degrees). Limits may take
// several lines and are not used: what they exclude is not in the file. A bone outside of the hierarchy is left out,
// with a note.
//
// Refused (Error(data)): no :bonedata or :hierarchy, a bone without name, direction or length, the same name or property
// twice, a hierarchy that names an unknown bone, gives a bone two parents or closes a loop, the dof `l` (bones that
// stretch), numbers that are not finite or not numbers (1,5 included), a length below 0, blocks without `end`.
//
// Depth is not limited by the stack; time and memory are linear in the text.
Asf parse_asf(std::string_view text);

struct AmcReadOptions {
  bool lenient = false;  // leave out frames that are not whole and lines of unknown bones (AmcFile::repairs)
};

struct AmcFile {
  Clip clip;                       // the skeleton of the Asf, its units and axes, radians; name empty
  bool rate_known = false;         // whether the file says (:SAMPLES-PER-SECOND); otherwise the rate is 120 Hz, as CMU's
  std::vector<std::string> notes;  // not the Asf's
  std::vector<std::string> repairs;  // what `lenient` left out or made up, and jumps of the frame numbers: worth a warning
};

// Parses the text of an AMC. Angles are degrees or radians as it says (:DEGREES, :RADIANS), else as the ASF says. Every
// frame lists every bone that has dof, :FULLY-SPECIFIED or not. Frames are named by the numbers in the file.
//
// Accepted: as above; bones in any order; bones without dof listed without values; a first frame of any number.
//
// Refused (Error(data)), with `lenient` left out with a note where marked *: no frames, frame numbers that do not follow
// each other (*: kept), a bone the ASF does not have (*), a bone twice in a frame (*), absent from a frame (*; where the
// first frame lacks it too it is held at 0 throughout), the wrong number of values, with both numbers (*), numbers that
// are not finite or not numbers, other words.
//
// Rotations are exact to 4e-15 rad, unit and sign-continuous. Memory is bounded by the size of the text. Speed: at least 0.5
// of a bare loop of fast_float::from_chars over the same bytes.
AmcFile parse_amc(std::string_view text, const Asf& asf, const AmcReadOptions& options = {});

}  // namespace mocap::io
