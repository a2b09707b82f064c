// The motion archive: many clips of one skeleton and rate in one HDF5 file (contract/motion-archive.md).
//
// Where that leaves a choice: /clips/source_sha256 holds 64 hexadecimal digits, "" for generated motion. An attribute or
// clip name becomes the name of a dataset under /clips/attributes or /paths with "%" as %25, "/" as %2F and a lone "." as
// %2E. Texts are UTF-8 without NUL; others are refused. An attribute that no clip labels leaves an all-empty column.
// Frames are chunked by rows, a quarter of a megabyte of rotations to a chunk; a smaller file has one chunk of its own size.
#pragma once
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "libmocap/base/history.hpp"
#include "libmocap/base/output_file.hpp"
#include "libmocap/base/sha256.hpp"
#include "libmocap/clip/clip.hpp"

namespace mocap::store {

struct ArchiveHeader {
  std::shared_ptr<const Skeleton> skeleton;
  double frame_rate_hz = 30;
  std::string contacts_rule;  // "preset:NAME", "model", or "" where clips have no contacts
  History history;
  // Columns of /clips/attributes and /segments/attributes that are there whether or not a clip or segment is labelled. A
  // reader fills them, so that a copy has the columns of its original.
  std::set<std::string> attributes = {}, segment_attributes = {};
  // /clips/attribute_classes: attribute -> classes, the columns of /clips/attribute_probability. Clips that no classifier saw have zeros there.
  std::map<std::string, std::vector<std::string>> attribute_classes = {};
};

// Writes clips one after the other; memory holds only the index. The file appears at `path` (or on standard output for
// "-") when finish() returns, not before (OutputFile). Equal clips and header give equal bytes.
// Throws Error(data) where a clip has another skeleton (1e-6 m) or rate, breaks an invariant, has a name that occurred
// before, has contacts where the header names no rule for them or the reverse, probabilities outside [0, 1] (of attributes and classes that
// the header does not name they are left out), or a source whose scale is not above 0 or whose times,
// rate, yaw or origin are not finite; Error(io) where the file cannot be
// created or published. A failed write in between ends the process with status 4 (message, unfinished outputs unlinked):
// HDF5 cannot be left any other way then.
// Cost: 1.6 million frames/s of 22 joints on one core at 3 GHz.
class ArchiveWriter {
 public:
  ArchiveWriter(const std::string& path, Overwrite mode, ArchiveHeader header, int deflate = 0);
  ~ArchiveWriter();
  void add(const Clip& clip);  // rotations are stored as float32, sign-continuous; translations are refused
  void set_history(History history);  // until finish(): inputs are known only when all were read
  void finish();
  std::size_t size() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// A clip without its frames.
struct ClipInfo {
  std::string name;
  std::int64_t start = 0, length = 0;
  Attributes attributes;
  ClipSource source;
  std::string digest;  // hexadecimal
  std::vector<Segment> segments;
  std::size_t path_points = 0;
};

// How many chunks of each dataset stay unpacked in memory: 4 MB, or 1 MB where clips are read one after the other.
enum class Caching { random, in_order };

// Opens read-only and without locks; "-" spools standard input to an unlinked file in $TMPDIR. Only the index is read on
// opening (20,000 clips: 20 ms); a clip is read in under 1 ms and a chunk's other clips from memory. Sizes are checked against
// the file before any allocation. Error(data) for whatever is no finished archive. Rotations come back as they are stored:
// unit within 1e-7, sign-continuous, so that writing a clip again gives the same bytes. /clips/source_unit, source_up_axis,
// source_scale, source_yaw and source_origin may be missing (written before they were): clips then have ClipSource's defaults.
// Not thread-safe (HDF5 is not): one reader per thread at a time, calls serialised by the class.
class ArchiveReader {
 public:
  explicit ArchiveReader(const std::string& path, Caching caching = Caching::random);
  ~ArchiveReader();
  const ArchiveHeader& header() const;
  std::size_t size() const;
  const ClipInfo& info(std::size_t i) const;
  Clip read(std::size_t i) const;
  std::string digest() const;              // of the whole content: SHA-256 over the sorted clip digests
  std::string file_sha256() const;         // of the file's bytes, for the history of what reads it
  const std::string& name() const;         // path, or "<stdin>"
  // Checks beyond opening. quick: index, markers. full: every checksum, digest and invariant. One line per defect found.
  std::vector<std::string> check(bool full) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// What kind of HDF5 file of ours this is: "mocap-motion", "mocap-model" or "" (also for anything that is no HDF5).
std::string probe(const std::string& path);

// SHA-256 of a clip's content as the archive defines it, little-endian:
//   frame_rate_hz                      float64
//   skeleton  J; names; parents        int32; per name its length in bytes as int32, then the bytes; J int32
//             E; parents of end sites  int32; E int32
//             rest and tip offsets     (J+E) x 3 float32
//   rotations                          T x J x 4 float32, wxyz, unit, sign-continuous, first frame w >= 0, no negative zeros
//   root_position                      T x 3 float32
//   contacts                           T x 2 uint8, where there are any
// The float32 values are those the archive stores, so a clip read back has the digest of the clip written, as have clips
// that differ in the signs of quaternions. Error(data) where the clip breaks an invariant.
Digest clip_digest(const Clip& clip);

// The order of clips made from files: by source path, then phase, then mirrored, then where in the source they start. What
// `canonicalize` writes and `motion-merge` restores, so that shards join to the bytes of a single run. Not total: sort stably.
bool source_order(const ClipSource& a, const ClipSource& b);

}  // namespace mocap::store
