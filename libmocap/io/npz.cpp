#include "libmocap/io/npz.hpp"

#include <fmt/format.h>
#include <zip.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <mutex>
#include <set>

#include "libmocap/base/checked.hpp"
#include "libmocap/base/error.hpp"
#include "libmocap/io/npy_header.hpp"
#include "libmocap/base/utf8.hpp"

namespace mocap::io {
namespace {

static_assert(std::endian::native == std::endian::little, "npy data is copied as it lies in memory");

struct ZipError {
  zip_error_t e;
  ZipError() { zip_error_init(&e); }
  ~ZipError() { zip_error_fini(&e); }
  std::string text() { return zip_error_strerror(&e); }
};
struct DiscardArchive {
  void operator()(zip_t* z) const { zip_discard(z); }
};
struct CloseFile {
  void operator()(zip_file_t* f) const { zip_fclose(f); }
};
struct FreeSource {
  void operator()(zip_source_t* s) const { zip_source_free(s); }
};
using Archive = std::unique_ptr<zip_t, DiscardArchive>;
using Source = std::unique_ptr<zip_source_t, FreeSource>;

// libzip before 1.9 finds out what a source must be able to do in variables that the first archives opened share (its issue 289): of two opened at once on two threads one is sometimes taken for
// read-only or unfit. So the first is opened alone.
void start_libzip() {
  static std::once_flag once;
  std::call_once(once, [] {
    ZipError error;
    Source source(zip_source_buffer_create(nullptr, 0, 0, &error.e));
    if (!source) return;
    const Archive archive(zip_open_from_source(source.get(), ZIP_CREATE, &error.e));
    if (archive) source.release();
  });
}

Archive open_archive(std::string_view bytes) {
  start_libzip();
  ZipError error;
  if (!bytes.starts_with("PK")) refuse({}, "does not start with a zip signature, expected an .npz file");
  Source source(zip_source_buffer_create(bytes.data(), bytes.size(), 0, &error.e));
  if (!source) throw Error(Exit::internal, {}, "zip source: " + error.text());
  Archive archive(zip_open_from_source(source.get(), ZIP_RDONLY | ZIP_CHECKCONS, &error.e));
  if (!archive) refuse({}, "a damaged or truncated zip file (" + error.text() + "), expected an .npz file");
  source.release();  // the archive owns it now
  return archive;
}

// Bytes of a member, read forward; the size promised by the directory is all there is.
class Member {
 public:
  Member(zip_t* archive, zip_uint64_t index, Where where)
      : where_(std::move(where)), file_(zip_fopen_index(archive, index, 0)) {
    if (!file_) refuse(where_, std::string("cannot be unpacked: ") + zip_strerror(archive));
  }
  void read(void* to, std::size_t size) {
    if (size > 0 && zip_fread(file_.get(), to, size) != static_cast<zip_int64_t>(size))
      refuse(where_, "damaged or truncated data (" + std::to_string(size) + " bytes expected)");
  }
  // libzip compares the checksum when it meets the end.
  void expect_end() {
    char byte = 0;
    if (zip_fread(file_.get(), &byte, 1) != 0)
      refuse(where_, std::string("damaged data: ") + zip_file_strerror(file_.get()));
  }

 private:
  Where where_;
  std::unique_ptr<zip_file_t, CloseFile> file_;
};

template <class T, class Out>
std::vector<Out> numbers(Member& member, std::size_t count, const Where& where) {
  std::vector<T> raw(count);
  member.read(raw.data(), count * sizeof(T));
  if constexpr (std::is_same_v<T, Out>) {
    return raw;
  } else {
    std::vector<Out> out;
    out.reserve(count);
    for (const T v : raw) {
      if constexpr (std::is_same_v<T, std::uint64_t>)
        if (v > static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max()))
          refuse(where, "value " + std::to_string(v) + ", expected at most 2^63 - 1");
      out.push_back(static_cast<Out>(v));
    }
    return out;
  }
}

std::vector<std::string> strings(Member& member, std::size_t count, std::size_t item_size, bool unicode) {
  std::vector<std::string> out;
  std::string item(item_size, '\0');
  for (std::size_t i = 0; i < count; ++i) {
    member.read(item.data(), item_size);
    if (unicode) {
      std::u32string points(item_size / 4, U'\0');
      std::memcpy(points.data(), item.data(), item_size);
      points.resize(points.find_last_not_of(U'\0') + 1);
      out.push_back(to_utf8(points));
    } else {
      out.push_back(item.substr(0, item.find_last_not_of('\0') + 1));
    }
  }
  return out;
}

NpyArray read_member(zip_t* archive, zip_uint64_t index, std::size_t size, const Where& where) {
  Member member(archive, index, where);
  std::string head(kNpyMagicSize, '\0');
  if (size < head.size()) refuse(where, "a member of " + std::to_string(size) + " bytes, too short for a .npy header");
  member.read(head.data(), head.size());
  const std::size_t left = npy_header_left(head, size, where);
  head.resize(kNpyMagicSize + left);
  member.read(head.data() + kNpyMagicSize, left);
  const NpyHeader h = parse_npy_header(head, where);
  const std::size_t bytes = checked_product(h.count, h.item_size, where);
  if (bytes != size - head.size())
    refuse(where, "shape " + shape_text(h.shape) + " of " + h.descr + " needs " + std::to_string(bytes) +
                      " bytes, the member holds " + std::to_string(size - head.size()));
  NpyArray a;
  a.shape = h.shape;
  switch (h.type) {
    case NpyType::f4:
      a.data = numbers<float, double>(member, h.count, where);
      break;
    case NpyType::f8:
      a.data = numbers<double, double>(member, h.count, where);
      break;
    case NpyType::i4:
      a.data = numbers<std::int32_t, std::int64_t>(member, h.count, where);
      break;
    case NpyType::i8:
      a.data = numbers<std::int64_t, std::int64_t>(member, h.count, where);
      break;
    case NpyType::u1:
      a.data = numbers<std::uint8_t, std::int64_t>(member, h.count, where);
      break;
    case NpyType::u4:
      a.data = numbers<std::uint32_t, std::int64_t>(member, h.count, where);
      break;
    case NpyType::u8:
      a.data = numbers<std::uint64_t, std::int64_t>(member, h.count, where);
      break;
    case NpyType::bytes:
      a.data = strings(member, h.count, h.item_size, false);
      break;
    case NpyType::unicode:
      a.data = strings(member, h.count, h.item_size, true);
      break;
  }
  member.expect_end();
  return a;
}

Npz read_archive(std::string_view bytes, const std::set<std::string, std::less<>>* wanted) {
  const Archive archive = open_archive(bytes);
  Npz out;
  std::set<std::string> seen;
  std::size_t packed = 0;
  const auto entries = static_cast<zip_uint64_t>(std::max<zip_int64_t>(0, zip_get_num_entries(archive.get(), 0)));
  for (zip_uint64_t i = 0; i < entries; ++i) {
    zip_stat_t s;
    if (zip_stat_index(archive.get(), i, 0, &s) != 0 || !(s.valid & ZIP_STAT_NAME))
      refuse({}, "a zip entry without a name");
    std::string name = s.name;
    if (!name.ends_with(".npy")) continue;
    name.resize(name.size() - 4);
    if (!seen.insert(name).second) refuse({{}, 0, name}, "the member occurs twice, expected unique names");
    constexpr zip_uint64_t kNeeded =
        ZIP_STAT_SIZE | ZIP_STAT_COMP_SIZE | ZIP_STAT_COMP_METHOD | ZIP_STAT_ENCRYPTION_METHOD;
    if ((s.valid & kNeeded) != kNeeded) refuse({{}, 0, name}, "a zip entry without size or method");
    const Where where{{}, 0, name};
    // Members may not share bytes, and deflate packs at most 1032 to 1: what is promised is bounded by what is there.
    packed = checked_sum(packed, s.comp_size, where);
    if (packed > bytes.size())
      refuse(where,
             "members of " + std::to_string(packed) + " packed bytes in a file of " + std::to_string(bytes.size()));
    if (wanted && !wanted->contains(name)) continue;
    if (s.encryption_method != ZIP_EM_NONE) refuse(where, "an encrypted member, expected a plain one");
    if (s.comp_method != ZIP_CM_STORE && s.comp_method != ZIP_CM_DEFLATE)
      refuse(where, "compression method " + std::to_string(s.comp_method) + ", expected stored or deflated");
    if (s.size / 1032 > s.comp_size + 1)
      refuse(where, std::to_string(s.size) + " bytes promised by " + std::to_string(s.comp_size) +
                        " packed ones, which deflate cannot do");
    out.emplace(name, read_member(archive.get(), i, static_cast<std::size_t>(s.size), where));
  }
  if (seen.empty()) refuse({}, "a zip file without a .npy member, expected an .npz file");
  return out;
}

template <class T>
void append_raw(std::string& out, const T* values, std::size_t count) {
  out.append(reinterpret_cast<const char*>(values), count * sizeof(T));
}

std::string npy_bytes(const std::string& name, const NpyArray& a) {
  const std::size_t count = element_count(a.shape, {{}, 0, name});
  const std::size_t given = std::visit([](const auto& v) { return v.size(); }, a.data);
  if (count != given)
    throw Error(Exit::internal, {{}, 0, name}, std::to_string(given) + " values for shape " + shape_text(a.shape));
  std::string out;
  if (const auto* d = std::get_if<std::vector<double>>(&a.data)) {
    out = npy_header("<f8", a.shape);
    append_raw(out, d->data(), d->size());
  } else if (const auto* n = std::get_if<std::vector<std::int64_t>>(&a.data)) {
    const bool narrow =
        std::all_of(n->begin(), n->end(), [](std::int64_t v) { return v == static_cast<std::int32_t>(v); });
    out = npy_header(narrow ? "<i4" : "<i8", a.shape);
    if (narrow) {
      const std::vector<std::int32_t> small(n->begin(), n->end());
      append_raw(out, small.data(), small.size());
    } else {
      append_raw(out, n->data(), n->size());
    }
  } else {
    std::vector<std::u32string> items;
    std::size_t longest = 1;
    for (const std::string& s : std::get<std::vector<std::string>>(a.data)) {
      auto points = from_utf8(s);
      if (!points || points->find(U'\0') != std::u32string::npos)
        refuse({{}, 0, name}, "a text that is not UTF-8 or holds a NUL, expected plain UTF-8");
      longest = std::max(longest, points->size());
      items.push_back(std::move(*points));
    }
    out = npy_header("<U" + std::to_string(longest), a.shape);
    for (std::u32string& s : items) {
      s.resize(longest, U'\0');
      append_raw(out, s.data(), s.size());
    }
  }
  return out;
}

}  // namespace

Npz parse_npz(std::string_view bytes) { return read_archive(bytes, nullptr); }

Npz parse_npz(std::string_view bytes, const std::set<std::string, std::less<>>& wanted) {
  return read_archive(bytes, &wanted);
}

std::optional<std::set<std::string, std::less<>>> npz_members(const std::string& path) {
  start_libzip();
  const Archive archive(zip_open(path.c_str(), ZIP_RDONLY, nullptr));
  if (!archive) return std::nullopt;
  std::set<std::string, std::less<>> names;
  const auto entries = static_cast<zip_uint64_t>(std::max<zip_int64_t>(0, zip_get_num_entries(archive.get(), 0)));
  for (zip_uint64_t i = 0; i < entries; ++i) {
    const char* name = zip_get_name(archive.get(), i, 0);
    if (const std::string_view n = name ? name : ""; n.ends_with(".npy")) names.emplace(n.substr(0, n.size() - 4));
  }
  return names;
}

std::string format_npz(const Npz& arrays) {
  start_libzip();
  std::vector<std::string> members;  // outlive the archive: libzip reads them when it closes
  members.reserve(arrays.size());
  ZipError error;
  const auto check = [&](bool ok, zip_t* z) {
    if (!ok) throw Error(Exit::internal, {}, "zip writer: " + (z ? std::string(zip_strerror(z)) : error.text()));
  };
  Source target(zip_source_buffer_create(nullptr, 0, 0, &error.e));
  check(target != nullptr, nullptr);
  Archive archive(zip_open_from_source(target.get(), ZIP_CREATE | ZIP_TRUNCATE, &error.e));
  check(archive != nullptr, nullptr);
  zip_source_keep(target.get());  // one reference for the archive, one for reading the result
  for (const auto& [name, array] : arrays) {
    members.push_back(npy_bytes(name, array));
    Source data(zip_source_buffer(archive.get(), members.back().data(), members.back().size(), 0));
    check(data != nullptr, archive.get());
    const zip_int64_t index = zip_file_add(archive.get(), (name + ".npy").c_str(), data.get(), ZIP_FL_ENC_UTF_8);
    check(index >= 0, archive.get());
    data.release();
    const auto i = static_cast<zip_uint64_t>(index);
    check(zip_set_file_compression(archive.get(), i, ZIP_CM_STORE, 0) == 0, archive.get());
    // 1980-01-01 00:00 as the two words of the format: no time zone comes in.
    check(zip_file_set_dostime(archive.get(), i, 0, 1 << 5 | 1, 0) == 0, archive.get());
  }
  if (arrays.empty()) throw Error(Exit::internal, {}, "zip writer: no arrays");
  check(zip_close(archive.get()) == 0, archive.get());
  archive.release();
  zip_stat_t s;
  zip_stat_init(&s);
  check(zip_source_stat(target.get(), &s) == 0 && (s.valid & ZIP_STAT_SIZE) && zip_source_open(target.get()) == 0,
        nullptr);
  std::string out(s.size, '\0');
  check(zip_source_read(target.get(), out.data(), out.size()) == static_cast<zip_int64_t>(out.size()), nullptr);
  zip_source_close(target.get());
  return out;
}

}  // namespace mocap::io
