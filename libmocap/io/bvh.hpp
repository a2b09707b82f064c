// Biovision Hierarchy (BVH) files.
//
// A joint's rotation is the product of its channel matrices in the order listed, R = R_first R_second R_third (column
// vectors); every joint may have its own order and any subset of the six channels in any order. Position channels
// replace the joint's OFFSET: on the root they are its place in the world; on other joints they become the offset where
// they do not vary (1e-4 of the unit) and stay in Clip::translations where they do (BvhFile::notes says which; its rows
// are filled for all joints, row 0 with the root's OFFSET). Axes without a position channel come from OFFSET.
// Units and axes are the file's own: BVH states neither (clip/world_frame.hpp finds them).
#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "libmocap/clip/clip.hpp"

namespace mocap::io {

struct BvhReadOptions {
  bool lenient = false;  // leave out rows of the wrong width and take the frames that are there (BvhFile::repairs)
};

struct BvhFile {
  Clip clip;                        // file units and axes, radians; name empty; rate snapped (see snap_frame_rate)
  std::vector<std::string> notes;   // what a careful reader would want to know: one line each
  std::vector<std::string> repairs;  // what `lenient` left out: worth a warning
  std::vector<std::string> orders;  // [J] rotation channels of each joint in file order, e.g. "ZYX", "" without
};

// Parses the text of one file. Errors carry line and object ("joint LeftFoot"); no file name (Error::in_file adds it).
//
// Accepted: tabs, CRLF, LF and CR mixed, blank lines, UTF-8 BOM, `End site`, missing End Sites, numbers with leading
// dot or exponent, names with spaces and punctuation (Latin-1 becomes UTF-8), keywords in any case, joints without
// channels, all frames on one line, no newline at the end. A joint name that occurs again gets #2, #3, ... appended,
// with a note.
//
// Refused (Error(data)): no HIERARCHY, several roots, declared and present frames differing, a row of the wrong width,
// numbers that are not finite or not numbers (1,5 and 0x10 included), a frame time that is not > 0, unknown channels,
// fewer names than CHANNELS declares, nesting that does not close. Messages count frames from 0.
//
// Depth is not limited by the stack; memory is bounded by the size of the text. Rotations are exact to 4e-15 rad, unit
// and sign-continuous. Speed: at least 0.6 of a bare loop of fast_float::from_chars over the same bytes (about 0.9,
// quaternions included).
BvhFile parse_bvh(std::string_view text, const BvhReadOptions& options = {});

struct BvhWriteOptions {
  std::string order = "ZYX";  // rotation channels, outermost first
  int decimals = 6;           // of positions and angles
};

// The text of one file in the clip's own unit and axes. Root: 6 channels (positions, then rotations); other joints 3,
// or 6 where the clip has translations that vary. Joints come depth first, whatever their order in the skeleton. End
// Sites are written for every leaf (zero offset where the skeleton has none). Angles are unwrapped over time, through
// gimbal lock too. Frame Time with 10 significant digits. Joint names are written as they are; a name with a line break
// or an opening brace is refused. Error(usage) for an order of other than three different axes, decimals beyond 0
// to 15. Reading the text back gives the rotations within print precision; writing that again gives the same bytes.
std::string format_bvh(const Clip& clip, const BvhWriteOptions& options = {});

// Frame rates are written with few digits: 0.008333 means 1/120 s, 0.0333667 means 1001/30000 s. Returns the whole rate
// that is exactly meant, else the nearest of the rates that cameras have, else the whole rate N, else N*1000/1001, whose frame time
// agrees with `frame_time_s` (finite, > 0) within the tolerance (1e-6 s for the last two where it is over 1e-4), otherwise
// 1 / frame_time_s. parse_bvh widens the tolerance for frame times of three to five decimals to half a unit of the last
// one: 0.0333 and 0.033 mean 1/30 s, 0.0042 means 1/240 s.
double snap_frame_rate(double frame_time_s, double tolerance_s = 1e-6);

}  // namespace mocap::io
