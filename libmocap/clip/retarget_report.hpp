// How well a retargeted clip follows its source.
#pragma once
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "libmocap/clip/retarget.hpp"

namespace mocap {

struct RetargetReport {
  struct Bone {
    std::string joint, child;       // canonical
    std::string source_joint;
    double mean_deg = 0, worst_deg = 0;  // angle between source and canonical bone direction
    std::size_t worst_frame = 0;
  };
  struct Foot {
    std::string joint;              // canonical toe base, or ankle where the source has no toes
    std::size_t still_frames = 0;   // frames in which that point of the scaled source moves slower than kStillFoot
    double added_slide_mps = 0;     // mean over them of the length of the difference of the horizontal velocities
  };
  static constexpr double kStillFoot = 0.10;  // m/s
  std::vector<Bone> bones;  // every canonical bone with both ends mapped
  std::array<Foot, 2> feet;
};
// `result` is what retargeter.apply(source) gave, possibly moved and turned since.
RetargetReport report_retargeting(const Retargeter& retargeter, const Clip& source, const Clip& result);

// The reports of many clips as a tab-separated table, a row for each bone and each foot of each clip, and their means.
class RetargetTable {
 public:
  void add(const std::string& clip, const RetargetReport& report);
  // With a header line: clip, joint, child, source_joint, mean_deg, worst_deg, worst_frame, still_frames, added_slide_mm_s; a bone has no
  // value in the last two, a foot none in the five before.
  std::string text() const;
  // One line: limbs, spine and neck in degrees, over clips and bones; slide over still frames. Pelvis to hip, chest to collar and ankle to toes
  // are left out: they are the shape of a body, not bones that point anywhere.
  std::string summary() const;

 private:
  std::string rows_;
  std::pair<double, std::size_t> limbs_{}, trunk_{}, slide_{};  // sum, count
};

}  // namespace mocap
