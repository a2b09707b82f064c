// numpy.random.RandomState(seed), as far as public evaluation programs draw from it: the same indices as theirs.
#pragma once
#include <cstdint>
#include <random>
#include <vector>

namespace mocap::metrics {

class NumpyRandom {
 public:
  explicit NumpyRandom(std::uint32_t seed) : words_(seed) {}
  std::uint32_t below(std::uint32_t n) {  // randint(0, n); n >= 1
    std::uint32_t mask = n - 1;
    for (int shift = 1; shift < 32; shift *= 2) mask |= mask >> shift;
    if (mask == 0) return 0;
    std::uint32_t value = 0;
    do value = static_cast<std::uint32_t>(words_()) & mask;
    while (value > n - 1);
    return value;
  }
  std::vector<std::size_t> permutation(std::size_t n) {  // permutation(n); choice(n, k, replace=False) is its first k
    std::vector<std::size_t> p(n);
    for (std::size_t i = 0; i < n; ++i) p[i] = i;
    for (std::size_t i = n; i-- > 1;) std::swap(p[i], p[below(static_cast<std::uint32_t>(i + 1))]);
    return p;
  }

 private:
  std::mt19937 words_;
};

}  // namespace mocap::metrics
