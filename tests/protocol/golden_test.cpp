// tests/protocol/golden_test.cpp: the codec against bytes worked out by hand.
#include <catch2/catch.hpp>

#include "protocol/datagram.hpp"
#include "protocol/object_table.hpp"
#include "tests/protocol/golden_datagram.hpp"
#include "tests/protocol/wire_samples.hpp"

namespace {

using namespace ellicast::protocol;
using namespace ellicast::tests;

}  // namespace

TEST_CASE("writing the golden datagram gives the golden bytes") {
    DatagramWriter writer(golden_header(), kMinDatagramBytes);
    REQUIRE(writer.add_description(golden_description()));
    writer.add_ellipsoids(399, 1, std::vector{golden_ellipsoid()});
    writer.add_vertices(7, 1021, golden_vertices());
    CHECK(writer.finish() == from_hex(kGoldenHex));
}

TEST_CASE("reading the golden bytes gives the golden datagram") {
    const Bytes bytes = from_hex(kGoldenHex);
    REQUIRE(bytes.size() == 222);
    const auto view = parse_datagram(bytes);
    REQUIRE(view);
    CHECK(view->header == golden_header());
    REQUIRE(view->sections().size() == 3);

    const SectionView& description = view->sections()[0];
    REQUIRE(description.kind == SectionKind::description);
    CHECK(description.description() == golden_description());

    const SectionView& ellipsoids = view->sections()[1];
    REQUIRE(ellipsoids.kind == SectionKind::ellipsoids);
    REQUIRE(ellipsoids.count == 1);
    CHECK(ellipsoids.index(0) == 399);
    CHECK(ellipsoids.ellipsoid(0) == golden_ellipsoid());

    const SectionView& vertices = view->sections()[2];
    REQUIRE(vertices.kind == SectionKind::vertices);
    REQUIRE(vertices.count == 2);
    CHECK(vertices.index(0) == 7);
    CHECK(vertices.index(1) == 1028);
    for (std::size_t k = 0; k < 2; ++k) CHECK(vertices.vertex(k) == golden_vertices()[k]);
}

TEST_CASE("the golden datagram of tagged vertices is written and read") {
    const Bytes bytes = from_hex(kGoldenTaggedHex);
    const std::vector<VertexRecord> vertices = golden_tagged_vertices();
    DatagramWriter writer(golden_tagged_header(), kMinDatagramBytes);
    writer.add_vertices(0, 1, vertices);
    CHECK(writer.finish() == bytes);

    const auto view = parse_datagram(bytes);
    REQUIRE(view);
    CHECK(view->header == golden_tagged_header());
    REQUIRE(view->sections().size() == 1);
    REQUIRE(view->sections()[0].count == 3);
    for (std::size_t k = 0; k < 3; ++k) CHECK(view->sections()[0].vertex(k) == vertices[k]);
}

TEST_CASE("the table of the object id holds a vertex's position and the tags of the format") {
    Bytes table;
    feed_object_table(golden_tagged_header().hint, {}, golden_tagged_vertices(),
                      [&](std::span<const std::uint8_t> part) {
                          table.insert(table.end(), part.begin(), part.end());
                      });
    const Bytes tail = from_hex(
        "3f 80 00 00 c0 00 00 00 40 80 00 00 0a bc 5e ff 80 00 "
        "bf 80 00 00 3d cc cc cd 40 50 00 00 01 23 07 00 00 00 "
        "00 00 00 00 3f 80 00 00 3f 00 00 00 0f ff 00 01 02 03");
    REQUIRE(table.size() == kCanonicalHintBytes + tail.size());
    CHECK(Bytes(table.begin() + kCanonicalHintBytes, table.end()) == tail);
}

TEST_CASE("the canonical hint is the hint on the wire and then its approximate flag") {
    Bytes wire = from_hex(kGoldenHex);
    const Bytes expected(wire.begin() + 30, wire.begin() + 73);
    Hint hint = golden_header().hint;
    auto canonical = canonical_bytes(hint);
    CHECK(Bytes(canonical.begin(), canonical.end() - 1) == expected);
    CHECK(canonical.back() == 1);
    hint.approximate = false;
    canonical = canonical_bytes(hint);
    CHECK(Bytes(canonical.begin(), canonical.end() - 1) == expected);
    CHECK(canonical.back() == 0);
}

TEST_CASE("sizes on the wire are those of the document") {
    DatagramWriter writer(golden_header(), kDefaultDatagramBytes);
    CHECK(writer.vertices_that_fit() == 91);
    CHECK(writer.ellipsoids_that_fit() == 30);
    CHECK(kHeaderBytes + kSectionHeaderBytes + 91 * kVertexBytes + kTrailerBytes == 1198);
    const auto fit = [](std::uint8_t normal_bits, bool ring, bool colour) {
        DatagramHeader header = golden_header();
        header.hint.format = {normal_bits, ring, colour};
        return DatagramWriter(header, kDefaultDatagramBytes).vertices_that_fit();
    };
    CHECK(fit(8, false, false) == 84);
    CHECK(fit(12, false, false) == 81);
    CHECK(fit(16, false, false) == 78);
    CHECK(fit(8, true, false) == 78);
    CHECK(fit(8, false, true) == 68);
    CHECK(fit(16, true, true) == 60);
}

TEST_CASE("every cause of refusal has a name of its own") {
    std::vector<std::string_view> names;
    for (int k = 0; k < static_cast<int>(WireError::kCount); ++k) {
        names.push_back(to_string(static_cast<WireError>(k)));
    }
    for (std::size_t k = 0; k < names.size(); ++k) {
        CHECK(names[k].size() > 5);
        for (std::size_t j = 0; j < k; ++j) CHECK(names[j] != names[k]);
    }
}
