// protocol/box_check.cpp
#include "protocol/box_check.hpp"

#include "protocol/byte_reader.hpp"

#if defined(__x86_64__) && defined(__GNUC__)
#define ELLICAST_BOX_CHECK_AVX2 1
#endif

namespace ellicast::protocol {
namespace {

/// One body for all instruction sets. No branch inside the loop, so that it can be made wide.
[[gnu::always_inline]] inline bool check(const std::uint8_t* p, std::size_t blocks,
                                         const BoxBlock& least, const BoxBlock& most) {
    std::array<std::uint32_t, kBoxBlock> outside{};
    for (std::size_t block = 0; block < blocks; ++block, p += 4 * kBoxBlock) {
        for (std::size_t k = 0; k < kBoxBlock; ++k) {
            const float x = load_f32(p + 4 * k);
            outside[k] |= (x >= least[k] ? 0u : 1u) | (x <= most[k] ? 0u : 1u);
        }
    }
    std::uint32_t any = 0;
    for (const std::uint32_t one : outside) any |= one;
    return any == 0;
}

#ifdef ELLICAST_BOX_CHECK_AVX2

__attribute__((target("avx2"))) bool check_avx2(const std::uint8_t* p, std::size_t blocks,
                                                const BoxBlock& least, const BoxBlock& most) {
    return check(p, blocks, least, most);
}

/// Before this is set, during the start of the program, the plain form does the work.
const bool kHasAvx2 = [] {
    __builtin_cpu_init();
    return __builtin_cpu_supports("avx2") != 0;
}();

#endif

}  // namespace

bool all_inside_plain(const std::uint8_t* p, std::size_t blocks, const BoxBlock& least,
                      const BoxBlock& most) {
    return check(p, blocks, least, most);
}

bool all_inside(const std::uint8_t* p, std::size_t blocks, const BoxBlock& least,
                const BoxBlock& most) {
#ifdef ELLICAST_BOX_CHECK_AVX2
    if (kHasAvx2) return check_avx2(p, blocks, least, most);
#endif
    return all_inside_plain(p, blocks, least, most);
}

}  // namespace ellicast::protocol
