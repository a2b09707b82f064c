// HDF5 as this project uses it, and the only place that sees its C interface. Internal to libmocap/store.
//
// Written: metadata of version 1.10 (checksummed), every dataset chunked with shuffle + Fletcher-32, no time stamps, strings
// of fixed length padded with NUL. Read: only such files, from a superblock checked on the raw bytes to sizes checked
// against the file, so that nothing is allocated for a size that is only declared.
// HDF5 is not thread-safe: every member function takes library_mutex().
#pragma once
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "libmocap/base/error.hpp"
#include "libmocap/base/output_file.hpp"

namespace mocap::store::h5 {

using Shape = std::vector<std::uint64_t>;
inline constexpr std::uint64_t kAny = ~std::uint64_t{0};     // in an expected shape: any extent
inline constexpr std::uint64_t kChunkBytes = 1 << 20;        // written
inline constexpr std::uint64_t kChunkBytesLimit = 16 << 20;  // accepted: HDF5 allocates a whole chunk to read a part of it

enum class Type { u8, i32, i64, f32, f64 };  // little-endian in the file
template <class T>
Type type_of();

std::recursive_mutex& library_mutex();

// One link name or attribute name from any text: "%" and "/" become %25 and %2F, a lone "." becomes %2E; and back.
std::string escape_link(std::string_view name);
std::string unescape_link(std::string_view link);

// After HDF5 failed to write, its exit handler crashes: logs "tool: PATH: what", unlinks every unfinished output of this
// process and leaves with status 4, running no exit handlers. `path` is the output as the user named it.
[[noreturn]] void abandon_output(const std::string& path, const std::string& what);

// Writes one file behind an OutputFile. Until HDF5 has created the file failures are Error(io); after that a failed call
// ends in abandon_output().
class Writer {
 public:
  Writer(const std::string& path, Overwrite mode);
  ~Writer();
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  // Groups above a dataset are made where they are missing.
  void group(const std::string& path);
  void attribute(const std::string& name, std::string_view text);  // all of the root group
  void attribute(const std::string& name, std::int32_t value);
  void attribute(const std::string& name, double value);
  void attribute_of(const std::string& dataset, const std::string& name, std::int32_t value);
  void dataset(const std::string& path, Type type, const Shape& shape, const void* values);
  void strings(const std::string& path, const std::vector<std::string>& values, Shape shape = {});  // default [values.size()]
  void bytes(const std::string& path, std::string_view text) { dataset(path, Type::u8, {text.size()}, text.data()); }
  template <class T>
  void values(const std::string& path, const std::vector<T>& v, Shape shape = {}) {
    dataset(path, type_of<T>(), shape.empty() ? Shape{v.size()} : shape, v.data());
  }

  // `complete` is written last; then flush, close, fsync, publish. Nothing can be written afterwards.
  void finish(const std::string& complete);

 private:
  friend class Rows;
  struct State;
  std::unique_ptr<State> state_;
};

// A dataset that grows by rows; memory holds one chunk of them. A file of less than one chunk stores no padding.
class Rows {
 public:
  Rows(Writer& writer, std::string path, Type type, Shape row, std::uint64_t chunk_rows, int deflate);
  ~Rows();
  Rows(const Rows&) = delete;
  Rows& operator=(const Rows&) = delete;

  // Room for up to `want` rows to be filled in place (at least one); commit() the rows that were filled.
  void* space(std::uint64_t want, std::uint64_t& got);
  void commit(std::uint64_t rows);
  void finish();  // before Writer::finish
  std::uint64_t size() const { return written_ + buffered_; }

 private:
  void flush();
  Writer& writer_;
  std::string path_;
  Type type_;
  Shape row_;
  std::uint64_t row_bytes_, chunk_rows_, written_ = 0, buffered_ = 0;
  int deflate_;
  std::vector<unsigned char> buffer_;
  std::int64_t id_ = -1;
};

class Dataset;

// One file opened read-only, without locks. `expected` ("motion archive") completes the refusals. "-" and everything that
// is no regular file is spooled to an unlinked file in $TMPDIR first. `cache_bytes`: of unpacked chunks, for each dataset.
class Reader {
 public:
  Reader(const std::string& path, std::string expected, std::uint64_t cache_bytes = 4 * kChunkBytes);
  ~Reader();
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;

  const std::string& name() const;     // path, or "<stdin>"
  std::uint64_t file_bytes() const;
  std::string file_sha256() const;     // hexadecimal; reads the whole file on the first call

  // Root attributes; nullopt where there is none, Error(data) where it has another type.
  std::optional<std::string> text_attribute(const std::string& name) const;
  std::optional<std::int32_t> int_attribute(const std::string& name) const;
  std::optional<double> double_attribute(const std::string& name) const;
  // Refuses a file of another format or version, one whose fixed attributes differ, and one without `complete`; returns that.
  std::string require_format(const std::string& format, std::int32_t version) const;
  void require_attribute(const std::string& name, const std::string& value) const;

  bool has(const std::string& path) const;   // Error(data) where a link on the way is not hard
  bool is_group(const std::string& path) const;
  std::vector<std::string> list(const std::string& group) const;      // link names, sorted; empty where there is no such group
  std::vector<std::string> datasets(const std::string& group) const;  // paths of all datasets below, sorted; bounded for any file
  Dataset open(const std::string& path) const;

  // Whole datasets. The shape must fit `expected` (kAny fits anything).
  template <class T>
  std::vector<T> values(const std::string& path, const Shape& expected, Shape* found = nullptr) const;
  std::vector<std::string> strings(const std::string& path, const Shape& expected) const;
  std::string bytes(const std::string& path) const;

  [[noreturn]] void refuse(const std::string& object, const std::string& what, const std::string& hint = {}) const;

 private:
  friend class Dataset;
  struct State;
  std::unique_ptr<State> state_;
};

// A dataset of a Reader, which must outlive it. It passed the checks: chunked, Fletcher-32, known filters, all chunks present, no larger than
// the file can hold.
class Dataset {
 public:
  Dataset(Dataset&&) noexcept;
  Dataset& operator=(Dataset&&) = delete;
  ~Dataset();

  const Shape& shape() const { return shape_; }
  const std::string& path() const { return path_; }
  std::uint64_t elements() const;
  std::uint64_t element_bytes() const { return element_bytes_; }
  std::optional<Type> type() const { return type_; }  // nullopt: strings of fixed length
  std::optional<std::int32_t> int_attribute(const std::string& name) const;
  void require(Type type, const Shape& expected) const;
  void require_strings(const Shape& expected) const;
  // Rows [first, first + count) of the first axis, as they are in the file. Error(data): a damaged chunk.
  void read(std::uint64_t first, std::uint64_t count, void* out) const;
  void verify() const;  // reads everything, chunk by chunk

 private:
  friend class Reader;
  Dataset(const Reader& reader, const std::string& path);
  void require_shape(const Shape& expected) const;
  const Reader* reader_;
  std::string path_;
  std::int64_t id_ = -1, type_id_ = -1;
  std::optional<Type> type_;
  Shape shape_;
  std::uint64_t element_bytes_ = 0, chunk_rows_ = 1;
};

template <class T>
std::vector<T> Reader::values(const std::string& path, const Shape& expected, Shape* found) const {
  const Dataset set = open(path);
  set.require(type_of<T>(), expected);
  std::vector<T> out(set.elements());
  if (!out.empty()) set.read(0, set.shape()[0], out.data());
  if (found) *found = set.shape();
  return out;
}

}  // namespace mocap::store::h5
