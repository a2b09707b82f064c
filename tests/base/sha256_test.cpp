#include "libmocap/base/sha256.hpp"

#include <gtest/gtest.h>

#include "libmocap/base/error.hpp"

namespace mocap {
namespace {

// FIPS 180-2 appendix B.
TEST(Sha256, KnownVectors) {
  EXPECT_EQ(to_hex(sha256("")), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(to_hex(sha256("abc")), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(to_hex(sha256("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq")),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  EXPECT_EQ(to_hex(sha256(std::string(1000000, 'a'))), "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST(Sha256, PiecesHashLikeTheWhole) {
  const std::string text = "the pieces may be cut anywhere, also at a block of sixty-four bytes, or be empty";
  for (std::size_t cut = 0; cut <= text.size(); ++cut) {
    Sha256 hash;
    hash.update(std::string_view(text).substr(0, cut));
    hash.update("");
    hash.update(std::string_view(text).substr(cut));
    ASSERT_EQ(hash.finish(), sha256(text));
  }
}

TEST(Sha256, HexGoesBothWays) {
  const Digest digest = sha256("x");
  EXPECT_EQ(from_hex(to_hex(digest)), digest);
  EXPECT_THROW(from_hex(""), Error);
  EXPECT_THROW(from_hex(to_hex(digest) + "0"), Error);
  std::string bad = to_hex(digest);
  for (const char c : {'g', 'A', '/', ':', '\0'}) {
    bad[63] = c;
    EXPECT_THROW(from_hex(bad), Error) << c;
  }
}

}  // namespace
}  // namespace mocap
