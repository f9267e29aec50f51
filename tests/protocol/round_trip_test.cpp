// tests/protocol/round_trip_test.cpp: what is written is read.
#include <catch2/catch.hpp>

#include "protocol/datagram.hpp"
#include "tests/protocol/wire_samples.hpp"

namespace {

using namespace ellicast::protocol;
using namespace ellicast::tests;
using ellicast::common::Random;

void check_same(const SectionView& read, const RandomDatagram::Section& written) {
    REQUIRE(read.kind == written.kind);
    if (written.kind == SectionKind::description) {
        CHECK(read.description() == written.description);
        return;
    }
    if (written.kind == SectionKind::page) {
        CHECK(read.page() == written.page);
        return;
    }
    if (written.kind == SectionKind::edges) {
        REQUIRE(read.count == written.edges.size());
        for (std::size_t k = 0; k < read.count; ++k) REQUIRE(read.edge(k) == written.edges[k]);
        return;
    }
    const bool ellipsoids = written.kind == SectionKind::ellipsoids;
    REQUIRE(read.count == (ellipsoids ? written.ellipsoids.size() : written.vertices.size()));
    for (std::size_t k = 0; k < read.count; ++k) {
        REQUIRE(read.index(k) == written.first + k * written.stride);
        if (ellipsoids) REQUIRE(read.ellipsoid(k) == written.ellipsoids[k]);
        if (!ellipsoids) REQUIRE(read.vertex(k) == written.vertices[k]);
    }
}

}  // namespace

TEST_CASE("any datagram that a sender may make is read as it was written") {
    for (std::uint64_t seed = 1; seed <= 3000; ++seed) {
        CAPTURE(seed);
        const RandomDatagram made = random_datagram(seed);
        REQUIRE(made.bytes.size() <= made.capacity);
        const auto view = parse_datagram(made.bytes);
        REQUIRE(view);
        REQUIRE(view->header == made.header);
        REQUIRE(view->sections().size() == made.sections.size());
        for (std::size_t k = 0; k < made.sections.size(); ++k) {
            check_same(view->sections()[k], made.sections[k]);
        }
    }
}

TEST_CASE("a writer fills its capacity and never more") {
    Random random(7);
    const DatagramHeader header = sample_header();
    for (std::size_t capacity = kMinDatagramBytes; capacity < 700; ++capacity) {
        CAPTURE(capacity);
        DatagramWriter vertices(header, capacity);
        const std::size_t most = vertices.vertices_that_fit();
        vertices.add_vertices(0, 1, random_vertices(most, header.hint, random));
        CHECK(vertices.vertices_that_fit() == 0);
        const std::size_t size = vertices.finish().size();
        CHECK((size <= capacity && size + kVertexBytes > capacity));

        DatagramWriter ellipsoids(header, capacity);
        const std::size_t fit = ellipsoids.ellipsoids_that_fit();
        ellipsoids.add_ellipsoids(0, 1, random_ellipsoids(fit, header.hint, random));
        const std::size_t bytes = ellipsoids.finish().size();
        CHECK((bytes <= capacity && bytes + kEllipsoidBytes > capacity));
    }
}

TEST_CASE("the largest datagram goes through") {
    Random random(8);
    const DatagramHeader header = sample_header();
    DatagramWriter writer(header, kMaxDatagramBytes);
    REQUIRE(writer.vertices_that_fit() == 5450);
    writer.add_vertices(3, 9, random_vertices(5450, header.hint, random));
    const Bytes bytes = writer.finish();
    const auto view = parse_datagram(bytes);
    REQUIRE(view);
    CHECK(view->sections()[0].index(5449) == 3 + 9 * 5449);
}

TEST_CASE("a writer takes as many sections as a reader and then no more") {
    Random random(9);
    const DatagramHeader header = sample_header();
    DatagramWriter writer(header, kDefaultDatagramBytes);
    for (std::size_t k = 0; k < kMaxSections; ++k) {
        REQUIRE(writer.vertices_that_fit() > 0);
        writer.add_vertices(0, 1, random_vertices(1, header.hint, random));
    }
    CHECK(writer.vertices_that_fit() == 0);
    CHECK(writer.ellipsoids_that_fit() == 0);
    CHECK_FALSE(writer.add_description(sample_description()));
    const Bytes bytes = writer.finish();
    REQUIRE(parse_datagram(bytes));
    CHECK(parse_datagram(bytes)->sections().size() == kMaxSections);
}

TEST_CASE("a description that does not fit leaves the datagram as it was") {
    Random random(10);
    const DatagramHeader header = sample_header();
    const Description large{std::string(255, 'n'), {}, std::string(255, 'u'), "", ""};
    DatagramWriter with(header, kMinDatagramBytes);
    DatagramWriter without(header, kMinDatagramBytes);
    const auto records = random_vertices(2, header.hint, random);
    CHECK_FALSE(with.add_description(large));
    with.add_vertices(0, 1, records);
    without.add_vertices(0, 1, records);
    CHECK(with.finish() == without.finish());
}

TEST_CASE("stamping changes sequence and time and nothing else") {
    const Bytes before = sample_datagram();
    Bytes after = before;
    stamp(after, 0xabcd, 0x01234567);
    const auto view = parse_datagram(after);
    REQUIRE(view);
    CHECK(view->header.rtp.sequence == 0xabcd);
    CHECK(view->header.rtp.timestamp == 0x01234567);
    for (std::size_t k = 0; k < before.size() - kTrailerBytes; ++k) {
        if (k < 2 || k >= 8) REQUIRE(after[k] == before[k]);
    }
    stamp(after, 0x1234, 0x89abcdef);
    CHECK(after == before);
}
