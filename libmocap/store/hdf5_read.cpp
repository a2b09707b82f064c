#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include "libmocap/base/checked.hpp"
#include "libmocap/base/sha256.hpp"
#include "libmocap/base/utf8.hpp"
#include "libmocap/store/hdf5_handle.hpp"

namespace mocap::store::h5 {
namespace {

constexpr std::uint64_t kTextAttributeLimit = 1 << 16;
constexpr std::uint64_t kDeflateRatio = 1032;  // the most that deflate can expand (zlib technical details)
constexpr int kRankLimit = 8;
constexpr std::size_t kDepthLimit = 16;

std::string text(const Shape& shape) {
  std::string s = "[";
  for (std::size_t i = 0; i < shape.size(); ++i) s += (i ? "," : "") + (shape[i] == kAny ? std::string("*") : std::to_string(shape[i]));
  return s + "]";
}

const char* text(Type type) {
  switch (type) {
    case Type::u8: return "uint8";
    case Type::i32: return "int32";
    case Type::i64: return "int64";
    case Type::f32: return "float32";
    case Type::f64: return "float64";
  }
  return "";
}

std::string without_slash(const std::string& path) { return path.starts_with('/') ? path.substr(1) : path; }

struct Descriptor {
  int fd = -1;
  ~Descriptor() {
    if (fd >= 0) ::close(fd);
  }
};

std::size_t read_some(int fd, char* out, std::size_t size, const std::string& name) {
  while (true) {
    const ssize_t n = ::read(fd, out, size);
    if (n >= 0) return static_cast<std::size_t>(n);
    if (errno != EINTR) mocap::refuse({name, 0, {}}, std::string("cannot be read: ") + std::strerror(errno));
  }
}

}  // namespace

struct Reader::State {
  std::string name, expected;
  Descriptor bytes;      // for checks and the digest; the path may be gone
  std::string spooled;   // temporary file, until HDF5 has opened it
  std::uint64_t size = 0;
  mutable std::string sha256;
  Id file;

  ~State() {
    if (!spooled.empty()) ::unlink(spooled.c_str());
  }

  void spool(int from) {
    spooled = temporary_file("mocapkit-stdin");
    Descriptor to{::open(spooled.c_str(), O_RDWR | O_CLOEXEC)};
    const auto io = [&] { throw Error(Exit::io, {spooled, 0, {}}, std::string("write failed: ") + std::strerror(errno)); };
    if (to.fd < 0) io();
    std::string block(1 << 18, '\0');
    while (const std::size_t n = read_some(from, block.data(), block.size(), name)) {
      for (std::size_t done = 0; done < n;) {
        const ssize_t w = ::write(to.fd, block.data() + done, n - done);
        if (w < 0 && errno != EINTR) io();
        if (w > 0) done += static_cast<std::size_t>(w);
      }
    }
    std::swap(bytes.fd, to.fd);
  }

  // The superblock on the raw bytes, before the library parses anything: versions 2 and 3 carry a checksum and the end of
  // the file (HDF5 file format specification, II.A).
  void check_superblock() const {
    std::array<unsigned char, 48> b{};
    const Where where{name, 0, {}};
    if (size == 0) mocap::refuse(where, "an empty file, expected a " + expected);
    const ssize_t n = ::pread(bytes.fd, b.data(), b.size(), 0);
    if (n < 8 || std::memcmp(b.data(), "\x89HDF\r\n\x1a\n", 8) != 0) mocap::refuse(where, "not an HDF5 file, expected a " + expected);
    if (n < static_cast<ssize_t>(b.size())) mocap::refuse(where, "truncated: " + std::to_string(n) + " bytes, expected at least " + std::to_string(b.size()));
    if (b[8] != 2 && b[8] != 3) mocap::refuse(where, "an HDF5 file with superblock version " + std::to_string(b[8]) + ", expected a " + expected + " (version 2 or 3)");
    const auto number = [&](std::size_t at) {
      std::uint64_t v = 0;
      for (std::size_t k = 8; k-- > 0;) v = v << 8 | b[at + k];
      return v;
    };
    if (b[9] != 8 || b[10] != 8 || number(12) != 0 || number(20) != ~std::uint64_t{0})
      mocap::refuse(where, "an HDF5 file with settings that no " + expected + " has");
    if (b[11] != 0) mocap::refuse(where, "unfinished: the program that wrote it did not end properly");
    const std::uint64_t end = number(28);
    if (end > size) mocap::refuse(where, "truncated: " + std::to_string(size) + " bytes, expected " + std::to_string(end));
    if (end < size) mocap::refuse(where, std::to_string(size) + " bytes, expected " + std::to_string(end) + ": something follows the " + expected);
  }

  bool link_is_hard(const std::string& path) const {
    H5L_info_t info;
    return H5Lget_info(file.get(), path.c_str(), &info, H5P_DEFAULT) >= 0 && info.type == H5L_TYPE_HARD;
  }
};

Reader::Reader(const std::string& path, std::string expected, std::uint64_t cache_bytes) : state_(std::make_unique<State>()) {
  State& s = *state_;
  s.name = path == "-" ? "<stdin>" : path;
  s.expected = std::move(expected);
  struct stat info {};
  if (path == "-") {
    s.spool(STDIN_FILENO);
  } else {
    s.bytes.fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
    if (s.bytes.fd < 0 || ::fstat(s.bytes.fd, &info) != 0) mocap::refuse({path, 0, {}}, std::string("cannot be opened: ") + std::strerror(errno));
    if (S_ISDIR(info.st_mode)) mocap::refuse({path, 0, {}}, "is a folder, expected a " + s.expected);
    if (!S_ISREG(info.st_mode)) {
      Descriptor from;
      std::swap(from.fd, s.bytes.fd);
      s.spool(from.fd);
    }
  }
  if (::fstat(s.bytes.fd, &info) != 0) refuse({}, std::string("cannot be read: ") + std::strerror(errno));
  s.size = static_cast<std::uint64_t>(info.st_size);
  s.check_superblock();

  const Lock lock(library_mutex());
  const Id access(H5Pcreate(H5P_FILE_ACCESS));
  // A chunk is read once for the clips that share it: the cache of each dataset holds a few.
  if (H5Pset_fclose_degree(access.get(), H5F_CLOSE_STRONG) < 0 || H5Pset_cache(access.get(), 0, 521, cache_bytes, 0.75) < 0
#if H5_VERSION_GE(1, 10, 7)
      || H5Pset_file_locking(access.get(), false, true) < 0
#endif
  )
    throw Error(Exit::internal, {s.name, 0, {}}, "cannot set up HDF5");
  s.file = Id(H5Fopen((s.spooled.empty() ? path : s.spooled).c_str(), H5F_ACC_RDONLY, access.get()));
  if (!s.file.ok()) {
    last_failure();
    refuse({}, "a damaged HDF5 file, expected a " + s.expected);
  }
  if (!s.spooled.empty()) ::unlink(std::exchange(s.spooled, {}).c_str());
}

Reader::~Reader() {
  const Lock lock(library_mutex());
  state_.reset();
}

const std::string& Reader::name() const { return state_->name; }
std::uint64_t Reader::file_bytes() const { return state_->size; }

std::string Reader::file_sha256() const {
  const Lock lock(library_mutex());
  const State& s = *state_;
  if (!s.sha256.empty()) return s.sha256;
  Sha256 hash;
  std::string block(1 << 18, '\0');
  if (::lseek(s.bytes.fd, 0, SEEK_SET) < 0) refuse({}, std::string("cannot be read: ") + std::strerror(errno));
  while (const std::size_t n = read_some(s.bytes.fd, block.data(), block.size(), s.name)) hash.update(block.data(), n);
  return s.sha256 = to_hex(hash.finish());
}

void Reader::refuse(const std::string& object, const std::string& what, const std::string& hint) const {
  mocap::refuse({state_->name, 0, without_slash(object)}, what, hint);
}

namespace {

// Reads one scalar attribute after checking its size. `wanted`: exact type, or -1 for a string of fixed length.
std::optional<std::string> attribute_bytes(const Reader& reader, hid_t object, const std::string& name, hid_t wanted) {
  const htri_t there = H5Aexists(object, name.c_str());
  if (there == 0) return std::nullopt;
  const std::string label = "attribute " + name;
  const Id attribute(there < 0 ? -1 : H5Aopen(object, name.c_str(), H5P_DEFAULT));
  const Id type(attribute.ok() ? H5Aget_type(attribute.get()) : -1), space(attribute.ok() ? H5Aget_space(attribute.get()) : -1);
  if (!type.ok() || !space.ok()) {
    last_failure();
    reader.refuse(label, "cannot be read: the file is damaged");
  }
  const bool scalar = H5Sget_simple_extent_type(space.get()) == H5S_SCALAR;
  const bool fits = wanted < 0 ? H5Tget_class(type.get()) == H5T_STRING && H5Tis_variable_str(type.get()) == 0 && H5Tget_size(type.get()) <= kTextAttributeLimit
                               : H5Tequal(type.get(), wanted) > 0;
  if (!scalar || !fits) reader.refuse(label, std::string("of another type, expected ") + (wanted < 0 ? "one string of fixed length" : "one number"));
  std::string value(H5Tget_size(type.get()), '\0');
  if (H5Aread(attribute.get(), type.get(), value.data()) < 0) {
    last_failure();
    reader.refuse(label, "cannot be read: the file is damaged");
  }
  return value;
}

template <class T>
std::optional<T> number_attribute(const Reader& reader, hid_t object, const std::string& name, Type type) {
  const auto bytes = attribute_bytes(reader, object, name, file_type(type));
  if (!bytes) return std::nullopt;
  T value;
  std::memcpy(&value, bytes->data(), sizeof value);
  return value;
}

}  // namespace

std::optional<std::string> Reader::text_attribute(const std::string& name) const {
  const Lock lock(library_mutex());
  auto value = attribute_bytes(*this, state_->file.get(), name, -1);
  if (!value) return value;
  value->erase(value->find_last_not_of('\0') + 1);
  if (!is_utf8(*value)) refuse("attribute " + name, "is not UTF-8");
  return value;
}

std::optional<std::int32_t> Reader::int_attribute(const std::string& name) const {
  const Lock lock(library_mutex());
  return number_attribute<std::int32_t>(*this, state_->file.get(), name, Type::i32);
}

std::optional<double> Reader::double_attribute(const std::string& name) const {
  const Lock lock(library_mutex());
  return number_attribute<double>(*this, state_->file.get(), name, Type::f64);
}

std::optional<std::int32_t> Dataset::int_attribute(const std::string& name) const {
  const Lock lock(library_mutex());
  return number_attribute<std::int32_t>(*reader_, static_cast<hid_t>(id_), name, Type::i32);
}

std::string Reader::require_format(const std::string& format, std::int32_t version) const {
  const auto found = text_attribute("format");
  if (!found) refuse({}, "an HDF5 file without the attribute format, expected a " + state_->expected);
  if (*found != format) refuse("attribute format", "'" + *found + "', expected '" + format + "': not a " + state_->expected);
  const auto number = int_attribute("format_version");
  if (!number) refuse("attribute format_version", "missing, expected " + std::to_string(version));
  if (*number != version)
    refuse("attribute format_version", std::to_string(*number) + ", expected " + std::to_string(version),
           *number > version ? "written by a newer release" : std::string());
  const auto complete = text_attribute("complete");
  if (!complete) refuse("attribute complete", "missing: the file is unfinished");
  return *complete;
}

void Reader::require_attribute(const std::string& name, const std::string& value) const {
  const auto found = text_attribute(name);
  if (!found) refuse("attribute " + name, "missing, expected '" + value + "'");
  if (*found != value) refuse("attribute " + name, "'" + *found + "', expected '" + value + "'");
}

bool Reader::has(const std::string& path) const {
  const Lock lock(library_mutex());
  for (auto slash = path.find('/', 1);; slash = path.find('/', slash + 1)) {
    const std::string part = path.substr(0, slash);
    const htri_t there = H5Lexists(state_->file.get(), part.c_str(), H5P_DEFAULT);
    if (there < 0) {
      last_failure();
      refuse(part, "cannot be read: the file is damaged");
    }
    if (there == 0) return false;
    if (!state_->link_is_hard(part)) refuse(part, "a soft or external link, expected hard links only");
    if (slash == std::string::npos) return true;
  }
}

bool Reader::is_group(const std::string& path) const {
  const Lock lock(library_mutex());
  if (!has(path)) return false;
  const Id object(H5Oopen(state_->file.get(), path.c_str(), H5P_DEFAULT));
  if (!object.ok()) {
    last_failure();
    refuse(path, "cannot be read: the file is damaged");
  }
  return H5Iget_type(object.get()) == H5I_GROUP;
}

std::vector<std::string> Reader::list(const std::string& path) const {
  const Lock lock(library_mutex());
  std::vector<std::string> names;
  if (path != "/" && !has(path)) return names;
  const Id group(H5Gopen2(state_->file.get(), path.c_str(), H5P_DEFAULT));
  if (!group.ok()) {
    last_failure();
    refuse(path, "not a group, or damaged");
  }
  struct Found {
    std::vector<std::string>* names;
    std::size_t limit;
    std::string odd;
  } found{&names, static_cast<std::size_t>(state_->size / 8), {}};
  // Native order walks the links one by one; by name HDF5 would first allocate a table of the declared size.
  const herr_t status = H5Literate(
      group.get(), H5_INDEX_NAME, H5_ITER_NATIVE, nullptr,
      [](hid_t, const char* name, const H5L_info_t* info, void* data) -> herr_t {
        auto& f = *static_cast<Found*>(data);
        if (info->type != H5L_TYPE_HARD || f.names->size() >= f.limit) {
          f.odd = name;
          return 1;
        }
        f.names->emplace_back(name);
        return 0;
      },
      &found);
  if (status < 0) {
    last_failure();
    refuse(path, "cannot be listed: the file is damaged");
  }
  if (status > 0) refuse(path + "/" + found.odd, "a soft or external link, expected hard links only");
  std::sort(names.begin(), names.end());
  for (const auto& name : names)
    if (!is_utf8(name)) refuse(path, "a link whose name is not UTF-8");
  return names;
}

std::vector<std::string> Reader::datasets(const std::string& root) const {
  const Lock lock(library_mutex());
  std::vector<std::string> found;
  struct Group {
    std::string path;
    std::size_t depth;
  };
  std::vector<Group> open_groups{{root == "/" ? std::string() : root, 0}};
  if (root != "/" && !has(root)) return found;
  // Hard links may form cycles and lattices: depth is limited, and no file holds more objects than it has room for headers.
  std::uint64_t visited = 0;
  while (!open_groups.empty()) {
    const Group group = open_groups.back();
    open_groups.pop_back();
    for (const auto& name : list(group.path.empty() ? "/" : group.path)) {
      const std::string path = group.path + "/" + name;
      if (++visited > state_->size / 32) refuse(path, "more objects than the file has room for: many links lead to the same group");
      if (!is_group(path)) {
        found.push_back(path);
      } else if (group.depth + 1 >= kDepthLimit) {
        refuse(path, "groups nested deeper than " + std::to_string(kDepthLimit) + ", or in a cycle");
      } else {
        open_groups.push_back({path, group.depth + 1});
      }
    }
  }
  std::sort(found.begin(), found.end());
  return found;
}

Dataset Reader::open(const std::string& path) const {
  const Lock lock(library_mutex());
  if (!has(path)) refuse(path, "missing, expected a dataset");
  return Dataset(*this, path);
}

std::vector<std::string> Reader::strings(const std::string& path, const Shape& expected) const {
  const Dataset set = open(path);
  set.require_strings(expected);
  const std::size_t length = set.element_bytes(), n = set.elements();
  std::string flat(length * n, '\0');
  if (n > 0) set.read(0, set.shape()[0], flat.data());
  std::vector<std::string> values(n);
  for (std::size_t i = 0; i < n; ++i) {
    const std::string_view cell(flat.data() + i * length, length);
    values[i] = cell.substr(0, cell.find_last_not_of('\0') + 1);
    // Nearly all texts are ASCII, and a check that decodes them would be a fifth of opening a large index.
    if (std::all_of(values[i].begin(), values[i].end(), [](char c) { return c > 0; })) continue;
    if (!is_utf8(values[i]) || values[i].find('\0') != std::string::npos) refuse(path, "row " + std::to_string(i) + " is not UTF-8 text");
  }
  return values;
}

std::string Reader::bytes(const std::string& path) const {
  const Dataset set = open(path);
  set.require(Type::u8, {kAny});
  std::string out(set.elements(), '\0');
  if (!out.empty()) set.read(0, set.shape()[0], out.data());
  return out;
}

Dataset::Dataset(Dataset&& o) noexcept
    : reader_(o.reader_), path_(std::move(o.path_)), id_(std::exchange(o.id_, -1)), type_id_(std::exchange(o.type_id_, -1)), type_(o.type_), shape_(std::move(o.shape_)),
      element_bytes_(o.element_bytes_), chunk_rows_(o.chunk_rows_) {}

Dataset::~Dataset() {
  if (id_ < 0) return;
  const Lock lock(library_mutex());
  H5Tclose(static_cast<hid_t>(type_id_));
  H5Dclose(static_cast<hid_t>(id_));
}

Dataset::Dataset(const Reader& reader, const std::string& path) : reader_(&reader), path_(path) {
  const Where where{reader.name(), 0, without_slash(path)};
  Id set(H5Dopen2(reader.state_->file.get(), path.c_str(), H5P_DEFAULT));
  Id type(set.ok() ? H5Dget_type(set.get()) : -1);
  const Id space(set.ok() ? H5Dget_space(set.get()) : -1), properties(set.ok() ? H5Dget_create_plist(set.get()) : -1);
  if (!type.ok() || !space.ok() || !properties.ok()) {
    last_failure();
    reader.refuse(path, "not a dataset, or damaged");
  }

  if (H5Tget_class(type.get()) == H5T_STRING) {
    if (H5Tis_variable_str(type.get()) != 0) reader.refuse(path, "strings of variable length, expected fixed length");
    if (H5Tget_strpad(type.get()) == H5T_STR_SPACEPAD) reader.refuse(path, "strings padded with spaces, expected NUL");
  } else {
    for (const Type t : {Type::u8, Type::i32, Type::i64, Type::f32, Type::f64})
      if (H5Tequal(type.get(), file_type(t)) > 0) type_ = t;
    if (!type_) reader.refuse(path, "a type not known here, expected uint8, int32, int64, float32, float64 (little-endian) or strings");
  }
  element_bytes_ = H5Tget_size(type.get());

  const int rank = H5Sget_simple_extent_ndims(space.get());
  if (rank < 1 || rank > kRankLimit || H5Pget_layout(properties.get()) != H5D_CHUNKED || H5Pget_external_count(properties.get()) != 0)
    reader.refuse(path, "not a chunked dataset of this file with 1 to " + std::to_string(kRankLimit) + " axes");
  std::array<hsize_t, kRankLimit> dims{}, chunk{};
  if (H5Sget_simple_extent_dims(space.get(), dims.data(), nullptr) != rank || H5Pget_chunk(properties.get(), rank, chunk.data()) != rank)
    reader.refuse(path, "cannot be read: the file is damaged");
  shape_.assign(dims.begin(), dims.begin() + rank);

  bool summed = false, deflated = false;
  for (int i = 0, n = H5Pget_nfilters(properties.get()); i < n; ++i) {
    unsigned flags = 0;
    std::size_t count = 0;
    const H5Z_filter_t filter = H5Pget_filter2(properties.get(), static_cast<unsigned>(i), &flags, &count, nullptr, 0, nullptr, nullptr);
    if (filter == H5Z_FILTER_FLETCHER32) summed = true;
    else if (filter == H5Z_FILTER_DEFLATE) deflated = true;
    else if (filter != H5Z_FILTER_SHUFFLE) reader.refuse(path, "filter " + std::to_string(filter) + ", expected shuffle, deflate and Fletcher-32 only");
  }
  if (!summed) reader.refuse(path, "no checksums, expected Fletcher-32");

  // What is declared against what the file can hold, before anything is allocated for it.
  std::uint64_t bytes = element_bytes_, chunk_bytes = element_bytes_, chunks = 1;
  for (int k = 0; k < rank; ++k) {
    const auto axis = static_cast<std::size_t>(k);
    bytes = checked_product(bytes, dims[axis], where);
    chunk_bytes = checked_product(chunk_bytes, chunk[axis], where);
    chunks = checked_product(chunks, dims[axis] / chunk[axis] + (dims[axis] % chunk[axis] != 0), where);
  }
  const std::uint64_t ratio = deflated ? kDeflateRatio : 1;
  if (bytes / ratio > reader.file_bytes()) reader.refuse(path, "shape " + text(shape_) + " needs " + std::to_string(bytes) + " bytes, more than the file can hold");
  if (chunk_bytes > kChunkBytesLimit) reader.refuse(path, "chunks of " + std::to_string(chunk_bytes) + " bytes, expected at most " + std::to_string(kChunkBytesLimit));
  hsize_t present = 0;
  if (chunks > 0 && H5Dget_num_chunks(set.get(), space.get(), &present) < 0) {
    last_failure();
    reader.refuse(path, "cannot be read: the file is damaged");
  }
  if (present != chunks) reader.refuse(path, std::to_string(present) + " chunks, expected " + std::to_string(chunks));
  const std::uint64_t stored = H5Dget_storage_size(set.get());
  if (chunks > 0 && (stored > reader.file_bytes() || bytes / ratio > stored))
    reader.refuse(path, "shape " + text(shape_) + " needs " + std::to_string(bytes) + " bytes, but " + std::to_string(stored) + " are stored");
  chunk_rows_ = chunk[0];
  type_id_ = type.release();
  id_ = set.release();
}

std::uint64_t Dataset::elements() const {
  std::uint64_t n = 1;
  for (const auto d : shape_) n *= d;
  return n;
}

void Dataset::require_shape(const Shape& expected) const {
  bool fits = shape_.size() == expected.size();
  for (std::size_t k = 0; fits && k < expected.size(); ++k) fits = expected[k] == kAny || expected[k] == shape_[k];
  if (!fits) reader_->refuse(path_, "shape " + text(shape_) + ", expected " + text(expected));
}

void Dataset::require(Type type, const Shape& expected) const {
  if (type_ != type) reader_->refuse(path_, std::string(type_ ? text(*type_) : "strings") + ", expected " + text(type));
  require_shape(expected);
}

void Dataset::require_strings(const Shape& expected) const {
  if (type_) reader_->refuse(path_, std::string(text(*type_)) + ", expected strings of fixed length");
  require_shape(expected);
}

void Dataset::read(std::uint64_t first, std::uint64_t count, void* out) const {
  const Lock lock(library_mutex());
  std::array<hsize_t, kRankLimit> start{}, extent{};
  std::copy(shape_.begin(), shape_.end(), extent.begin());
  start[0] = first;
  extent[0] = count;
  const Id memory(H5Screate_simple(static_cast<int>(shape_.size()), extent.data(), nullptr)), file(H5Dget_space(static_cast<hid_t>(id_)));
  if (H5Sselect_hyperslab(file.get(), H5S_SELECT_SET, start.data(), nullptr, extent.data(), nullptr) < 0 ||
      H5Dread(static_cast<hid_t>(id_), static_cast<hid_t>(type_id_), memory.get(), file.get(), H5P_DEFAULT, out) < 0)
    reader_->refuse(path_, last_failure().checksum ? "checksum mismatch: the file is damaged" : "cannot be read: the file is damaged");
}

void Dataset::verify() const {
  if (elements() == 0) return;
  std::vector<unsigned char> rows;
  for (std::uint64_t first = 0; first < shape_[0]; first += chunk_rows_) {
    const std::uint64_t count = std::min(chunk_rows_, shape_[0] - first);
    rows.resize(elements() / shape_[0] * element_bytes_ * count);
    read(first, count, rows.data());
  }
}

}  // namespace mocap::store::h5
