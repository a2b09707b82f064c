// Raw HDF5 identifiers. Only the hdf5*.cpp files include this.
#pragma once
#include <hdf5.h>

#include <string>
#include <utility>

#include "libmocap/store/hdf5.hpp"

namespace mocap::store::h5 {

// Owns one identifier; negative: none.
class Id {
 public:
  explicit Id(hid_t id = -1) : id_(id) {}
  Id(Id&& other) noexcept : id_(std::exchange(other.id_, -1)) {}
  Id& operator=(Id&& other) noexcept {
    std::swap(id_, other.id_);
    return *this;
  }
  ~Id() {
    if (id_ >= 0) H5Idec_ref(id_);
  }
  hid_t get() const { return id_; }
  bool ok() const { return id_ >= 0; }
  hid_t release() { return std::exchange(id_, -1); }

 private:
  hid_t id_;
};

using Lock = std::lock_guard<std::recursive_mutex>;

// The error stack of the call that just failed, goes to the debug log; what of it a user can use.
struct Failure {
  bool checksum = false;  // a chunk did not fit its Fletcher-32 sum
  std::string system;     // strerror of a failed system call, or ""
};
Failure last_failure();

hid_t file_type(Type type);
std::size_t bytes_of(Type type);
Id string_type(std::size_t length);

}  // namespace mocap::store::h5
