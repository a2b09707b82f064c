// The header of a .npy array: magic, version, and a Python dict of dtype, order and shape. Internal to libmocap/io.
// https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html
#pragma once
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "libmocap/base/error.hpp"

namespace mocap::io {

enum class NpyType { f4, f8, i4, i8, u1, u4, u8, bytes, unicode };

struct NpyHeader {
  std::string descr;  // "<f8"
  NpyType type = NpyType::f8;
  std::size_t item_size = 0;  // bytes
  std::vector<std::size_t> shape;
  std::size_t count = 0;  // product of the shape
};

inline constexpr std::size_t kNpyMagicSize = 12;  // what tells how long the header is, in every version

// Bytes of the header behind the first kNpyMagicSize; Error(data) for another magic, version, or a length beyond
// `size`.
std::size_t npy_header_left(std::string_view magic, std::size_t size, const Where& where);
// The whole header, magic included. Error(data) names what is not supported: objects, byte orders, Fortran order.
NpyHeader parse_npy_header(std::string_view header, const Where& where);

// Version 1.0, padded to 64 bytes as NumPy does.
std::string npy_header(const std::string& descr, const std::vector<std::size_t>& shape);

std::size_t element_count(const std::vector<std::size_t>& shape, const Where& where);  // overflow: Error(data)
std::string shape_text(const std::vector<std::size_t>& shape);                         // "(3, 4)", "(3,)", "()"

}  // namespace mocap::io
