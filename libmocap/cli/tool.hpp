// What every tool shares: declaration, parsing, batch loop, rejects, progress, provenance, exit status.
// The only room that sees CLI11.
#pragma once
#include <CLI/CLI.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "libmocap/base/error.hpp"
#include "libmocap/base/history.hpp"
#include "libmocap/base/output_file.hpp"
#include "libmocap/base/parallel.hpp"

namespace mocap::cli {

enum class Inputs { none, one, many };             // many: files, folders, @list, "-"
enum class Output { none, file, folder, file_or_folder };

// Which of the common options a tool has. A tool cannot forget what it declares, nor show what it lacks.
struct Traits {
  Inputs inputs = Inputs::one;
  Output output = Output::file;
  bool output_required = true;  // without -o a tool may write to standard output or report only
  bool by_label = false; // inputs come in the order of their labels, whatever that of the command line
  bool batch = false;    // --rejects --fail-fast --shard --skip-existing
  bool random = false;   // --seed (default 1)
  bool threads = true;   // -j
  bool report = false;   // --json
  bool network = false;  // --device
  std::string input_help = "input files";
  std::string output_help = "output file; '-' writes standard output";
};

struct Example {
  std::string command, text;
};

// One input of a batch after folders, lists and shards are resolved.
struct InputFile {
  std::string path;   // to open; "-" for standard input
  std::string label;  // relative to the folder it was found in, or the base name: goes into provenance and outputs.
                      // Unique in the batch: labels that would meet are the paths as typed
  std::string stem;   // what outputs are named by: the label without its extension, or all of it where stems would meet;
                      // may hold '/'; never absolute, no "..". Neither depends on --shard
  std::optional<Error> failure;  // a folder that holds nothing to read: for_each() rejects it
};

// The common options as parsed. `device` is resolved: "cpu" or "cuda".
struct Common {
  std::vector<std::string> inputs;
  std::string output;
  bool force = false, fail_fast = false, skip_existing = false, json = false, quiet = false;
  std::string rejects, shard, device = "cpu", log_level, progress = "auto";
  int verbose = 0, threads = 1;
  std::uint64_t seed = 1;
};

class Tool;

// Handed to Tool::run. Owns nothing a tool could leave half done.
class Context {
 public:
  Context(Tool& tool, CLI::App& app, Common common);
  ~Context();

  const Common& common() const;
  Overwrite overwrite() const;  // from -f; also allowed with --skip-existing, after up_to_date() has said no
  int threads() const;
  std::uint64_t seed() const;
  const std::vector<InputFile>& inputs() const;  // expanded, sorted within folders, sharded; Error(data) for a missing lone one
  const std::vector<InputFile>& all_inputs() const;  // those of every shard
  bool lone_input() const;  // the command line named a single file (or "-"): its own status is the batch's

  // This command as a provenance entry: normalised argv (the tool and the options that change content, effective values,
  // sorted), version, commit, seed; inputs as given. Never -j -o -f -v -q --progress --shard --skip-existing --rejects.
  HistoryEntry history_entry(std::vector<HistoryInput> inputs = {}) const;

  // With --skip-existing: whether `path` exists and carries this command over the same inputs, so that nothing needs doing
  // (same_work below). `read` returns the history a file carries. Error(io) where the file exists, was made by something
  // else and -f was not given: a rerun replaces only its own outputs. Without --skip-existing: false.
  bool up_to_date(const std::string& path, const HistoryEntry& now, const std::function<History(const std::string&)>& read) const;

  // The batch loop. produce(i) runs on worker threads for inputs()[i]; consume(i, result) on this thread in input order.
  // An Error thrown by either is reported, counted and listed in --rejects, and the batch goes on - except Error(io) and
  // Error(internal), which end it, and --fail-fast. Returns the exit status of the batch: ok; some_failed; or, where the
  // command line named a single file, that file's own status.
  template <class T>
  Exit for_each(const std::function<T(const InputFile&)>& produce, const std::function<void(const InputFile&, T&&)>& consume);

  // A progress line on standard error (a bar where it is a terminal, or with --progress always): done of total.
  void progress(std::size_t done, std::size_t total, const std::string& unit);

  // Payload to standard output (buffered, checked at exit). Log lines go through base/log.hpp.
  void print(const std::string& text);

  // Reports a failed input: message, --rejects row, count. Returns whether the batch should stop.
  bool reject(const InputFile& input, const Error& error);
  std::size_t rejected() const;
  Exit batch_status() const;

  // Writes the --rejects table and ends the progress line. run() calls it, also after an error.
  void finish();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// One executable = one Tool. Everything a user can see is declared here.
class Tool {
 public:
  virtual ~Tool() = default;
  virtual std::string name() const = 0;
  virtual std::string synopsis() const = 0;                    // one sentence, no final stop
  virtual std::string description() const { return {}; }       // a paragraph for --help and docs/tools
  virtual std::vector<Example> examples() const = 0;           // two or three
  virtual std::vector<std::string> references() const { return {}; }  // paper and section
  virtual Traits traits() const = 0;
  // The tool's own options, validators from cli/validators.hpp. Defaults are taken from the variables. A vector option
  // takes one value per occurrence. An option whose placeholder starts with FILE enters provenance by its base name.
  virtual void options(CLI::App& app) = 0;
  virtual std::vector<std::string> non_content_options() const { return {}; }  // own options kept out of provenance ("--report")
  virtual std::vector<std::string> version_lines() const { return {}; }        // "LibTorch 1.13.1"; HDF5 and BLAS are found by run()
  virtual bool has_cuda() const { return false; }                              // network tools: what --device may ask for
  virtual bool accepts(const std::string& path) const;  // whether a file found in a folder is an input; formats::probe_motion, and an info line where it gives a reason
  virtual bool check_output_first() const { return true; }  // false: run() leaves an existing -o file to the tool (--resume)
  virtual Exit run(Context& context) = 0;
};

// Whether the last command of `existing` is `now`: same tool, argv, seed and inputs (version and commit may differ).
bool same_work(const History& existing, const HistoryEntry& now);

// Inputs as typed -> files: folders searched (content decides; hidden files, *.part-* and links to folders are passed
// over; sorted bytewise), @lists read, repeated paths dropped, labels and stems made unique. Error(data) for an unreadable
// list, Error(usage) for "-" given twice. `exclude`: the output, passed over where it lies in a searched folder.
std::vector<InputFile> expand_inputs(const std::vector<std::string>& typed, const std::function<bool(const std::string&)>& accepts,
                                     const std::string& exclude = {});

// Every N-th file of the list sorted by path; "I/N" with 1 <= I <= N. Error(usage) otherwise.
std::vector<InputFile> take_shard(std::vector<InputFile> files, const std::string& shard);

// The options that change content as "--name=value", sorted; see Context::history_entry.
std::vector<std::string> normalised_argv(const CLI::App& app, const Tool& tool, const Common& common);

// Parses, runs, reports, checks and closes standard output. Never throws. The process exit status.
int run(Tool& tool, int argc, char** argv);

template <class T>
int run(int argc, char** argv) {
  T tool;
  return run(tool, argc, argv);
}

template <class T>
Exit Context::for_each(const std::function<T(const InputFile&)>& produce, const std::function<void(const InputFile&, T&&)>& consume) {
  struct Outcome {
    std::optional<T> value;
    std::optional<Error> error;
  };
  const auto& files = inputs();
  ordered_pipeline<Outcome>(
      files.size(), threads(),
      [&](std::size_t i) {
        Outcome out;
        try {
          if (files[i].failure) throw Error(*files[i].failure);
          out.value.emplace(produce(files[i]));
        } catch (const Error& e) {
          out.error.emplace(e);
        } catch (const std::exception& e) {
          out.error.emplace(Exit::internal, Where{files[i].path, 0, {}}, e.what());
        }
        return out;
      },
      [&](std::size_t i, Outcome&& out) {
        try {
          if (out.error) throw Error(*out.error);
          consume(files[i], std::move(*out.value));
        } catch (const Error& e) {
          if (e.status() == Exit::io || e.status() == Exit::internal) throw;
          if (reject(files[i], e)) return false;
        }
        progress(i + 1, files.size(), "files");
        return true;
      });
  return batch_status();
}

}  // namespace mocap::cli
