// tests/protocol/allocation_test.cpp: a program of its own, for it counts every operator new.
#include <atomic>
#include <catch2/catch.hpp>
#include <cstdlib>
#include <new>

#include "protocol/datagram.hpp"
#include "tests/protocol/wire_samples.hpp"

namespace {
std::atomic<std::size_t> allocations{0};
}  // namespace

// All forms that the standard library does not lead back to these; the address sanitizer wants
// pairs.
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
    ++allocations;
    return std::malloc(size > 0 ? size : 1);
}
void* operator new(std::size_t size) {
    if (void* p = operator new(size, std::nothrow)) return p;
    throw std::bad_alloc();
}
void* operator new[](std::size_t size) {
    return operator new(size);
}
void operator delete(void* p) noexcept {
    std::free(p);
}
void operator delete(void* p, std::size_t) noexcept {
    std::free(p);
}
void operator delete(void* p, const std::nothrow_t&) noexcept {
    std::free(p);
}
void operator delete[](void* p) noexcept {
    std::free(p);
}
void operator delete[](void* p, std::size_t) noexcept {
    std::free(p);
}

TEST_CASE("parsing allocates nothing, whatever the bytes") {
    using namespace ellicast;
    common::Random random(1);
    std::size_t accepted = 0;
    for (std::uint64_t seed = 1; seed <= 2000; ++seed) {
        tests::Bytes bytes = tests::random_datagram(seed).bytes;
        if (seed % 2 == 0) {
            const std::size_t at = random.below(bytes.size());
            bytes[at] = static_cast<std::uint8_t>(random.next());
            tests::fix_checksum(bytes);
        }
        const std::size_t before = allocations;
        const auto view = protocol::parse_datagram(bytes);
        const std::size_t after = allocations;
        accepted += view.has_value() ? 1 : 0;
        REQUIRE(after == before);
    }
    CHECK(accepted >= 1000);
    CHECK(allocations > 1000);  // the count does count
}
