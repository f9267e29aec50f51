// tests/protocol/section_test.cpp: sections and records made by hand, good and bad.
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "protocol/datagram.hpp"
#include "tests/protocol/wire_samples.hpp"

namespace {

using namespace ellicast::protocol;
using namespace ellicast::tests;
using ellicast::common::Random;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr std::uint8_t kEllipsoids = 1;
constexpr std::uint8_t kVertices = 2;
using Fault = std::optional<WireError>;

/// A section of `count` good vertices, all at the box's middle.
Bytes vertices_section(std::uint32_t first, std::uint32_t stride, std::uint16_t count) {
    Bytes section;
    put_u8(section, kVertices);
    put_u16(section, static_cast<std::uint16_t>(10 + 12 * count));
    put_u16(section, count);
    put_u32(section, first);
    put_u32(section, stride);
    for (int k = 0; k < 3 * count; ++k) put_f32(section, 0.5f);
    return section;
}

Bytes unknown_section(std::uint8_t kind, std::size_t length) {
    Bytes section;
    put_u8(section, kind);
    put_u16(section, static_cast<std::uint16_t>(length));
    section.resize(section.size() + length, 0xee);
    return section;
}

Fault with_section(const Bytes& section) {
    return refusal_of(datagram_with(section));
}

Fault with_ellipsoid(const EllipsoidRecord& record) {
    DatagramWriter writer(sample_header(), kMinDatagramBytes);
    writer.add_ellipsoids(0, 1, std::vector{record});
    const Fault fault = refusal_of(writer.finish());
    // The sender's own question must have the same answer.
    CHECK(acceptable(record, sample_header().hint) == !fault.has_value());
    return fault;
}

/// `bad` at place k among `count` vertices.
Fault with_vertex(const VertexRecord& bad, std::size_t k, std::size_t count) {
    Random random(3);
    auto records = random_vertices(count, sample_header().hint, random);
    records[k] = bad;
    DatagramWriter writer(sample_header(), kMinDatagramBytes);
    writer.add_vertices(0, 1, records);
    return refusal_of(writer.finish());
}

double sample_diagonal() {
    return std::sqrt(4.0 + 16.0 + 20.25);
}

EllipsoidRecord sphere(double r) {
    const auto x = static_cast<float>(r);
    return {{0.0f, 0.0f, 1.0f, x, 0.0f, x, 0.0f, 0.0f, x}};
}

}  // namespace

TEST_CASE("sections of unknown kinds are skipped by their length") {
    for (const int kind : {0, 6, 77, 255}) {
        Bytes sections = unknown_section(static_cast<std::uint8_t>(kind), 33);
        const Bytes vertices = vertices_section(4, 2, 3);
        sections.insert(sections.end(), vertices.begin(), vertices.end());
        const Bytes tail = unknown_section(static_cast<std::uint8_t>(kind), 0);
        sections.insert(sections.end(), tail.begin(), tail.end());
        const Bytes bytes = datagram_with(sections);
        const auto view = parse_datagram(bytes);
        REQUIRE(view);
        REQUIRE(view->sections().size() == 1);
        CHECK(view->sections()[0].kind == SectionKind::vertices);
        CHECK(view->sections()[0].index(2) == 8);
    }
}

TEST_CASE("a datagram of unknown kinds alone is accepted and empty") {
    const Bytes bytes = datagram_with(unknown_section(9, 5));
    const auto view = parse_datagram(bytes);
    REQUIRE(view);
    CHECK(view->sections().empty());
}

TEST_CASE("a datagram without sections, or with more than the limit, is a bad section") {
    CHECK(with_section({}) == WireError::bad_section);
    Bytes many;
    for (std::size_t k = 0; k < kMaxSections; ++k) {
        const Bytes one = k % 2 == 0 ? unknown_section(200, 1) : vertices_section(0, 1, 1);
        many.insert(many.end(), one.begin(), one.end());
    }
    CHECK_FALSE(with_section(many));
    const Bytes last = unknown_section(200, 0);
    many.insert(many.end(), last.begin(), last.end());
    CHECK(with_section(many) == WireError::bad_section);
}

TEST_CASE("a section whose length and count disagree is a bad section") {
    for (int wrong = 0; wrong < 256; ++wrong) {
        Bytes section = vertices_section(0, 1, 3);
        section[2] = static_cast<std::uint8_t>(wrong);  // length, low byte
        CHECK(with_section(section) == (wrong == 46 ? Fault{} : Fault{WireError::bad_section}));
        section = vertices_section(0, 1, 3);
        section[4] = static_cast<std::uint8_t>(wrong);  // count, low byte
        CHECK(with_section(section) == (wrong == 3 ? Fault{} : Fault{WireError::bad_section}));
    }
    Bytes long_by_far = vertices_section(0, 1, 3);
    long_by_far[1] = 0xff;
    CHECK(with_section(long_by_far) == WireError::bad_section);
}

TEST_CASE("a section of no record is a bad section") {
    CHECK(with_section(vertices_section(0, 1, 0)) == WireError::bad_section);
}

TEST_CASE("an index at the hinted count is out of range, one below is not") {
    CHECK_FALSE(with_section(vertices_section(49'999, 1, 1)));
    CHECK(with_section(vertices_section(50'000, 1, 1)) == WireError::index_out_of_range);
    CHECK_FALSE(with_section(vertices_section(49'985, 7, 3)));
    CHECK(with_section(vertices_section(49'986, 7, 3)) == WireError::index_out_of_range);
    CHECK_FALSE(with_section(vertices_section(0, 0xffffffffu, 1)));  // a stride nobody takes
}

TEST_CASE("indices that overflow 32 bits are out of range") {
    CHECK(with_section(vertices_section(0xffffffffu, 1, 2)) == WireError::index_out_of_range);
    CHECK(with_section(vertices_section(0, 0x80000000u, 3)) == WireError::index_out_of_range);
    CHECK(with_section(vertices_section(1, 0xffffffffu, 2)) == WireError::index_out_of_range);
    CHECK(with_section(vertices_section(0xffffffffu, 0xffffffffu, 80)) ==
          WireError::index_out_of_range);
}

TEST_CASE("a stride of nothing is out of range, also for one record") {
    CHECK(with_section(vertices_section(0, 0, 1)) == WireError::index_out_of_range);
    CHECK(with_section(vertices_section(0, 0, 5)) == WireError::index_out_of_range);
}

TEST_CASE("indices are held against the count of their own kind") {
    Random random(4);
    DatagramWriter writer(sample_header(), kMinDatagramBytes);
    writer.add_ellipsoids(400, 1, random_ellipsoids(1, sample_header().hint, random));
    CHECK(refusal_of(writer.finish()) == WireError::index_out_of_range);
}

TEST_CASE("a vertex outside the box or not finite is a bad record at any place") {
    const Hint hint = sample_header().hint;
    for (std::size_t count = 1; count <= 13; ++count) {
        for (std::size_t k = 0; k < count; ++k) {
            for (std::size_t axis = 0; axis < 3; ++axis) {
                const float below = std::nextafter(hint.box_min[axis], -kInfinity);
                const float above = std::nextafter(hint.box_max[axis], kInfinity);
                for (const float bad : {kNan, -kNan, kInfinity, -kInfinity, below, above}) {
                    CAPTURE(count, k, axis, bad);
                    VertexRecord record{{0.0f, 0.0f, 0.0f}};
                    record.position[axis] = bad;
                    CHECK_FALSE(acceptable(record, hint));
                    REQUIRE(with_vertex(record, k, count) == WireError::bad_record);
                }
            }
        }
    }
}

TEST_CASE("a vertex on the box is accepted") {
    const Hint hint = sample_header().hint;
    for (const VertexRecord& corner : {VertexRecord{hint.box_min}, VertexRecord{hint.box_max}}) {
        CHECK(acceptable(corner, hint));
        for (std::size_t k = 0; k < 5; ++k) CHECK_FALSE(with_vertex(corner, k, 5));
    }
}

TEST_CASE("an ellipsoid with any number that is not finite is a bad record") {
    for (std::size_t k = 0; k < 9; ++k) {
        for (const float bad : {kNan, kInfinity, -kInfinity, 3e38f, -3e38f}) {
            CAPTURE(k, bad);
            EllipsoidRecord record = sphere(0.1);
            record.scalars[k] = bad;
            CHECK(with_ellipsoid(record) == WireError::bad_record);
        }
    }
}

TEST_CASE("a diagonal of L that is not positive is a bad record") {
    for (const std::size_t k : {3u, 5u, 8u}) {
        for (const float bad : {0.0f, -0.0f, -0.1f, 1e-45f}) {
            EllipsoidRecord record = sphere(0.1);
            record.scalars[k] = bad;
            CHECK(with_ellipsoid(record) == WireError::bad_record);
        }
    }
}

TEST_CASE("a centre may stand 5 % of the diagonal outside the box and no more") {
    const Hint hint = sample_header().hint;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const double slack = 0.05 * sample_diagonal();
        EllipsoidRecord record = sphere(0.1);
        record.scalars[axis] = static_cast<float>(double{hint.box_max[axis]} + 0.999 * slack);
        CHECK_FALSE(with_ellipsoid(record));
        record.scalars[axis] = static_cast<float>(double{hint.box_max[axis]} + 1.001 * slack);
        CHECK(with_ellipsoid(record) == WireError::bad_record);
        record.scalars[axis] = static_cast<float>(double{hint.box_min[axis]} - 0.999 * slack);
        CHECK_FALSE(with_ellipsoid(record));
        record.scalars[axis] = static_cast<float>(double{hint.box_min[axis]} - 1.001 * slack);
        CHECK(with_ellipsoid(record) == WireError::bad_record);
    }
}

TEST_CASE(
    "radii from a millionth of the diagonal to the diagonal are accepted, beyond sqrt 3 refused") {
    const double D = sample_diagonal();
    CHECK_FALSE(with_ellipsoid(sphere(D)));
    CHECK_FALSE(with_ellipsoid(sphere(1e-6 * D)));
    CHECK(with_ellipsoid(sphere(1.0001 * D)) == WireError::bad_record);
    CHECK(with_ellipsoid(sphere(0.9999e-6 * D)) == WireError::bad_record);
    const auto flat = [&](double a, double b, double c) {
        return EllipsoidRecord{{0.0f, 0.0f, 1.0f, static_cast<float>(a * D), 0.0f,
                                static_cast<float>(b * D), 0.0f, 0.0f, static_cast<float>(c * D)}};
    };
    CHECK_FALSE(with_ellipsoid(flat(1.0, 1.0, 1e-6)));
    CHECK_FALSE(with_ellipsoid(flat(1e-6, 1e-6, 1.0)));
    CHECK(with_ellipsoid(flat(1.74, 1e-2, 1e-2)) == WireError::bad_record);
    CHECK(with_ellipsoid(flat(1.0, 1.0, 0.57e-6)) == WireError::bad_record);
}

TEST_CASE("a sheared L with a radius far below its diagonal is a bad record") {
    // Every number alone looks harmless; det L = 1e-10 leaves a least radius of about 1e-9
    // diagonals.
    const auto x = static_cast<float>(0.5 * sample_diagonal());
    const float tiny = x * 1e-3f;
    CHECK(with_ellipsoid({{0, 0, 1, tiny, x, tiny, x, x, tiny}}) == WireError::bad_record);
}

TEST_CASE("an index behind the parser is the index that was checked") {
    const Bytes bytes = datagram_with(vertices_section(2, 24'998, 3));
    const auto view = parse_datagram(bytes);
    REQUIRE(view);
    CHECK(view->sections()[0].index(2) == 49'998);
}
