// What an ArchiveReader holds: the index, and the frame datasets open. Internal to libmocap/store.
#pragma once
#include <array>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "libmocap/store/archive.hpp"
#include "libmocap/store/common_parts.hpp"
#include "libmocap/store/hdf5.hpp"

namespace mocap::store {

struct ArchiveReader::State {
  State(const std::string& path, Caching caching);

  struct RawClip {  // as stored
    std::vector<float> rotations, root_position;
    std::vector<std::array<std::uint8_t, 2>> contacts;
  };
  RawClip read_raw(std::size_t i) const;
  // Error(data) where the frames break an invariant of Clip.
  Clip assemble(std::size_t i, RawClip&& raw) const;

  h5::Reader in;  // before the datasets: it must outlive them
  ArchiveHeader header;
  std::vector<ClipInfo> clips;
  std::unordered_map<std::string, std::size_t> by_name;
  std::string digest;
  std::optional<h5::Dataset> rotations, root_position, contacts;
  std::map<std::string, std::vector<float>> probability;  // attribute -> [N,C]

 private:
  void read_index(const Complete& complete);
  void read_source_frames();
  void read_probabilities();
  void open_frames();
  void read_segments();
  void read_path_sizes();
};

}  // namespace mocap::store
