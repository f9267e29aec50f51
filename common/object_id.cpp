// common/object_id.cpp
#include "common/object_id.hpp"

#include <sodium.h>

#include <algorithm>
#include <cassert>
#include <cstring>
#include <stdexcept>

namespace ellicast::common {
namespace {

constexpr std::size_t kDigestBytes = 32;

// The state is stored as bytes so that libsodium stays private to this file. It is copied in and
// out instead of cast, because an array of bytes is not a libsodium state.
using State = crypto_generichash_state;

template <std::size_t N>
State load(const std::array<std::uint8_t, N>& bytes) {
    static_assert(sizeof(State) == N);
    State state;
    std::memcpy(&state, bytes.data(), N);
    return state;
}

template <std::size_t N>
void store(const State& state, std::array<std::uint8_t, N>& bytes) {
    static_assert(sizeof(State) == N);
    std::memcpy(bytes.data(), &state, N);
}

}  // namespace

Digest::Digest() {
    // BLAKE2b itself needs no sodium_init(); calling it lets libsodium pick its fast
    // implementation.
    if (sodium_init() < 0) throw std::runtime_error("libsodium cannot be initialised");
    State state;
    [[maybe_unused]] const int failed = crypto_generichash_init(&state, nullptr, 0, kDigestBytes);
    assert(failed == 0);
    store(state, state_);
}

void Digest::update(std::span<const std::uint8_t> bytes) {
    State state = load(state_);
    [[maybe_unused]] const int failed =
        crypto_generichash_update(&state, bytes.data(), bytes.size());
    assert(failed == 0);
    store(state, state_);
}

std::array<std::uint8_t, 32> Digest::finish32() {
    State state = load(state_);
    std::array<std::uint8_t, kDigestBytes> digest{};
    // Fails only when the digest was taken before.
    [[maybe_unused]] const int failed =
        crypto_generichash_final(&state, digest.data(), digest.size());
    assert(failed == 0);
    store(state, state_);
    return digest;
}

std::array<std::uint8_t, 8> Digest::finish8() {
    const std::array<std::uint8_t, 32> whole = finish32();
    std::array<std::uint8_t, 8> first{};
    std::copy_n(whole.begin(), first.size(), first.begin());
    return first;
}

}  // namespace ellicast::common
