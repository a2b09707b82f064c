#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <set>

#include "libmocap/base/log.hpp"
#include "libmocap/store/hdf5_handle.hpp"

namespace mocap::store::h5 {
namespace {

// Up to this many links or attributes lie in the object's header; beyond, HDF5 keeps them in a heap of 1 KB and more.
constexpr unsigned kCompact = 32;

// Unfinished outputs of this process. abandon_output() runs no destructors, so it needs to know all of them.
std::set<std::string>& part_files() {
  static std::set<std::string> paths;
  return paths;
}

std::string shown(const std::string& path) { return path == "-" ? "<stdout>" : path; }

// Chunks of about kChunkBytes: the leading axes are cut first, so that a chunk is a run of rows.
Shape chunk_of(const Shape& shape, std::uint64_t element_bytes) {
  Shape chunk = shape;
  for (auto& n : chunk) n = std::max<std::uint64_t>(n, 1);
  for (std::size_t axis = 0; axis < chunk.size(); ++axis) {
    std::uint64_t rest = element_bytes;
    for (std::size_t k = axis + 1; k < chunk.size(); ++k) rest *= chunk[k];
    chunk[axis] = std::clamp<std::uint64_t>(kChunkBytes / std::max<std::uint64_t>(rest, 1), 1, chunk[axis]);
    if (chunk[axis] > 1) break;
  }
  return chunk;
}

}  // namespace

void abandon_output(const std::string& path, const std::string& what) {
  std::string text = shown(path) + ": " + what;
  std::replace(text.begin(), text.end(), '\n', ' ');
  log::error("{}", text);
  for (const std::string& part : part_files()) ::unlink(part.c_str());
  ::_exit(static_cast<int>(Exit::io));
}

struct Writer::State {
  State(const std::string& path, Overwrite mode) : output(path, mode) {}
  OutputFile output;
  Id file;
  std::set<std::string> groups;

  [[noreturn]] void abandon() {
    const Failure failure = last_failure();
    abandon_output(output.path(), failure.system.empty() ? "write failed" : "write failed: " + failure.system);
  }
  hid_t need(hid_t id) {
    if (id < 0) abandon();
    return id;
  }
  void check(herr_t status) {
    if (status < 0) abandon();
  }

  void make_parents(const std::string& path) {
    for (auto slash = path.find('/', 1); slash != std::string::npos; slash = path.find('/', slash + 1)) make_group(path.substr(0, slash));
  }
  void make_group(const std::string& path) {
    if (!groups.insert(path).second) return;
    const Id properties(need(H5Pcreate(H5P_GROUP_CREATE)));
    check(H5Pset_obj_track_times(properties.get(), false));
    check(H5Pset_link_phase_change(properties.get(), kCompact, kCompact / 2));
    const Id group(need(H5Gcreate2(file.get(), path.c_str(), H5P_DEFAULT, properties.get(), H5P_DEFAULT)));
  }
  // `rows_grow`: the first axis has no upper limit.
  Id create(const std::string& path, hid_t type, const Shape& shape, const Shape& chunk, bool rows_grow, int deflate) {
    make_parents(path);
    Shape most = shape;
    if (rows_grow) most[0] = H5S_UNLIMITED;
    const std::vector<hsize_t> dims(shape.begin(), shape.end()), max_dims(most.begin(), most.end()), chunk_dims(chunk.begin(), chunk.end());
    const Id space(need(H5Screate_simple(static_cast<int>(dims.size()), dims.data(), max_dims.data())));
    const Id properties(need(H5Pcreate(H5P_DATASET_CREATE)));
    check(H5Pset_obj_track_times(properties.get(), false));
    check(H5Pset_chunk(properties.get(), static_cast<int>(chunk_dims.size()), chunk_dims.data()));
    check(H5Pset_shuffle(properties.get()));
    if (deflate > 0) check(H5Pset_deflate(properties.get(), static_cast<unsigned>(deflate)));
    check(H5Pset_fletcher32(properties.get()));
    return Id(need(H5Dcreate2(file.get(), path.c_str(), type, space.get(), H5P_DEFAULT, properties.get(), H5P_DEFAULT)));
  }
  void write_whole(const std::string& path, hid_t type, const Shape& shape, const void* values) {
    Id set = create(path, type, shape, chunk_of(shape, H5Tget_size(type)), false, 0);
    if (std::find(shape.begin(), shape.end(), 0u) == shape.end()) check(H5Dwrite(set.get(), type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values));
    check(H5Dclose(set.release()));
  }
  void write_attribute(hid_t object, const std::string& name, hid_t type, const void* value) {
    const Id space(need(H5Screate(H5S_SCALAR)));
    Id attribute(need(H5Acreate2(object, name.c_str(), type, space.get(), H5P_DEFAULT, H5P_DEFAULT)));
    check(H5Awrite(attribute.get(), type, value));
    check(H5Aclose(attribute.release()));
  }
};

Writer::Writer(const std::string& path, Overwrite mode) : state_(std::make_unique<State>(path, mode)) {
  const Lock lock(library_mutex());
  const Id access(H5Pcreate(H5P_FILE_ACCESS)), creation(H5Pcreate(H5P_FILE_CREATE));
  if (H5Pset_libver_bounds(access.get(), H5F_LIBVER_V110, H5F_LIBVER_V110) < 0 || H5Pset_fclose_degree(access.get(), H5F_CLOSE_SEMI) < 0 ||
#if H5_VERSION_GE(1, 10, 7)
      H5Pset_file_locking(access.get(), false, true) < 0 ||
#endif
      H5Pset_attr_phase_change(creation.get(), kCompact, kCompact / 2) < 0 || H5Pset_obj_track_times(creation.get(), false) < 0)
    throw Error(Exit::internal, {shown(path), 0, {}}, "cannot set up HDF5");
  state_->file = Id(H5Fcreate(state_->output.part_path().c_str(), H5F_ACC_TRUNC, creation.get(), access.get()));
  if (!state_->file.ok()) {
    const Failure failure = last_failure();
    throw Error(Exit::io, {shown(path), 0, {}}, "create failed" + (failure.system.empty() ? std::string() : ": " + failure.system));
  }
  part_files().insert(state_->output.part_path());
}

Writer::~Writer() {
  const Lock lock(library_mutex());
  // The file is thrown away: a failure to close it changes nothing, and its cause was reported already.
  if (state_->file.ok()) H5Fclose(state_->file.release());
  part_files().erase(state_->output.part_path());
}

void Writer::group(const std::string& path) {
  const Lock lock(library_mutex());
  state_->make_parents(path);
  state_->make_group(path);
}

void Writer::attribute(const std::string& name, std::string_view text) {
  const Lock lock(library_mutex());
  std::string value(text);
  if (value.empty()) value.assign(1, '\0');  // HDF5 has no strings of length 0
  state_->write_attribute(state_->file.get(), name, string_type(value.size()).get(), value.data());
}

void Writer::attribute(const std::string& name, std::int32_t value) {
  const Lock lock(library_mutex());
  state_->write_attribute(state_->file.get(), name, file_type(Type::i32), &value);
}

void Writer::attribute(const std::string& name, double value) {
  const Lock lock(library_mutex());
  state_->write_attribute(state_->file.get(), name, file_type(Type::f64), &value);
}

void Writer::attribute_of(const std::string& dataset, const std::string& name, std::int32_t value) {
  const Lock lock(library_mutex());
  const Id set(state_->need(H5Dopen2(state_->file.get(), dataset.c_str(), H5P_DEFAULT)));
  state_->write_attribute(set.get(), name, file_type(Type::i32), &value);
}

void Writer::dataset(const std::string& path, Type type, const Shape& shape, const void* values) {
  const Lock lock(library_mutex());
  state_->write_whole(path, file_type(type), shape, values);
}

void Writer::strings(const std::string& path, const std::vector<std::string>& values, Shape shape) {
  const Lock lock(library_mutex());
  if (shape.empty()) shape = {values.size()};
  std::size_t length = 1;
  for (const auto& v : values) length = std::max(length, v.size());
  std::string flat(length * values.size(), '\0');
  for (std::size_t i = 0; i < values.size(); ++i) std::copy(values[i].begin(), values[i].end(), flat.begin() + static_cast<std::ptrdiff_t>(i * length));
  state_->write_whole(path, string_type(length).get(), shape, flat.data());
}

void Writer::finish(const std::string& complete) {
  const Lock lock(library_mutex());
  State& s = *state_;
  s.check(H5Fflush(s.file.get(), H5F_SCOPE_GLOBAL));
  attribute("complete", complete);
  s.check(H5Fflush(s.file.get(), H5F_SCOPE_GLOBAL));
  s.check(H5Fclose(s.file.release()));
  const std::string part = s.output.part_path();
  s.output.commit();
  part_files().erase(part);
}

Rows::Rows(Writer& writer, std::string path, Type type, Shape row, std::uint64_t chunk_rows, int deflate)
    : writer_(writer), path_(std::move(path)), type_(type), row_(std::move(row)), row_bytes_(bytes_of(type)), chunk_rows_(std::max<std::uint64_t>(chunk_rows, 1)), deflate_(deflate) {
  for (const auto n : row_) row_bytes_ *= n;
}

Rows::~Rows() {
  const Lock lock(library_mutex());
  if (id_ >= 0) H5Dclose(id_);
}

void* Rows::space(std::uint64_t want, std::uint64_t& got) {
  if (buffered_ == chunk_rows_) flush();
  got = std::min(std::max<std::uint64_t>(want, 1), chunk_rows_ - buffered_);
  const std::uint64_t need = (buffered_ + got) * row_bytes_;
  // Doubling: many small clips do not copy the buffer each time, and one small file does not take a whole chunk.
  if (buffer_.size() < need) buffer_.resize(std::min(std::max(need, 2 * buffer_.size()), chunk_rows_ * row_bytes_));
  return buffer_.data() + buffered_ * row_bytes_;
}

void Rows::commit(std::uint64_t rows) { buffered_ += rows; }

void Rows::flush() {
  const Lock lock(library_mutex());
  Writer::State& s = *writer_.state_;
  Shape shape{written_ + buffered_};
  shape.insert(shape.end(), row_.begin(), row_.end());
  if (id_ < 0) {
    // The first chunk is not full only where it is the whole dataset: then it is no larger than needed.
    Shape chunk = shape;
    chunk[0] = std::max<std::uint64_t>(buffered_, 1);
    const bool grows = buffered_ == chunk_rows_;
    id_ = s.create(path_, file_type(type_), shape, chunk, grows, deflate_).release();
  } else {
    const std::vector<hsize_t> dims(shape.begin(), shape.end());
    s.check(H5Dset_extent(id_, dims.data()));
  }
  if (buffered_ == 0) return;
  std::vector<hsize_t> start(shape.size(), 0), count(shape.begin(), shape.end());
  start[0] = written_;
  count[0] = buffered_;
  const Id memory(s.need(H5Screate_simple(static_cast<int>(count.size()), count.data(), nullptr))), file(s.need(H5Dget_space(id_)));
  s.check(H5Sselect_hyperslab(file.get(), H5S_SELECT_SET, start.data(), nullptr, count.data(), nullptr));
  s.check(H5Dwrite(id_, file_type(type_), memory.get(), file.get(), H5P_DEFAULT, buffer_.data()));
  written_ += buffered_;
  buffered_ = 0;
}

void Rows::finish() {
  const Lock lock(library_mutex());
  if (buffered_ > 0 || id_ < 0) flush();
  writer_.state_->check(H5Dclose(static_cast<hid_t>(std::exchange(id_, -1))));
}

}  // namespace mocap::store::h5
