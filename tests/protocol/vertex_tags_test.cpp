// tests/protocol/vertex_tags_test.cpp: sections of vertices in every record format.
#include <catch2/catch.hpp>
#include <set>

#include "protocol/datagram.hpp"
#include "tests/protocol/wire_samples.hpp"

namespace {

using namespace ellicast::protocol;
using namespace ellicast::tests;
using ellicast::common::Random;

constexpr std::uint8_t kFormats = 16;

/// A vertex's bits, twice those of each of its tags' bytes.
std::size_t bits_of(const RecordFormat& format) {
    return 96 + format.normal_bits + (format.ring ? 8 : 0) + (format.colour ? 24 : 0);
}

std::size_t body_bytes(const RecordFormat& format, std::size_t count) {
    const std::size_t stream = count * (format.normal_bits + (format.ring ? 8u : 0u));
    return 12 * count + stream / 8 + (stream % 8 != 0 ? 1 : 0) + (format.colour ? 3 * count : 0);
}

Bytes datagram_of(const RecordFormat& format, const std::vector<VertexRecord>& records) {
    DatagramWriter writer(sample_header(format), kMaxDatagramBytes);
    writer.add_vertices(3, 2, records);
    return writer.finish();
}

}  // namespace

TEST_CASE("the codes 0 to 15 stand for sixteen formats and come back") {
    std::set<std::array<int, 3>> seen;
    for (std::uint8_t code = 0; code < kFormats; ++code) {
        const RecordFormat format = RecordFormat::of_code(code);
        REQUIRE(format.is_known());
        CHECK(format.code() == code);
        seen.insert({format.normal_bits, format.ring ? 1 : 0, format.colour ? 1 : 0});
    }
    CHECK(seen.size() == kFormats);
    CHECK(RecordFormat{}.code() == 0);
    CHECK((RecordFormat::of_code(1) == RecordFormat{8, false, false}));
    CHECK((RecordFormat::of_code(2) == RecordFormat{12, false, false}));
    CHECK((RecordFormat::of_code(3) == RecordFormat{16, false, false}));
    CHECK((RecordFormat::of_code(4) == RecordFormat{0, true, false}));
    CHECK((RecordFormat::of_code(8) == RecordFormat{0, false, true}));
}

TEST_CASE("every format goes through at every count, in the bytes that the document says") {
    Random random(11);
    for (std::uint8_t code = 0; code < kFormats; ++code) {
        const RecordFormat format = RecordFormat::of_code(code);
        for (std::size_t count = 1; count <= 70; ++count) {
            CAPTURE(int{code}, count);
            const auto records = random_vertices(count, sample_header(format).hint, random);
            const Bytes bytes = datagram_of(format, records);
            REQUIRE(bytes.size() == 93 + 13 + body_bytes(format, count));
            const auto view = parse_datagram(bytes);
            REQUIRE(view);
            REQUIRE(view->sections()[0].count == count);
            for (std::size_t k = 0; k < count; ++k) {
                REQUIRE(view->sections()[0].vertex(k) == records[k]);
            }
        }
    }
}

TEST_CASE("a section of one byte too few or too many is a bad section, in every format") {
    Random random(12);
    for (std::uint8_t code = 0; code < kFormats; ++code) {
        const RecordFormat format = RecordFormat::of_code(code);
        for (const std::size_t count : {1u, 2u, 3u, 8u, 9u}) {
            CAPTURE(int{code}, count);
            const auto records = random_vertices(count, sample_header(format).hint, random);
            const Bytes whole = datagram_of(format, records);
            const Bytes section(whole.begin() + kHeaderBytes, whole.end() - kTrailerBytes);
            for (std::size_t size = 3; size <= section.size() + 2; ++size) {
                Bytes other = section;
                other.resize(size);  // with zeros
                other[1] = static_cast<std::uint8_t>((size - 3) >> 8);
                other[2] = static_cast<std::uint8_t>(size - 3);
                const auto fault = refusal_of(datagram_with(other, sample_header(format)));
                REQUIRE(fault.has_value() == (size != section.size()));
                if (fault) REQUIRE(fault == WireError::bad_section);
            }
        }
    }
}

TEST_CASE("bits that fill up the tags must be zero") {
    Random random(13);
    for (std::uint8_t code = 0; code < kFormats; ++code) {
        const RecordFormat format = RecordFormat::of_code(code);
        for (std::size_t count = 1; count <= 4; ++count) {
            CAPTURE(int{code}, count);
            const auto records = random_vertices(count, sample_header(format).hint, random);
            const Bytes good = datagram_of(format, records);
            const std::size_t used = bits_of(format) * count - (format.colour ? 24 * count : 0);
            const std::size_t tags_end = kHeaderBytes + kSectionHeaderBytes + used / 8;
            for (std::size_t bit = 0; bit < 8; ++bit) {
                if (used % 8 == 0) break;  // the next byte is no tag's
                Bytes bytes = good;
                bytes[tags_end] = static_cast<std::uint8_t>(bytes[tags_end] ^ (0x80 >> bit));
                fix_checksum(bytes);
                const bool fills = bit >= used % 8;
                REQUIRE(refusal_of(bytes).has_value() == fills);
                if (fills) REQUIRE(refusal_of(bytes) == WireError::bad_section);
            }
        }
    }
}

TEST_CASE("what does not decide cannot be refused: all tags are good") {
    Random random(14);
    for (std::uint8_t code = 1; code < kFormats; ++code) {
        const RecordFormat format = RecordFormat::of_code(code);
        const auto records = random_vertices(8, sample_header(format).hint, random);
        Bytes bytes = datagram_of(format, records);
        for (std::size_t at = 89 + 13 + 8 * 12; at + 4 < bytes.size(); ++at) bytes[at] = 0xff;
        fix_checksum(bytes);
        const auto view = parse_datagram(bytes);
        REQUIRE(view);
        const VertexRecord vertex = view->sections()[0].vertex(7);
        CHECK(vertex.normal == (1u << format.normal_bits) - 1);
        CHECK(vertex.ring == (format.ring ? 0xff : 0));
        CHECK(vertex.colour[2] == (format.colour ? 0xff : 0));
        CHECK(vertex.unused == 0);
    }
}

TEST_CASE("a vertex outside the box is a bad record in every format, wherever it stands") {
    Random random(15);
    for (std::uint8_t code = 0; code < kFormats; ++code) {
        const RecordFormat format = RecordFormat::of_code(code);
        for (const std::size_t at : {0u, 7u, 16u}) {
            auto records = random_vertices(17, sample_header(format).hint, random);
            records[at].position[1] = 2.0001f;
            CHECK(refusal_of(datagram_of(format, records)) == WireError::bad_record);
        }
    }
}

TEST_CASE("a writer of tagged vertices fills its capacity and never more") {
    Random random(16);
    for (std::uint8_t code = 0; code < kFormats; ++code) {
        const RecordFormat format = RecordFormat::of_code(code);
        for (std::size_t capacity = kMinDatagramBytes; capacity < 640; ++capacity) {
            CAPTURE(int{code}, capacity);
            DatagramWriter writer(sample_header(format), capacity);
            const std::size_t most = writer.vertices_that_fit();
            CHECK(most == format.vertices_within(capacity - 93 - 13));
            const std::size_t first = random.below(most);
            if (first > 0) {
                writer.add_vertices(0, 1,
                                    random_vertices(first, sample_header(format).hint, random));
            }
            const std::size_t rest = writer.vertices_that_fit();
            if (rest > 0) {
                writer.add_vertices(0, 1,
                                    random_vertices(rest, sample_header(format).hint, random));
            }
            const std::size_t size = writer.finish().size();
            CHECK(size <= capacity);
            CHECK(body_bytes(format, most) + 106 <= capacity);
            CHECK(body_bytes(format, most + 1) + 106 > capacity);
        }
    }
}

TEST_CASE("a writer leaves out what the format does not have, and bits that it has no room for") {
    VertexRecord full{{0.5f, 0.5f, 0.5f}, 0xffff, 0xffff, {1, 2, 3}};
    for (std::uint8_t code = 0; code < kFormats; ++code) {
        const RecordFormat format = RecordFormat::of_code(code);
        const Bytes bytes = datagram_of(format, {full, full});
        const auto view = parse_datagram(bytes);
        REQUIRE(view);
        for (const std::size_t k : {0u, 1u}) {
            const VertexRecord read = view->sections()[0].vertex(k);
            CHECK(read.position == full.position);
            CHECK(read.normal == (1u << format.normal_bits) - 1);
            CHECK(read.ring == (format.ring ? 0xff : 0));
            CHECK((read.colour[0] == 1) == format.colour);
        }
    }
}
