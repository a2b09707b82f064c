#include "libmocap/io/npz.hpp"
#include "tests/fuzz/target.hpp"
#include "tests/store/sample_clips.hpp"

namespace mocap::fuzz {

std::vector<std::string> seeds() {
  const Clip clip = testing::sample_clip("a", 3, 1);
  const std::string names = io::format_npz({{"s", {{2}, std::vector<std::string>{"a", "b\xc3\xa9"}}}, {"i", {{}, std::vector<std::int64_t>{7}}}, {"f", {{2, 1}, std::vector<double>{1, -2.5}}}});
  return {io::format_npz(io::to_source_layout(clip, {})), io::format_npz(io::to_amass_layout(clip, {})), names};
}

std::vector<std::string> words() { return {"\x93NUMPY\x01\x00", "{'descr': '<f8', 'fortran_order': False, 'shape': (3,), }", "'|O'", "'<U8'", "True", "PK\x03\x04", "PK\x01\x02", "PK\x05\x06", ".npy", "poses", "trans", "(1, 0)"}; }

void one(std::string_view bytes) {
  {
    const io::Npz arrays = io::parse_npz(bytes);
    const io::Npz again = io::parse_npz(io::format_npz(arrays));
    require(arrays.size() == again.size(), "npz read, written and read has its arrays");
    for (const auto& [name, array] : arrays) require(again.contains(name) && again.at(name).shape == array.shape && again.at(name).data.index() == array.data.index(), "npz arrays keep name, shape and kind");
  }
  const io::NpzMotion motion = io::parse_motion_npz(bytes);
  motion.clip.validate();
}

}  // namespace mocap::fuzz
