// common/random.hpp
#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace ellicast::common {

/// SplitMix64 ([SLF14]): a seeded generator whose numbers are the same on every platform and
/// standard library, unlike the distributions of <random>. Not for secrets.
class Random {
  public:
    explicit Random(std::uint64_t seed) : state_(seed) {}

    /// Uniform 64 bits.
    std::uint64_t next() {
        state_ += 0x9e3779b97f4a7c15u;
        return finalised(state_);
    }

    /// Its last step alone: a bijection whose every output bit depends on all of z.
    static std::uint64_t finalised(std::uint64_t z) {
        z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
        z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
        return z ^ (z >> 31);
    }

    /// Uniform in [0, 1), 53 bits.
    double uniform() { return static_cast<double>(next() >> 11) * 0x1.0p-53; }

    /// Uniform in [0, n), n > 0. Bias below 2^-32 for n < 2^32.
    std::size_t below(std::size_t n) {
        assert(n > 0);
        __extension__ using Wide = unsigned __int128;
        return static_cast<std::size_t>((static_cast<Wide>(next()) * n) >> 64);
    }

    bool chance(double probability) { return uniform() < probability; }

  private:
    std::uint64_t state_;
};

/// Fisher-Yates shuffle in place.
template <class T>
void shuffle(std::vector<T>& items, Random& random) {
    for (std::size_t i = items.size(); i > 1; --i) std::swap(items[i - 1], items[random.below(i)]);
}

}  // namespace ellicast::common
