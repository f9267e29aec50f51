// tests/protocol/wire_samples.cpp
#include "tests/protocol/wire_samples.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <memory>
#include <string>

#include "protocol/crc32c.hpp"
#include "protocol/description.hpp"

namespace ellicast::tests {
namespace {

using namespace ellicast::protocol;

double between(double low, double high, common::Random& random) {
    return low + (high - low) * random.uniform();
}

double diagonal(const Hint& hint) {
    return std::hypot(double{hint.box_max[0]} - double{hint.box_min[0]},
                      double{hint.box_max[1]} - double{hint.box_min[1]},
                      double{hint.box_max[2]} - double{hint.box_min[2]});
}

Hint random_hint(common::Random& random) {
    Hint hint;
    const double scale = std::pow(10.0, between(-20.0, 20.0, random));
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto a = static_cast<float>(scale * between(-1.0, 1.0, random));
        const auto b = static_cast<float>(scale * between(-1.0, 1.0, random));
        hint.box_min[axis] = std::min(a, b);
        hint.box_max[axis] = random.chance(0.1) && axis > 0 ? std::min(a, b) : std::max(a, b);
    }
    hint.components = 1 + static_cast<std::uint32_t>(random.below(5));
    const int genus = static_cast<int>(random.below(4));
    hint.euler_largest = 2 - 2 * genus;
    hint.euler_all = hint.euler_largest + 2 * (static_cast<int>(hint.components) - 1);
    hint.ellipsoids = static_cast<std::uint16_t>(1 + random.below(kMaxEllipsoids));
    hint.vertices = static_cast<std::uint32_t>(1 + random.below(kMaxVertices));
    hint.format = RecordFormat::of_code(static_cast<std::uint8_t>(random.below(16)));
    hint.approximate = random.chance(0.5);
    return hint;
}

DatagramHeader random_header(common::Random& random) {
    DatagramHeader header;
    header.rtp.marker = random.chance(0.5);
    header.rtp.payload_type = static_cast<std::uint8_t>(random.below(128));
    header.rtp.sequence = static_cast<std::uint16_t>(random.next());
    header.rtp.timestamp = static_cast<std::uint32_t>(random.next());
    header.rtp.ssrc = static_cast<std::uint32_t>(random.next());
    for (auto& byte : header.session) byte = static_cast<std::uint8_t>(random.next());
    for (auto& byte : header.object) byte = static_cast<std::uint8_t>(random.next());
    header.hint = random_hint(random);
    header.round = static_cast<std::uint32_t>(random.next() >> 1);
    header.rounds = random.chance(0.5) ? 0 : header.round + 1;
    header.ordinal = static_cast<std::uint32_t>(random.below(0xffffffffu));
    header.datagrams = header.ordinal + 1;
    return header;
}

std::string random_text(common::Random& random) {
    std::string text;
    const std::size_t length = random.below(40);
    for (std::size_t k = 0; k < length; ++k) text += static_cast<char>(' ' + random.below(95));
    return text + (random.chance(0.3) ? "\u00e9\u4e2d\U0001f40e" : "");
}

PageEntry random_page(common::Random& random) {
    PageEntry entry;
    entry.pages = static_cast<std::uint16_t>(1 + random.below(0xffff));
    entry.page = static_cast<std::uint16_t>(random.below(entry.pages));
    entry.version = static_cast<std::uint32_t>(1 + random.below(0xffffffff));
    for (auto& byte : entry.object) byte = static_cast<std::uint8_t>(random.next());
    entry.components = static_cast<std::uint32_t>(1 + random.below(kMaxComponents));
    entry.euler_all = 2 - 2 * static_cast<std::int32_t>(random.below(1000));
    entry.ellipsoids = static_cast<std::uint16_t>(random.next());
    entry.vertices = static_cast<std::uint32_t>(random.below(kMaxVertices));
    entry.name = presentable(random_text(random), kMaxPageNameBytes);
    return entry;
}

/// First and stride for `count` records below `total`.
void random_place(RandomDatagram::Section& section, std::size_t count, std::size_t total,
                  common::Random& random) {
    const std::size_t stride = count > 1 ? 1 + random.below((total - 1) / (count - 1)) : 1;
    section.stride = static_cast<std::uint32_t>(stride);
    section.first = static_cast<std::uint32_t>(random.below(total - (count - 1) * stride));
}

}  // namespace

Bytes from_hex(std::string_view hex) {
    const auto digit = [](char c) {
        return static_cast<unsigned>(c <= '9' ? c - '0' : (c | 0x20) - 'a' + 10);
    };
    Bytes bytes;
    for (std::size_t k = 0; k + 1 < hex.size(); ++k) {
        if (hex[k] == ' ') continue;
        bytes.push_back(static_cast<std::uint8_t>(digit(hex[k]) << 4 | digit(hex[k + 1])));
        ++k;
    }
    return bytes;
}

DatagramHeader sample_header() {
    DatagramHeader header;
    header.rtp = {true, 97, 0x1234, 0x89abcdef, 0xfedcba98};
    header.session = {1, 2, 3, 4, 5, 6, 7, 8};
    header.object = {9, 10, 11, 12, 13, 14, 15, 16};
    header.hint.box_min = {-1.0f, -2.0f, -0.5f};
    header.hint.box_max = {1.0f, 2.0f, 4.0f};
    header.hint.components = 2;
    header.hint.euler_all = -2;
    header.hint.euler_largest = -4;
    header.hint.ellipsoids = 400;
    header.hint.vertices = 50'000;
    header.hint.approximate = true;
    header.round = 1;
    header.rounds = 4;
    header.ordinal = 17;
    header.datagrams = 640;
    return header;
}

DatagramHeader sample_header(const RecordFormat& format) {
    DatagramHeader header = sample_header();
    header.hint.format = format;
    return header;
}

Description sample_description() {
    return {"caf\u00e9 horse", {1e6, -2.5, 0.0}, "mm", "seeded 0.3:0.95", "0.1.0"};
}

VertexRecord random_vertex(const Hint& hint, common::Random& random) {
    VertexRecord record;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto x = static_cast<float>(between(hint.box_min[axis], hint.box_max[axis], random));
        record.position[axis] = std::clamp(x, hint.box_min[axis], hint.box_max[axis]);
    }
    const auto any = [&](std::size_t bits) { return random.below(std::size_t{1} << bits); };
    if (hint.format.normal_bits > 0) {
        record.normal = static_cast<std::uint16_t>(any(hint.format.normal_bits));
    }
    if (hint.format.ring) record.ring = static_cast<std::uint16_t>(any(RecordFormat::kRingBits));
    if (hint.format.colour) {
        for (std::uint8_t& channel : record.colour) channel = static_cast<std::uint8_t>(any(8));
    }
    return record;
}

EllipsoidRecord random_ellipsoid(const Hint& hint, common::Random& random) {
    const VertexRecord center = random_vertex(hint, random);
    EllipsoidRecord record;
    std::copy(center.position.begin(), center.position.end(), record.scalars.begin());
    const double size = diagonal(hint) * std::pow(10.0, between(-3.0, -0.5, random));
    for (const std::size_t k : {3u, 5u, 8u}) {
        record.scalars[k] = static_cast<float>(size * between(0.1, 1.0, random));
    }
    for (const std::size_t k : {4u, 6u, 7u}) {
        record.scalars[k] = static_cast<float>(size * between(-0.5, 0.5, random));
    }
    return record;
}

std::vector<VertexRecord> random_vertices(std::size_t count, const Hint& hint,
                                          common::Random& random) {
    std::vector<VertexRecord> records(count);
    for (VertexRecord& record : records) record = random_vertex(hint, random);
    return records;
}

std::vector<EllipsoidRecord> random_ellipsoids(std::size_t count, const Hint& hint,
                                               common::Random& random) {
    std::vector<EllipsoidRecord> records(count);
    for (EllipsoidRecord& record : records) record = random_ellipsoid(hint, random);
    return records;
}

std::vector<EdgeRecord> random_edges(std::size_t count, const Hint& hint, common::Random& random) {
    const auto below = [&](std::uint32_t limit) {
        return static_cast<std::uint32_t>(random.below(limit));
    };
    std::vector<EdgeRecord> edges(count);
    const std::uint32_t among = 2 + below(hint.vertices - 1);
    for (EdgeRecord& edge : edges) {
        edge.among = among;
        edge.b = 1 + below(among - 1);
        edge.a = below(edge.b);
    }
    return edges;
}

Bytes sample_datagram(std::uint64_t seed) {
    common::Random random(seed);
    const DatagramHeader header = sample_header();
    DatagramWriter writer(header, kDefaultDatagramBytes);
    (void)writer.add_description(sample_description());
    writer.add_ellipsoids(5, 17, random_ellipsoids(10, header.hint, random));
    writer.add_vertices(11, 523, random_vertices(writer.vertices_that_fit(), header.hint, random));
    return writer.finish();
}

RandomDatagram random_datagram(std::uint64_t seed) {
    common::Random random(seed);
    RandomDatagram made;
    made.header = random_header(random);
    made.capacity = kMinDatagramBytes + random.below(random.chance(0.1) ? 60'000 : 1'000);
    DatagramWriter writer(made.header, made.capacity);
    const std::size_t wanted = 1 + random.below(kMaxSections);
    for (std::size_t k = 0; k < wanted; ++k) {
        RandomDatagram::Section section;
        const Hint& hint = made.header.hint;
        const std::size_t ellipsoids =
            std::min<std::size_t>(writer.ellipsoids_that_fit(), hint.ellipsoids);
        const std::size_t vertices =
            std::min<std::size_t>(writer.vertices_that_fit(), hint.vertices);
        section.kind = static_cast<SectionKind>(1 + random.below(5));
        if (section.kind == SectionKind::ellipsoids && ellipsoids > 0) {
            const std::size_t count = 1 + random.below(ellipsoids);
            section.ellipsoids = random_ellipsoids(count, hint, random);
            random_place(section, count, hint.ellipsoids, random);
            writer.add_ellipsoids(section.first, section.stride, section.ellipsoids);
        } else if (section.kind == SectionKind::vertices && vertices > 0) {
            const std::size_t count = 1 + random.below(vertices);
            section.vertices = random_vertices(count, hint, random);
            random_place(section, count, hint.vertices, random);
            writer.add_vertices(section.first, section.stride, section.vertices);
        } else if (section.kind == SectionKind::edges && hint.vertices > 1 &&
                   writer.edges_that_fit() > 0) {
            section.edges = random_edges(1 + random.below(writer.edges_that_fit()), hint, random);
            writer.add_edges(section.edges);
        } else if (section.kind == SectionKind::page) {
            section.page = random_page(random);
            if (!writer.add_page(section.page)) continue;
        } else {
            section.kind = SectionKind::description;
            section.description = {random_text(random),
                                   {random.uniform(), -1e9 * random.uniform(), 0.0},
                                   random_text(random),
                                   random_text(random),
                                   random_text(random)};
            if (!writer.add_description(section.description)) continue;
        }
        made.sections.push_back(section);
    }
    made.bytes = writer.finish();
    return made;
}

void fix_checksum(Bytes& datagram) {
    if (datagram.size() < kTrailerBytes) return;
    datagram.resize(datagram.size() - kTrailerBytes);
    put_u32(datagram, crc32c(datagram));
}

Bytes datagram_with(std::span<const std::uint8_t> sections, const DatagramHeader& header) {
    common::Random random(1);
    DatagramWriter writer(header, kDefaultDatagramBytes);
    writer.add_vertices(0, 1, random_vertices(1, header.hint, random));
    Bytes bytes = writer.finish();
    bytes.resize(kHeaderBytes);
    bytes.insert(bytes.end(), sections.begin(), sections.end());
    bytes.resize(bytes.size() + kTrailerBytes);
    fix_checksum(bytes);
    return bytes;
}

void put_u8(Bytes& bytes, std::uint8_t value) {
    bytes.push_back(value);
}
void put_u16(Bytes& bytes, std::uint16_t value) {
    put_u8(bytes, static_cast<std::uint8_t>(value >> 8));
    put_u8(bytes, static_cast<std::uint8_t>(value));
}
void put_u32(Bytes& bytes, std::uint32_t value) {
    put_u16(bytes, static_cast<std::uint16_t>(value >> 16));
    put_u16(bytes, static_cast<std::uint16_t>(value));
}
void put_f32(Bytes& bytes, float value) {
    put_u32(bytes, std::bit_cast<std::uint32_t>(value));
}
void put_f64(Bytes& bytes, double value) {
    const auto bits = std::bit_cast<std::uint64_t>(value);
    put_u32(bytes, static_cast<std::uint32_t>(bits >> 32));
    put_u32(bytes, static_cast<std::uint32_t>(bits));
}

std::optional<WireError> refusal_of(std::span<const std::uint8_t> bytes) {
    const auto exact = std::make_unique<std::uint8_t[]>(bytes.size());
    std::copy(bytes.begin(), bytes.end(), exact.get());
    const auto view = parse_datagram({exact.get(), bytes.size()});
    if (view) return std::nullopt;
    return view.error();
}

}  // namespace ellicast::tests
