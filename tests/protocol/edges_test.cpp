// tests/protocol/edges_test.cpp: sections of edges, good and bad.
#include <catch2/catch.hpp>

#include "protocol/datagram.hpp"
#include "protocol/section_filter.hpp"
#include "tests/protocol/golden_datagram.hpp"
#include "tests/protocol/wire_samples.hpp"

namespace {

using namespace ellicast::protocol;
using namespace ellicast::tests;
using Fault = std::optional<WireError>;

constexpr std::uint32_t kVertices = 50'000;  // of the sample

/// One edge, between vertices below `among`.
Fault with_edge(std::uint32_t among, std::uint32_t a, std::uint32_t b) {
    Bytes section;
    put_u8(section, 5);
    put_u16(section, 14);
    put_u16(section, 1);
    for (const std::uint32_t value : {among, a, b}) put_u32(section, value);
    return refusal_of(datagram_with(section));
}

/// As many bytes of edges as the length says, whatever the count.
Fault with_count(std::uint16_t length, std::uint16_t count) {
    Bytes section;
    put_u8(section, 5);
    put_u16(section, length);
    put_u16(section, count);
    put_u32(section, kVertices);
    for (std::uint32_t k = 0; 11 + 8 * k <= length + 3u; ++k) {
        put_u32(section, k);
        put_u32(section, k + 1);
    }
    section.resize(length + 3u);
    return refusal_of(datagram_with(section));
}

}  // namespace

TEST_CASE("edges have the golden bytes") {
    const std::vector<EdgeRecord> edges{{24243, 7, 1028}, {24243, 0, 24242}};
    DatagramWriter writer(golden_header(), kMinDatagramBytes);
    writer.add_edges(edges);
    const Bytes bytes = writer.finish();
    const Bytes section(bytes.begin() + kHeaderBytes, bytes.end() - kTrailerBytes);
    CHECK(section == from_hex(kGoldenEdgesHex));
    const auto view = parse_datagram(bytes);
    REQUIRE(view);
    REQUIRE(view->sections().size() == 1);
    REQUIRE(view->sections()[0].kind == SectionKind::edges);
    REQUIRE(view->sections()[0].count == 2);
    CHECK(view->sections()[0].edge(0) == edges[0]);
    CHECK(view->sections()[0].edge(1) == edges[1]);
}

TEST_CASE("the ends of an edge ascend and lie among those that the section is about") {
    CHECK_FALSE(with_edge(kVertices, 0, kVertices - 1));
    CHECK_FALSE(with_edge(2, 0, 1));
    CHECK(with_edge(kVertices + 1, 0, 1) == WireError::index_out_of_range);
    CHECK(with_edge(kVertices, 0, kVertices) == WireError::index_out_of_range);
    CHECK(with_edge(100, 0, 100) == WireError::index_out_of_range);
    CHECK(with_edge(100, 7, 7) == WireError::index_out_of_range);
    CHECK(with_edge(100, 8, 7) == WireError::index_out_of_range);
    CHECK(with_edge(0, 0, 0) == WireError::index_out_of_range);
    CHECK(with_edge(0xffffffffu, 0xfffffffdu, 0xfffffffeu) == WireError::index_out_of_range);
}

TEST_CASE("edges whose length and count disagree are a bad section") {
    for (std::uint16_t length = 0; length < 60; ++length) {
        for (std::uint16_t count = 0; count < 9; ++count) {
            CAPTURE(length, count);
            const bool good = count > 0 && length == 6 + 8 * count;
            REQUIRE(with_count(length, count) == (good ? Fault{} : Fault{WireError::bad_section}));
        }
    }
    CHECK(with_count(6 + 8 * 9, 0xffff) == WireError::bad_section);
}

TEST_CASE("a writer takes as many edges as fit and then no more") {
    ellicast::common::Random random(5);
    for (std::size_t capacity = kMinDatagramBytes; capacity < 620; ++capacity) {
        CAPTURE(capacity);
        DatagramWriter writer(sample_header(), capacity);
        const std::size_t most = writer.edges_that_fit();
        writer.add_edges(random_edges(most, sample_header().hint, random));
        CHECK(writer.edges_that_fit() == 0);
        const std::size_t size = writer.finish().size();
        CHECK((size <= capacity && size + kEdgeBytes + kEdgeSectionBytes > capacity));
    }
}
