// Provenance: which commands made a file, carried inside it (contract/motion-archive.md, /history).
#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace mocap {

struct HistoryInput {
  std::string path;    // relative to the folder given; a lone file: its base name; "-" for standard input
  std::string sha256;  // hexadecimal
};

struct HistoryEntry {
  std::string tool, version, commit;
  std::vector<std::string> argv;  // normalised: the tool, then the options that change content with effective values, sorted
  std::optional<std::uint64_t> seed;
  std::vector<HistoryInput> inputs;
};

using History = std::vector<HistoryEntry>;  // oldest first

// UTF-8 JSON lines, one entry a line, keys in a fixed order; and back (Error(data) naming the line).
std::string to_json_lines(const History& history);
History parse_history(const std::string& json_lines, const std::string& file);

// Histories of several inputs in one: entries of one command (same tool, version, commit, argv, seed) become one entry
// with the inputs of all, in the order of first appearance.
void merge_into(History& history, const History& other);

// The same whatever the order of the inputs, and whether they are added one by one or as unions of some of them: what an
// array job needs. Entries of one command become one entry, its inputs sorted by path; a command that occurs twice in one
// history stays two entries. An entry comes after those that precede it in any history; where that leaves a choice, or
// contradicts itself, the entries' text decides.
class HistoryUnion {
 public:
  void add(const History& history);
  History merged() const;

 private:
  struct Node {
    HistoryEntry entry;  // without inputs
    std::set<std::pair<std::string, std::string>> inputs;
    std::set<std::string> after;  // keys of the entries right before it in some history
  };
  std::map<std::string, Node> nodes_;  // by the entry's text and its how-manieth occurrence
};

// Sorted by path, then digest.
void sort_inputs(std::vector<HistoryInput>& inputs);

// The pipeline as a shell script, one command a line, inputs as comments.
std::string to_shell(const History& history);

}  // namespace mocap
