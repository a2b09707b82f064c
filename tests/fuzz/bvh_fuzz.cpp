#include "libmocap/io/bvh.hpp"
#include "tests/fuzz/target.hpp"

namespace mocap::fuzz {

std::vector<std::string> seeds() {
  return {"HIERARCHY\nROOT Hips\n{\n  OFFSET 0 0 0\n  CHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation Xrotation\n  JOINT Leg\n  {\n    OFFSET 1 -2 3\n    CHANNELS 3 Zrotation Xrotation Yrotation\n"
          "    End Site\n    {\n      OFFSET 0 -4 0\n    }\n  }\n}\nMOTION\nFrames: 2\nFrame Time: 0.033333\n0 90 0 10 20 30 1 2 3\n1 91 0 11 21 31 2 3 4\n",
          "HIERARCHY\r\nROOT a b\r\n{\r\n\tOFFSET 0.5 .5 -1e-3\r\n\tCHANNELS 3 Zrotation Xrotation Yrotation\r\n\tJOINT c\r\n\t{\r\n\t\tOFFSET 0 1 0\r\n\t\tCHANNELS 1 Xrotation\r\n\t}\r\n}\r\nMOTION\r\nFrames:\t1\r\nFrame Time:\t0.0083333\r\n1 2 3 -90",
          "HIERARCHY ROOT r { OFFSET 0 0 0 CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation JOINT k { OFFSET 0 0 1 CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation } }\nMOTION\n"
          "Frames: 2\nFrame Time: .04\n0 0 0 0 0 0 0 0 1 0 90 0\n0 0 0 0 0 0 0 0 2 0 -90 180\n"};
}

std::vector<std::string> words() { return {"HIERARCHY", "ROOT ", "JOINT ", "End Site", "{", "}", "OFFSET ", "CHANNELS ", "Xposition ", "Zrotation ", "MOTION", "Frames: ", "Frame Time: ", "\xef\xbb\xbf", "\r"}; }

void one(std::string_view bytes) {
  for (const bool lenient : {false, true}) {
    io::BvhFile file;
    try {
      file = io::parse_bvh(bytes, {lenient});
    } catch (...) {
      if (!lenient) continue;
      throw;
    }
    file.clip.validate();
    const std::string text = io::format_bvh(file.clip);
    const io::BvhFile again = io::parse_bvh(text);
    require(again.clip.frames() == file.clip.frames() && again.clip.joints() == file.clip.joints(), "BVH read, written and read has the frames and joints");
  }
}

}  // namespace mocap::fuzz
