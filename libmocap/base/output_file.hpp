// Output that appears whole or not at all, and input as bytes.
#pragma once
#include <string>
#include <string_view>

#include "libmocap/base/sha256.hpp"

namespace mocap {

enum class Overwrite { refuse, allow };

// Refuses, before any work, an output that cannot be published: it exists and may not be replaced, its folder does not
// exist or cannot be written, it is a folder, device or pipe (Error(io)), or it is "-" and standard output is a terminal (Error(usage)).
void check_output(const std::string& path, Overwrite mode);

// Bytes go to PATH.part-XXXXXX in the same folder; commit() = fsync, link or rename over PATH, fsync of the folder.
// Destroyed without commit(): the .part file is unlinked and PATH is untouched. PATH "-": an unlinked-on-exit temporary
// file in $TMPDIR, copied to standard output by commit(), so that a pipe receives a whole document or nothing.
// With Overwrite::refuse, of several racing writers exactly one publishes. Throws Error(io) on any failed call.
class OutputFile {
 public:
  OutputFile(std::string path, Overwrite mode);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  const std::string& part_path() const { return part_; }  // for writers that open the file themselves (HDF5, cairo)
  const std::string& path() const { return path_; }
  void write(std::string_view bytes);
  void commit();

 private:
  [[noreturn]] void fail(const char* operation) const;
  std::string path_, part_;
  int fd_ = -1;
  Overwrite mode_;
};

// One call: a whole small output.
void write_file(const std::string& path, std::string_view bytes, Overwrite mode);

// All bytes of a file, or of standard input for "-"; gzip is recognised by content and expanded. Error(data) where it
// cannot be read; `limit` bounds the (expanded) size against hostile input. `digest`, where given, receives the SHA-256 of
// the file's own bytes, as sha256sum prints it.
std::string read_file(const std::string& path, std::size_t limit = std::size_t{1} << 36, Digest* digest = nullptr);

// Writes all bytes to standard output's descriptor; Error(io) on failure (EPIPE included where SIGPIPE is ignored).
void write_stdout(std::string_view bytes);

// A fresh temporary file's path in $TMPDIR (default /tmp); the caller unlinks it.
std::string temporary_file(const std::string& stem);

}  // namespace mocap
