// tests/protocol/section_filter_test.cpp
#include "protocol/section_filter.hpp"

#include <catch2/catch.hpp>

#include "tests/protocol/wire_samples.hpp"

namespace {

using namespace ellicast::protocol;
using namespace ellicast::tests;

auto keep_all_but(SectionKind kind) {
    return [kind](const SectionView& section) { return section.kind != kind; };
}

}  // namespace

TEST_CASE("sections of one kind are taken out and the rest stays as it was") {
    const Bytes before = sample_datagram();
    const auto after = keep_sections(before, keep_all_but(SectionKind::ellipsoids));
    REQUIRE(after);
    const auto old_view = parse_datagram(before);
    const auto new_view = parse_datagram(*after);
    REQUIRE((old_view && new_view));
    CHECK(new_view->header == old_view->header);
    REQUIRE(new_view->sections().size() == 2);
    CHECK(new_view->sections()[0].description() == sample_description());
    const SectionView& left = new_view->sections()[1];
    const SectionView& was = old_view->sections()[2];
    CHECK((left.first == was.first && left.stride == was.stride && left.count == was.count));
    CHECK(Bytes(left.body.begin(), left.body.end()) == Bytes(was.body.begin(), was.body.end()));
}

TEST_CASE("keeping all sections gives the same bytes") {
    for (std::uint64_t seed = 1; seed <= 200; ++seed) {
        const Bytes bytes = random_datagram(seed).bytes;
        CHECK(keep_sections(bytes, [](const SectionView&) { return true; }) == bytes);
    }
}

TEST_CASE("a datagram left empty is lost whole") {
    CHECK_FALSE(keep_sections(sample_datagram(), [](const SectionView&) { return false; }));
}

TEST_CASE("each section is asked about once and in order") {
    for (std::uint64_t seed = 1; seed <= 200; ++seed) {
        CAPTURE(seed);
        const RandomDatagram made = random_datagram(seed);
        std::size_t asked = 0;
        const auto every_second = [&](const SectionView& section) {
            REQUIRE(section.kind == made.sections.at(asked).kind);
            return asked++ % 2 == 0;
        };
        const auto after = keep_sections(made.bytes, every_second);
        REQUIRE(asked == made.sections.size());
        REQUIRE(after);
        const auto view = parse_datagram(*after);
        REQUIRE(view);
        REQUIRE(view->sections().size() == (made.sections.size() + 1) / 2);
    }
}

TEST_CASE("sections of unknown kinds stay") {
    const Bytes unknown = from_hex("c8 00 02 aa bb");
    const Bytes before = datagram_with(unknown);
    CHECK(keep_sections(before, [](const SectionView&) { return false; }) == before);
}

TEST_CASE("bytes that are no datagram come back as they are") {
    Bytes bytes = sample_datagram();
    bytes[50] ^= 1;
    CHECK(keep_sections(bytes, [](const SectionView&) { return false; }) == bytes);
    CHECK(keep_sections(Bytes{}, [](const SectionView&) { return false; }) == Bytes{});
}
