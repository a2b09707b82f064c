// What archives and model files share: skeleton, history, the `complete` marker. Internal to libmocap/store.
#pragma once
#include <cstdint>
#include <memory>
#include <string>

#include "libmocap/base/history.hpp"
#include "libmocap/base/sha256.hpp"
#include "libmocap/skeleton/skeleton.hpp"
#include "libmocap/store/hdf5.hpp"

namespace mocap::store {

inline constexpr std::int32_t kFormatVersion = 1;
inline constexpr const char* kMotionFormat = "mocap-motion";
inline constexpr const char* kModelFormat = "mocap-model";

// /skeleton/*. Error(data) for names that are not UTF-8 or hold a NUL. Reading validates the skeleton.
void write_skeleton(h5::Writer& out, const Skeleton& skeleton, const std::string& file);
std::shared_ptr<const Skeleton> read_skeleton(const h5::Reader& in);

void write_history(h5::Writer& out, const History& history);
History read_history(const h5::Reader& in);

// {"clips": N, "digest": "..."}: the value of the root attribute `complete`.
struct Complete {
  std::uint64_t count = 0;
  std::string digest;
};
std::string format_complete(const std::string& counted, const Complete& complete);
Complete parse_complete(const h5::Reader& in, const std::string& json, const std::string& counted);

// Text that a dataset of fixed-length strings keeps as it is. Error(data) otherwise.
void require_text(const std::string& text, const Where& where);

// Hash input of numbers and texts: little-endian, texts after their length as int32.
void hash_number(Sha256& hash, double value);
void hash_number(Sha256& hash, std::int32_t value);
void hash_text(Sha256& hash, const std::string& text);
// Joint count, names, parents, rest offsets, end site count, parents and offsets; offsets as the float32 that are stored.
void hash_skeleton(Sha256& hash, const Skeleton& skeleton);

}  // namespace mocap::store
