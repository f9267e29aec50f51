// tests/protocol/damage_test.cpp: datagrams damaged at random behind a right checksum.
#include <array>
#include <catch2/catch.hpp>
#include <cmath>

#include "protocol/datagram.hpp"
#include "tests/protocol/promises.hpp"
#include "tests/protocol/wire_samples.hpp"

namespace {

using namespace ellicast::protocol;
using namespace ellicast::tests;
using ellicast::common::Random;

void damage(Bytes& bytes, Random& random) {
    const std::size_t places = 1 + random.below(3);
    for (std::size_t k = 0; k < places; ++k) {
        // Half of the damage goes where the structure is.
        const std::size_t at = random.below(random.chance(0.5) ? 110 : bytes.size());
        bytes[at] = random.chance(0.5) ? static_cast<std::uint8_t>(random.next())
                                       : static_cast<std::uint8_t>(random.chance(0.5) ? 0xff : 0);
    }
    if (random.chance(0.2)) bytes.resize(bytes.size() - random.below(80));
    if (random.chance(0.2)) bytes.resize(bytes.size() + random.below(80), 1);
    fix_checksum(bytes);
}

}  // namespace

TEST_CASE("whatever is accepted keeps every promise") {
    std::size_t accepted = 0;
    std::array<std::size_t, static_cast<std::size_t>(WireError::kCount)> refused{};
    for (std::uint64_t seed = 1; seed <= 6000; ++seed) {
        CAPTURE(seed);
        Random random(seed);
        Bytes bytes = random.chance(0.5) ? sample_datagram(seed) : random_datagram(seed).bytes;
        damage(bytes, random);
        const auto fault = refusal_of(bytes);
        if (fault) {
            ++refused.at(static_cast<std::size_t>(*fault));
            continue;
        }
        ++accepted;
        REQUIRE(broken_promise(bytes) == "");
    }
    CHECK(accepted > 500);
    for (std::size_t k = 0; k < refused.size(); ++k) {
        const auto error = static_cast<WireError>(k);
        const bool cannot_happen =
            error == WireError::too_short || error == WireError::bad_checksum;
        CAPTURE(to_string(error));
        CHECK((cannot_happen || refused[k] > 0));
    }
}

TEST_CASE("the sender's question and the receiver's check have one answer") {
    Random random(12);
    std::size_t good = 0;
    for (int round = 0; round < 20'000; ++round) {
        CAPTURE(round);
        const Hint hint = sample_header().hint;
        EllipsoidRecord record = random_ellipsoid(hint, random);
        // Spread over all scales, so that many fall beside the limits.
        const double scale = std::pow(10.0, -7.0 + 8.0 * random.uniform());
        for (std::size_t k = 3; k < 9; ++k) {
            record.scalars[k] = static_cast<float>(double{record.scalars[k]} * scale);
        }
        DatagramWriter writer(sample_header(), kMinDatagramBytes);
        writer.add_ellipsoids(0, 1, std::vector{record});
        const bool accepted = !refusal_of(writer.finish());
        REQUIRE(accepted == acceptable(record, hint));
        good += accepted ? 1 : 0;
    }
    CHECK((good > 2'000 && good < 18'000));
}
