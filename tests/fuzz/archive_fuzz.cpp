#include <fstream>
#include <iterator>

#include "libmocap/store/archive.hpp"
#include "tests/fuzz/target.hpp"
#include "tests/store/sample_clips.hpp"

namespace mocap::fuzz {

std::vector<std::string> seeds() {
  static const std::vector<std::string> made = [] {
    std::vector<std::string> out;
    for (const int deflate : {0, 4}) {
      std::vector<Clip> clips = {testing::with_contacts(testing::sample_clip("a", 4, 1)), testing::with_contacts(testing::sample_clip("b", 2, 2))};
      clips[0].attributes["action"] = "walking";
      clips[1].segments.push_back({0, 1, {{"action", "running"}}});
      clips[1].path = {{0, 0}, {1, 2}};
      const std::string path = scratch("seed.h5");
      testing::write_archive(path, clips, "preset:default", deflate);
      std::ifstream in(path, std::ios::binary);
      out.emplace_back(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
    }
    return out;
  }();
  return made;
}

std::vector<std::string> words() { return {"\x89HDF\r\n\x1a\n", "OHDR", "OCHK", "FRHP", "BTHD", "SNOD", "mocap-motion", "mocap-model", "/frames/rotations", "complete"}; }

void one(std::string_view bytes) {
  const std::string& path = as_file(bytes);
  const store::ArchiveReader reader(path);
  std::vector<Clip> clips;
  for (std::size_t i = 0; i < reader.size(); ++i) clips.push_back(reader.read(i));
  for (const Clip& clip : clips) clip.validate();
  if (clips.empty() || !reader.check(true).empty()) return;
  const std::string copy = scratch("copy.h5");
  {
    store::ArchiveWriter writer(copy, Overwrite::allow, reader.header());
    for (const Clip& clip : clips) writer.add(clip);
    writer.finish();
  }
  require(store::ArchiveReader(copy).digest() == reader.digest(), "an archive read, written and read has its digest");
}

}  // namespace mocap::fuzz
