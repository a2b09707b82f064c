#include "libmocap/io/npz.hpp"

#include <zip.h>

#include <limits>

#include "libmocap/base/random.hpp"
#include "tests/io/io_test_support.hpp"

namespace mocap::io {
namespace {

using test::data;
using test::error_of;

using Doubles = std::vector<double>;
using Integers = std::vector<std::int64_t>;
using Texts = std::vector<std::string>;

bool same_arrays(const Npz& a, const Npz& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const auto& x, const auto& y) {
    return x.first == y.first && x.second.shape == y.second.shape && x.second.data == y.second.data;
  });
}

Npz sample() {
  Npz a;
  a["numbers"] = {
      {2, 3},
      Doubles{0, -0.0, 1e-308, -1.5, std::numeric_limits<double>::max(), std::numeric_limits<double>::infinity()}};
  a["scalar"] = {{}, Doubles{29.97}};
  a["small"] = {{3}, Integers{-1, 0, 2147483647}};
  a["large"] = {{1, 1}, Integers{1ll << 40}};
  a["text"] = {{}, Texts{"{\"tool\": \"x\"}\n"}};
  a["names"] = {{4}, Texts{"", "Rücken", "手", "😀b"}};
  a["none"] = {{0, 3}, Doubles{}};
  return a;
}

// A zip archive with one stored member holding these bytes.
std::string zip_of(const std::string& member, const std::string& name = "a.npy") {
  test::TemporaryFolder folder;
  const std::string path = (folder.path / "x.npz").string();
  int code = 0;
  zip_t* z = zip_open(path.c_str(), ZIP_CREATE, &code);
  const auto index = zip_file_add(z, name.c_str(), zip_source_buffer(z, member.data(), member.size(), 0), 0);
  zip_set_file_compression(z, static_cast<zip_uint64_t>(index), ZIP_CM_STORE, 0);
  EXPECT_EQ(zip_close(z), 0);
  return read_file(path);
}

std::string npy(std::string dict, const std::string& payload, char version = 1) {
  dict += '\n';
  std::string out("\x93NUMPY", 6);
  out += version;
  out += '\0';
  out += static_cast<char>(dict.size() & 0xff);
  out += static_cast<char>(dict.size() >> 8);
  if (version > 1) out += std::string(2, '\0');
  return out + dict + payload;
}

std::string dict(const std::string& descr, const std::string& shape) {
  return "{'descr': '" + descr + "', 'fortran_order': False, 'shape': " + shape + ", }";
}

TEST(Npz, RoundTripIsExactAndDeterministic) {
  const Npz a = sample();
  const std::string first = format_npz(a);
  const Npz b = parse_npz(first);
  EXPECT_TRUE(same_arrays(a, b));
  EXPECT_EQ(format_npz(b), first);
  ::setenv("TZ", "Asia/Tokyo", 1);
  ::tzset();
  EXPECT_EQ(format_npz(a), first);
  ::unsetenv("TZ");
  ::tzset();
}

TEST(Npz, NumPyReadsWhatIsWritten) {
  test::TemporaryFolder folder;
  const std::string path = (folder.path / "x.npz").string();
  write_file(path, format_npz(sample()), Overwrite::refuse);
  const int status = test::python(
      "-c \"import numpy as np, sys\n"
      "f = np.load(sys.argv[1], allow_pickle=False)\n"
      "assert f.files == ['large', 'names', 'none', 'numbers', 'scalar', 'small', 'text'], f.files\n"
      "assert {k: (f[k].dtype.str, f[k].shape) for k in f.files} == dict(large=('<i8', (1, 1)), names=('<U6', (4,)), "
      "none=('<f8', (0, 3)),\n"
      "  numbers=('<f8', (2, 3)), scalar=('<f8', ()), small=('<i4', (3,)), text=('<U14', ())), f\n"
      "assert f['numbers'].tolist() == [[0, 0, 1e-308], [-1.5, sys.float_info.max, float('inf')]] and f['scalar'] == "
      "29.97\n"
      "assert f['names'].tolist() == ['', 'R\\u00fccken', '\\u624b', '\\U0001f600b'] and f['large'][0, 0] == "
      "2**40\n\" " +
      path);
  if (status == -1) GTEST_SKIP() << "NumPy is not installed";
  EXPECT_EQ(status, 0);
}

TEST(Npz, ReadsEveryDtype) {
  const Npz a = parse_npz(data("npz/dtypes.npz"));
  const auto number = [&](const char* name, std::size_t i) { return std::get<Doubles>(a.at(name).data).at(i); };
  const auto integer = [&](const char* name, std::size_t i) { return std::get<Integers>(a.at(name).data).at(i); };
  EXPECT_EQ(number("f4", 0), 0.5);
  EXPECT_EQ(number("f4", 1), -1);
  EXPECT_EQ(number("f8", 0), 1e-300);
  EXPECT_TRUE(a.at("f8").shape.empty());
  EXPECT_EQ(a.at("i4").shape, (std::vector<std::size_t>{1, 2}));
  EXPECT_EQ(integer("i4", 0), -5);
  EXPECT_EQ(integer("i8", 0), 1ll << 62);
  EXPECT_EQ(integer("u1", 0), 255);
  EXPECT_EQ(integer("u4", 0), 4294967295ll);
  EXPECT_EQ(integer("u8", 0), std::numeric_limits<std::int64_t>::max());
  EXPECT_EQ(std::get<Integers>(a.at("b1").data), (Integers{1, 0}));
  EXPECT_EQ(std::get<Texts>(a.at("S").data), (Texts{"", "ab", "abc"}));
  EXPECT_EQ(std::get<Texts>(a.at("U").data), (Texts{"", "Müller", "骨😀"}));
  EXPECT_EQ(a.at("empty").shape, (std::vector<std::size_t>{0, 3}));
  EXPECT_EQ(std::get<Doubles>(a.at("fortran_line").data), (Doubles{0, 1, 2}));
  EXPECT_EQ(parse_npz(data("npz/dtypes.npz"), {"i8", "absent"}).size(), 1u);
}

TEST(Npz, ReadsHeaderVersions) {
  const std::string four("\0\0\0\0\0\0\x10\x40", 8);
  for (const char version : {'\1', '\2', '\3'})
    EXPECT_EQ(std::get<Doubles>(parse_npz(zip_of(npy(dict("<f8", "(1,)"), four, version))).at("a").data), Doubles{4});
  EXPECT_EQ(
      std::get<Doubles>(
          parse_npz(zip_of(npy("{\"shape\": (1L,), \"fortran_order\": True, \"descr\": \"<f8\"}", four))).at("a").data),
      Doubles{4});
}

TEST(Npz, RefusesByName) {
  const auto message = [](const std::string& file) {
    const Error e = error_of([&] { parse_npz(data("npz/" + file + ".npz")); });
    EXPECT_EQ(e.status(), Exit::data);
    EXPECT_EQ(e.where().object, "a");
    return e.message();
  };
  EXPECT_EQ(message("object"), "an array of pickled Python objects, which is never loaded, expected numbers or texts");
  EXPECT_EQ(message("fortran"), "a Fortran-order array of shape (2, 3), expected C order");
  EXPECT_EQ(message("big_endian"), "dtype '>f8', expected little-endian f4 f8 i4 i8 u1 u4 u8 b1 S or U");
  EXPECT_EQ(message("structured"), "a structured array, expected plain numbers or texts");
  EXPECT_EQ(message("half"), "dtype '<f2', expected little-endian f4 f8 i4 i8 u1 u4 u8 b1 S or U");
  EXPECT_EQ(message("u8_large"), "value 9223372036854775808, expected at most 2^63 - 1");
  EXPECT_EQ(error_of([] { parse_npz("HIERARCHY"); }).message(),
            "does not start with a zip signature, expected an .npz file");
  EXPECT_EQ(error_of([] { parse_npz(""); }).status(), Exit::data);
  EXPECT_EQ(error_of([] { parse_npz("PK\x05\x06" + std::string(18, '\0')); }).message(), "a zip file without a .npy member, expected an .npz file");
}

TEST(Npz, RefusesHeadersThatPromiseMoreThanThereIs) {
  const auto message = [](const std::string& member) {
    const Error e = error_of([&] { parse_npz(zip_of(member)); });
    EXPECT_EQ(e.status(), Exit::data);
    return e.message();
  };
  EXPECT_EQ(message(npy(dict("<f8", "(1125899906842624,)"), "12345678")),
            "shape (1125899906842624,) of <f8 needs 9007199254740992 bytes, the member holds 8");
  EXPECT_EQ(message(npy(dict("<f8", "(4294967296, 4294967296)"), "")),
            "a size of 4294967296 x 4294967296 does not fit in memory");
  EXPECT_EQ(message(npy(dict("<f8", "(2305843009213693952,)"), "")),
            "a size of 2305843009213693952 x 8 does not fit in memory");
  EXPECT_EQ(message(npy(dict("<U4611686018427387904", "(1,)"), "")),
            "a size of 4611686018427387904 x 4 does not fit in memory");
  EXPECT_EQ(message(npy(dict("<U0", "(1125899906842624,)"), "")), "1125899906842624 texts, expected at most 2^20");
  EXPECT_EQ(
      message(npy(dict("<f8", "(-1,)"), "")),
      "a .npy header with a dimension that is no whole number of at least 0, expected descr, fortran_order and shape");
  EXPECT_EQ(message(npy(dict("<f8", "(2,)"), "12345678")), "shape (2,) of <f8 needs 16 bytes, the member holds 8");
  EXPECT_EQ(message(npy(dict("<f8", "()"), "12345678901234567")), "shape () of <f8 needs 8 bytes, the member holds 17");
  EXPECT_EQ(message("short"), "a member of 5 bytes, too short for a .npy header");
  EXPECT_EQ(message("not an array at all"), "no .npy signature, expected an array written by NumPy");
  EXPECT_EQ(message(std::string("\x93NUMPY\x01\0\xff\xff", 10) + "{}"),
            "a .npy header of 65545 bytes in a member of 12");
  EXPECT_EQ(message(npy("{'descr': '<f8', 'shape': (), }", "12345678")),
            "a .npy header with a missing key, expected descr, fortran_order and shape");
  EXPECT_EQ(
      message(npy(dict("<f8", "(" + std::string(1000, '1') + ",)"), "")),
      "a .npy header with a dimension that is no whole number of at least 0, expected descr, fortran_order and shape");
}

TEST(Npz, CutAnywhereIsRefused) {
  const std::string bytes = format_npz({{"a", {{2}, Doubles{1, 2}}}, {"b", {{}, Texts{"x"}}}});
  for (std::size_t n = 0; n < bytes.size(); ++n)
    ASSERT_EQ(error_of([&] { parse_npz(std::string_view(bytes).substr(0, n)); }).status(), Exit::data) << n;
}

// Zip covers a member's bytes by a CRC, and what its directory says of them by saying it twice.
TEST(Npz, EveryFlippedBitIsRefusedOrHarmless) {
  const Npz arrays{{"a", {{2}, Doubles{1, 2}}}, {"names", {{1}, Texts{"x"}}}};
  std::string bytes = format_npz(arrays);
  const auto same = [&](const Npz& other) {
    return other.size() == arrays.size() && std::all_of(arrays.begin(), arrays.end(), [&](const auto& item) {
      const auto found = other.find(item.first);
      return found != other.end() && found->second.shape == item.second.shape && found->second.data == item.second.data;
    });
  };
  ASSERT_TRUE(same(parse_npz(bytes)));
  std::size_t refused = 0, harmless = 0;
  for (std::size_t at = 0; at < bytes.size(); ++at)
    for (int bit = 0; bit < 8; ++bit) {
      bytes[at] = static_cast<char>(bytes[at] ^ (1 << bit));
      try {
        EXPECT_TRUE(same(parse_npz(bytes))) << "byte " << at << " bit " << bit << " changes the content unnoticed";
        ++harmless;
      } catch (const Error& e) {
        EXPECT_EQ(e.status(), Exit::data) << at;
        ++refused;
      }
      bytes[at] = static_cast<char>(bytes[at] ^ (1 << bit));
    }
  EXPECT_GT(refused, 4 * harmless);
  std::cout << bytes.size() << " bytes: " << refused << " flips refused, " << harmless << " without effect\n";
}

TEST(Npz, WriterRefusals) {
  EXPECT_EQ(error_of([] { format_npz({{"a", {{2}, Doubles{1}}}}); }).status(), Exit::internal);
  EXPECT_EQ(error_of([] {
              format_npz({{"a", {{1}, Texts{"\xff"}}}});
            }).message(),
            "a text that is not UTF-8 or holds a NUL, expected plain UTF-8");
}

// Damaged archives are refused with Error or read as arrays that survive write -> read -> write.
TEST(NpzFuzz, MutationsAreRefusedOrRoundTrip) {
  const std::vector<std::string> seeds = {format_npz(sample()),
                                          data("npz/dtypes.npz"),
                                          data("npz/shape.npz"),
                                          data("npz/amass_smplh_float32.npz"),
                                          zip_of(npy(dict("<f8", "(3, 2)"), std::string(48, 'x'))),
                                          zip_of(npy(dict("|S3", "(2,)"), std::string("ab\0cde", 6)))};
  Random random(77, 0);
  int read = 0;
  for (int n = 0; n < 6000; ++n) {
    std::string bytes = seeds[random.below(seeds.size())];
    for (std::uint64_t k = random.below(3) + 1; k > 0; --k) {
      const std::size_t at = random.below(bytes.size());
      if (random.below(4) == 0)
        bytes.erase(at, random.below(8));
      else
        bytes[at] = static_cast<char>(random.below(256));
    }
    try {
      const Npz arrays = parse_npz(bytes);
      ++read;
      if (arrays.empty()) continue;
      const std::string first = format_npz(arrays);
      ASSERT_EQ(format_npz(parse_npz(first)), first);
    } catch (const Error& e) {
      ASSERT_EQ(e.status(), Exit::data) << e.what();
    }
  }
  EXPECT_GT(read, 100);
}

}  // namespace
}  // namespace mocap::io
