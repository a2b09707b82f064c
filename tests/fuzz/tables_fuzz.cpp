#include "libmocap/formats/attribute_schedule.hpp"
#include "libmocap/formats/joint_map_file.hpp"
#include "libmocap/formats/labels.hpp"
#include "libmocap/formats/rate_rules.hpp"
#include "libmocap/base/error.hpp"
#include "tests/fuzz/target.hpp"
#include "tests/store/sample_clips.hpp"

namespace mocap::fuzz {

std::vector<std::string> seeds() {
  return {"file\taction\tstart\tend\na.bvh\twalking\t0\t1\na.bvh\trunning\t1\t2.5\n", "file\taction\tgender\nwalk_01\twalking\tmale\n\nsub/b.bvh\t\tfemale\n", "start\tend\taction\tclip\n0\t1\twalking\ta\n1\t2\trunning\ta\n0\t\twaving\tb\n",
          "walk_*\t60\n# rest\n*\t120\n", "pelvis\tHips\nleft_hip\tLeftUpLeg\n", "source\tcanonical\nHips\tpelvis\n"};
}

std::vector<std::string> words() { return {"file", "start", "end", "clip", "action", "\t", "\t\t", "\r\n", "#", "pelvis", "left_hip", "*", "\xef\xbb\xbf", "\xff"}; }

// The tables beside motion files are small and alike: every reader sees every input.
void one(std::string_view bytes) {
  const std::string& path = as_file(bytes);
  const auto tried = [](const auto& read) {
    try {
      read();
    } catch (const Error& e) {
      require(e.status() == Exit::data, "a table is refused with Error(data)");
      require(std::string_view(e.what()).find("input") != std::string_view::npos, "what is wrong with a table names the file");
    }
  };
  tried([&] {
    const formats::Labels labels = formats::Labels::read(path);
    Clip clip = testing::sample_clip("a", 30, 1);
    labels.apply(clip, "a.bvh", "a.bvh");
    clip.validate();
  });
  tried([&] {
    const auto schedules = formats::AttributeSchedules::read(path);
    for (const auto& schedule : schedules.all()) {
      require(!schedule.rows.empty() && schedule.rows[0].start_s == 0, "a schedule starts at 0");
      for (std::size_t k = 1; k < schedule.rows.size(); ++k) require(schedule.rows[k].start_s > schedule.rows[k - 1].start_s, "rows of a schedule ascend");
    }
  });
  tried([&] { (void)formats::RateRules::read(path); });
  tried([&] { (void)formats::read_joint_map(path); });
}

}  // namespace mocap::fuzz
