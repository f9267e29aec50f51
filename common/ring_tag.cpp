// common/ring_tag.cpp
#include "common/ring_tag.hpp"

#include "common/random.hpp"

namespace ellicast::common {
namespace {

constexpr unsigned kValences = 8;
constexpr unsigned kSums = 32;

}  // namespace

std::uint8_t ring_hash(std::uint32_t index) {
    return static_cast<std::uint8_t>(Random::finalised(index) >> 59);
}

std::uint16_t ring_tag(std::size_t valence, unsigned hash_sum) {
    return static_cast<std::uint16_t>(valence % kValences + kValences * (hash_sum % kSums));
}

unsigned ring_valence(std::uint16_t tag) {
    return tag % kValences;
}

unsigned ring_sum(std::uint16_t tag) {
    return tag / kValences % kSums;
}

}  // namespace ellicast::common
