#include "libmocap/base/random.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <fstream>
#include <set>
#include <sstream>
#include <vector>

namespace mocap {
namespace {

// tests/data/base/philox.py: Philox4x32-10 from its definition, itself held against Random123's known answers.
TEST(Random, WordsAreThoseOfPhilox) {
  std::ifstream file(TEST_DATA "/base/philox.tsv");
  int rows = 0;
  for (std::string line; std::getline(file, line); ++rows) {
    std::istringstream in(line);
    std::uint64_t seed = 0, stream = 0, position = 0, word = 0;
    in >> seed >> stream >> position;
    Random random(seed, stream);
    random.seek(position);
    for (int i = 0; i < 8; ++i) {
      in >> word;
      ASSERT_EQ(random.next_u32(), word) << line;
    }
    ASSERT_FALSE(in.fail());
    EXPECT_EQ(random.position(), position + 8);
  }
  EXPECT_EQ(rows, 6);
}

TEST(Random, StreamsAndSeedsDiffer) {
  std::set<std::uint64_t> seen;
  for (std::uint64_t seed = 0; seed < 30; ++seed)
    for (std::uint64_t stream = 0; stream < 30; ++stream) seen.insert(Random(seed, stream).next_u64());
  EXPECT_EQ(seen.size(), 900u);
}

TEST(Random, SeekContinuesWithTheSameNumbers) {
  Random whole(3, 4);
  std::vector<double> expected;
  std::vector<std::uint64_t> positions;
  for (int i = 0; i < 40; ++i) {
    positions.push_back(whole.position());
    expected.push_back(i % 3 == 0 ? whole.uniform() : i % 3 == 1 ? whole.normal() : static_cast<double>(whole.below(10)));
  }
  for (int start = 39; start >= 0; --start) {  // backwards too: nothing of the old place may stick
    Random again(3, 4);
    again.next_u64();
    again.seek(positions[static_cast<std::size_t>(start)]);
    for (int i = start; i < 40; ++i)
      ASSERT_EQ(i % 3 == 0 ? again.uniform() : i % 3 == 1 ? again.normal() : static_cast<double>(again.below(10)), expected[static_cast<std::size_t>(i)]);
  }
}

TEST(Random, UniformIsUniform) {
  Random random(1, 0);
  const int n = 200000;
  double sum = 0, squares = 0;
  std::array<int, 20> bins{};
  for (int i = 0; i < n; ++i) {
    const double u = random.uniform();
    ASSERT_GE(u, 0);
    ASSERT_LT(u, 1);
    sum += u;
    squares += u * u;
    ++bins[static_cast<std::size_t>(u * 20)];
  }
  EXPECT_NEAR(sum / n, 0.5, 5 * std::sqrt(1.0 / 12 / n));
  EXPECT_NEAR(squares / n, 1.0 / 3, 5 * std::sqrt(4.0 / 45 / n));
  double chi2 = 0;
  for (const int count : bins) chi2 += std::pow(count - n / 20.0, 2) / (n / 20.0);
  EXPECT_LT(chi2, 43.8);  // 0.999 quantile, 19 degrees of freedom
}

TEST(Random, RangeNeverReachesItsUpperEnd) {
  Random random(1, 1);
  // Two neighbouring numbers: rounding would return the upper end every other time.
  const double low = 1, high = std::nextafter(1.0, 2.0);
  for (int i = 0; i < 100; ++i) ASSERT_EQ(random.uniform(low, high), low);
  for (int i = 0; i < 1000; ++i) {
    const double v = random.uniform(-3, 5);
    ASSERT_GE(v, -3);
    ASSERT_LT(v, 5);
  }
}

TEST(Random, NormalHasItsMoments) {
  Random random(2, 0);
  const int n = 200000;
  double m[5] = {};
  for (int i = 0; i < n; ++i) {
    const double x = random.normal();
    for (int k = 1; k <= 4; ++k) m[k] += std::pow(x, k) / n;
  }
  const double sigma = 5 / std::sqrt(n);
  EXPECT_NEAR(m[1], 0, sigma);
  EXPECT_NEAR(m[2], 1, sigma * std::sqrt(2));
  EXPECT_NEAR(m[3], 0, sigma * std::sqrt(15));
  EXPECT_NEAR(m[4], 3, sigma * std::sqrt(96));
  double sum = 0;
  for (int i = 0; i < n; ++i) sum += random.normal(10, 0.5);
  EXPECT_NEAR(sum / n, 10, 0.5 * sigma);
}

TEST(Random, BelowStaysBelowAndReachesEverything) {
  Random random(4, 0);
  for (int i = 0; i < 100; ++i) ASSERT_EQ(random.below(1), 0u);
  for (const std::uint64_t n : {2ULL, 7ULL, 1000ULL}) {
    std::vector<int> count(n);
    const int draws = 100 * static_cast<int>(n) + 20000;
    for (int i = 0; i < draws; ++i) ++count.at(random.below(n));
    for (const int c : count) EXPECT_NEAR(c, draws / static_cast<double>(n), 6 * std::sqrt(draws / static_cast<double>(n)));
  }
  const std::uint64_t large = (1ULL << 63) + 1;  // half of all words must be drawn again
  int upper = 0;
  for (int i = 0; i < 2000; ++i) {
    const std::uint64_t v = random.below(large);
    ASSERT_LT(v, large);
    upper += v >= large / 2;
  }
  EXPECT_NEAR(upper, 1000, 6 * std::sqrt(500));
}

TEST(StreamOf, SeparatesItsParts) {
  std::set<std::uint64_t> seen;
  for (std::uint64_t a = 0; a < 20; ++a)
    for (std::uint64_t b = 0; b < 20; ++b)
      for (std::uint64_t c = 0; c < 20; ++c) seen.insert(stream_of(a, b, c));
  EXPECT_EQ(seen.size(), 8000u);
  EXPECT_EQ(stream_of(1, 2), stream_of(1, 2, 0));
}

}  // namespace
}  // namespace mocap
