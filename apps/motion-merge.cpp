// motion-merge - several archives, or the shards of an array job, in one.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <set>

#include "libmocap/base/log.hpp"
#include "libmocap/cli/tool.hpp"
#include "libmocap/store/archive_set.hpp"

namespace {

using namespace mocap;

// Tools of which --shard gives a part of one archive.
constexpr std::array kSharded = {"canonicalize"};

bool same_command(const HistoryEntry& a, const HistoryEntry& b) {
  return a.tool == b.tool && a.version == b.version && a.commit == b.commit && a.argv == b.argv && a.seed == b.seed;
}

bool are_shards(const store::ArchiveSet& set) {
  for (std::size_t a = 0; a < set.size(); ++a) {
    const History& history = set.archive(a).header().history;
    if (history.empty() || std::find(kSharded.begin(), kSharded.end(), history.back().tool) == kSharded.end()) return false;
    if (!same_command(history.back(), set.archive(0).header().history.back())) return false;
  }
  return true;
}

// The history of the command as it would be without --shard.
History history_of_shards(const store::ArchiveSet& set) {
  HistoryUnion before;
  HistoryUnion command;
  for (std::size_t a = 0; a < set.size(); ++a) {
    History history = set.archive(a).header().history;
    command.add({history.back()});
    history.pop_back();
    before.add(history);
  }
  History history = before.merged();
  history.push_back(command.merged().front());
  return history;
}

class MotionMerge final : public cli::Tool {
 public:
  std::string name() const override { return "motion-merge"; }
  std::string synopsis() const override { return "Join motion archives, or the shards of an array job, into one"; }
  std::string description() const override {
    return "Archives that one canonicalize command wrote in parts (--shard) become the archive that it would have written whole, byte for byte, in whatever "
           "order they are given: its history, and the clips sorted by source, phase and mirrored copy. A shard that is missing cannot be noticed; -v prints the "
           "clips of each input. Any other archives are joined in the order given. All must have one skeleton, one rate and one rule for contacts. A name that "
           "occurs again becomes NAME#2; the same clip twice is refused, and so is an archive that cannot be read: nothing is written then.";
  }
  std::vector<cli::Example> examples() const override {
    return {{"motion-merge shards/*.h5 -o all.h5", "after: canonicalize mocap/ --shard $i/8 -o shards/$i.h5, for i from 1 to 8"},
            {"motion-merge cmu.h5 bandai.h5 -o both.h5", "two data sets, one after the other"},
            {"motion-merge -v shards/ -o - | motion-info -", "every archive of a folder, the clips of each named"}};
  }
  cli::Traits traits() const override {
    cli::Traits t;
    t.inputs = cli::Inputs::many;
    t.output = cli::Output::file;
    t.threads = false;
    t.input_help = "motion archives";
    t.output_help = "motion archive; '-' writes standard output";
    return t;
  }
  void options(CLI::App&) override {}
  bool accepts(const std::string& path) const override { return store::probe(path) == "mocap-motion"; }

  Exit run(cli::Context& context) override {
    std::set<std::string> typed;
    for (const auto& path : context.common().inputs)
      if (!typed.insert(std::filesystem::path(path).lexically_normal().string()).second) refuse_usage(path + ": given twice, expected each archive once");
    std::vector<std::string> paths;
    for (const auto& input : context.inputs()) {
      if (input.failure) throw Error(*input.failure);
      paths.push_back(input.path);
    }
    const store::ArchiveSet set(paths);
    const bool shards = are_shards(set);
    store::ArchiveHeader header = set.header();
    if (shards) {
      header.history = history_of_shards(set);
    } else {
      std::vector<HistoryInput> inputs;
      for (std::size_t a = 0; a < set.size(); ++a) {
        merge_into(header.history, set.archive(a).header().history);
        inputs.push_back({context.inputs()[a].label, set.archive(a).file_sha256()});
      }
      header.history.push_back(context.history_entry(std::move(inputs)));
    }
    for (std::size_t a = 0; a < set.size(); ++a) log::debug("{}: {} clips", set.archive(a).name(), set.archive(a).size());

    const auto items = shards ? set.items_of_shards() : set.items();
    store::ArchiveWriter writer(context.common().output, context.overwrite(), header);
    for (const auto& item : items) {
      const std::string& own = set.info(item).name;
      if (item.name != own) log::info("{}: clip {} is now {}", set.archive(item.archive).name(), own, item.name);
      writer.add(set.read(item));
      context.progress(writer.size(), items.size(), "clips");
    }
    writer.finish();
    log::info("{} clips of {} {}", items.size(), set.size(), shards ? (set.size() == 1 ? "shard" : "shards of one command") : (set.size() == 1 ? "archive" : "archives"));
    return Exit::ok;
  }
};

}  // namespace

int main(int argc, char** argv) { return mocap::cli::run<MotionMerge>(argc, argv); }
