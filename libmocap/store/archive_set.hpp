// Several motion archives read as one: what joins and selects clips.
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "libmocap/store/archive.hpp"

namespace mocap::store {

// Archives of one skeleton (1e-6 m; roles that do not contradict), one rate and one rule for contacts. Memory holds their
// indexes and a chunk or two of each.
class ArchiveSet {
 public:
  struct Item {
    std::size_t archive = 0, clip = 0;
    std::string name;  // unique among the items
  };

  // Error(data) for what is no archive, what does not fit the first one (naming the joint and by how much), and a file that is given twice under
  // whatever name.
  explicit ArchiveSet(const std::vector<std::string>& paths);

  std::size_t size() const { return archives_.size(); }
  const ArchiveReader& archive(std::size_t a) const { return *archives_.at(a); }
  // Of a file that holds the clips of all: the roles, attribute columns and judged classes of all, no history.
  const ArchiveHeader& header() const { return header_; }

  // All clips, archive after archive, under their names; a name that another clip had before becomes "NAME#2", "#3", ... Error(data) where that clip
  // has the same digest too: it was given twice.
  std::vector<Item> items() const;
  // The clips of shards of one command, in source_order. What a shard had to name "NAME#2", because NAME was taken in it, counts as NAME, so that
  // names are those of a single run.
  std::vector<Item> items_of_shards() const;

  const ClipInfo& info(const Item& item) const { return archive(item.archive).info(item.clip); }
  Clip read(const Item& item) const;  // under the item's name

 private:
  void refuse_repeated() const;

  std::vector<std::unique_ptr<ArchiveReader>> archives_;
  ArchiveHeader header_;
};

}  // namespace mocap::store
