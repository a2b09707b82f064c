#include "libmocap/store/hdf5.hpp"

#include <cstring>

#include "libmocap/base/log.hpp"
#include "libmocap/store/hdf5_handle.hpp"

namespace mocap::store::h5 {

std::recursive_mutex& library_mutex() {
  static std::recursive_mutex mutex;
  static const bool started = [] {
    H5dont_atexit();  // its exit handler crashes after a failed write
    H5open();
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);  // errors are reported once, by us
    H5PLset_loading_state(0);                     // a filter named in a file must not load code
    return true;
  }();
  (void)started;
  return mutex;
}

template <> Type type_of<std::uint8_t>() { return Type::u8; }
template <> Type type_of<std::int32_t>() { return Type::i32; }
template <> Type type_of<std::int64_t>() { return Type::i64; }
template <> Type type_of<float>() { return Type::f32; }
template <> Type type_of<double>() { return Type::f64; }

hid_t file_type(Type type) {
  switch (type) {
    case Type::u8: return H5T_STD_U8LE;
    case Type::i32: return H5T_STD_I32LE;
    case Type::i64: return H5T_STD_I64LE;
    case Type::f32: return H5T_IEEE_F32LE;
    case Type::f64: return H5T_IEEE_F64LE;
  }
  return -1;
}

std::size_t bytes_of(Type type) {
  switch (type) {
    case Type::u8: return 1;
    case Type::i32:
    case Type::f32: return 4;
    case Type::i64:
    case Type::f64: return 8;
  }
  return 0;
}

Id string_type(std::size_t length) {
  Id type(H5Tcopy(H5T_C_S1));
  if (H5Tset_size(type.get(), length) < 0 || H5Tset_strpad(type.get(), H5T_STR_NULLPAD) < 0 || H5Tset_cset(type.get(), H5T_CSET_UTF8) < 0)
    throw Error(Exit::internal, {}, "cannot make a string type of " + std::to_string(length) + " bytes");
  return type;
}

Failure last_failure() {
  Failure failure;
  H5Ewalk2(
      H5E_DEFAULT, H5E_WALK_UPWARD,
      [](unsigned, const H5E_error2_t* e, void* data) -> herr_t {
        auto& out = *static_cast<Failure*>(data);
        const std::string text = e->desc ? e->desc : "";
        if (text.find("Fletcher32") != std::string::npos) out.checksum = true;
        if (const auto at = text.find("error message = '"); at != std::string::npos && out.system.empty()) {
          const auto begin = at + std::strlen("error message = '");
          out.system = text.substr(begin, text.find('\'', begin) - begin);
        }
        log::debug("HDF5 {}: {}", e->func_name ? e->func_name : "?", text);
        return 0;
      },
      &failure);
  return failure;
}

std::string escape_link(std::string_view name) {
  if (name == ".") return "%2E";
  std::string out;
  for (const char c : name) out += c == '%' ? std::string("%25") : c == '/' ? std::string("%2F") : std::string(1, c);
  return out;
}

std::string unescape_link(std::string_view link) {
  std::string out;
  for (std::size_t i = 0; i < link.size(); ++i) {
    const std::string_view code = link.substr(i, 3);
    const char c = code == "%25" ? '%' : code == "%2F" ? '/' : code == "%2E" ? '.' : '\0';
    out += c ? c : link[i];
    if (c) i += 2;
  }
  return out;
}

}  // namespace mocap::store::h5
