// tests/support/datagrams.cpp
#include "tests/support/datagrams.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "common/object_id.hpp"
#include "common/random.hpp"
#include "protocol/object_table.hpp"

namespace ellicast::tests {
namespace {

using protocol::DatagramWriter;
using protocol::EllipsoidRecord;
using protocol::VertexRecord;

std::vector<VertexRecord> sphere_points(std::uint32_t count) {
    std::vector<VertexRecord> points;
    const double golden = std::numbers::pi * (3.0 - std::sqrt(5.0));
    for (std::uint32_t k = 0; k < count; ++k) {
        const double z = 1.0 - (2.0 * k + 1.0) / count;
        const double r = std::sqrt(1.0 - z * z);
        points.push_back({{static_cast<float>(r * std::cos(golden * k)),
                           static_cast<float>(r * std::sin(golden * k)), static_cast<float>(z)}});
    }
    return points;
}

EllipsoidRecord nearly_the_sphere(common::Random& random) {
    const auto jitter = [&] { return static_cast<float>(0.02 * (random.uniform() - 0.5)); };
    const auto radius = [&] { return 0.96f + jitter(); };
    return {
        {jitter(), jitter(), jitter(), radius(), jitter(), radius(), jitter(), jitter(), radius()}};
}

// What one datagram holds: ellipsoids or vertices first, first + stride, ...
struct Part {
    bool ellipsoids = false;
    std::uint32_t first = 0;
    std::uint32_t stride = 1;
    std::uint32_t count = 0;
};

// Part d of `parts` holds d, d + parts, d + 2 parts, ... below `total`.
void add_strided(std::vector<Part>& plan, bool ellipsoids, std::uint32_t total,
                 std::size_t per_datagram) {
    if (total == 0) return;
    const auto parts = static_cast<std::uint32_t>((total + per_datagram - 1) / per_datagram);
    for (std::uint32_t d = 0; d < parts; ++d) {
        plan.push_back({ellipsoids, d, parts, (total - d + parts - 1) / parts});
    }
}

template <class Record>
std::vector<Record> pick(const std::vector<Record>& records, const Part& part) {
    std::vector<Record> picked;
    for (std::uint32_t k = 0; k < part.count; ++k) {
        picked.push_back(records[part.first + k * part.stride]);
    }
    return picked;
}

Datagram write_part(const MadeObject& object, const Part& part,
                    const protocol::DatagramHeader& header, std::size_t bytes, bool describe) {
    DatagramWriter writer(header, bytes);
    if (describe && !writer.add_description(object.description)) {
        throw std::logic_error("description does not fit");
    }
    if (part.ellipsoids) {
        writer.add_ellipsoids(part.first, part.stride, pick(object.ellipsoids, part));
    } else {
        writer.add_vertices(part.first, part.stride, pick(object.vertices, part));
    }
    return writer.finish();
}

}  // namespace

MadeObject made_sphere(std::uint32_t vertices, std::uint16_t ellipsoids, std::uint64_t seed) {
    MadeObject object;
    common::Random random(seed);
    object.vertices = sphere_points(vertices);
    common::shuffle(object.vertices, random);
    for (std::uint16_t k = 0; k < ellipsoids; ++k) {
        object.ellipsoids.push_back(nearly_the_sphere(random));
    }
    object.hint.box_min = {-1, -1, -1};
    object.hint.box_max = {1, 1, 1};
    object.hint.ellipsoids = ellipsoids;
    object.hint.vertices = vertices;
    object.description.name = "made-sphere";
    object.description.unit = "mm";
    object.description.sender_version = "test";
    identify(object);
    return object;
}

void add_tags(MadeObject& object, const protocol::RecordFormat& format, std::uint64_t seed) {
    common::Random random(seed);
    object.hint.format = format;
    for (VertexRecord& vertex : object.vertices) {
        const auto bits = static_cast<std::uint32_t>(random.next());
        vertex.normal = static_cast<std::uint16_t>(bits & ((1u << format.normal_bits) - 1));
        vertex.ring = static_cast<std::uint16_t>(format.ring ? bits >> 16 & 0xff : 0);
        for (std::uint8_t& channel : vertex.colour) {
            channel = static_cast<std::uint8_t>(format.colour ? random.next() : 0);
        }
    }
    identify(object);
}

void identify(MadeObject& object) {
    object.id =
        protocol::object_id_of<common::Digest>(object.hint, object.ellipsoids, object.vertices);
}

protocol::DatagramHeader made_header(const MadeObject& object, const MadeStream& stream) {
    protocol::DatagramHeader header;
    header.rtp.sequence = stream.first_sequence;
    header.rtp.timestamp = stream.first_timestamp;
    header.rtp.ssrc = stream.ssrc;
    header.session = stream.session;
    header.object = object.id;
    header.hint = object.hint;
    header.rounds = stream.rounds;
    return header;
}

std::vector<Datagram> made_datagrams(const MadeObject& object, const MadeStream& stream,
                                     std::uint32_t rounds) {
    // Room for the description is left in every datagram; simple, and exact fits are the codec's
    // tests.
    const std::size_t room =
        stream.datagram_bytes - protocol::kHeaderBytes - protocol::kTrailerBytes - 128;
    std::vector<Part> plan;
    add_strided(plan, true, object.hint.ellipsoids, room / protocol::kEllipsoidBytes);
    add_strided(plan, false, object.hint.vertices, object.hint.format.vertices_within(room));

    protocol::DatagramHeader header = made_header(object, stream);
    header.datagrams = static_cast<std::uint32_t>(plan.size());
    if (stream.rounds != 0) rounds = stream.rounds;
    std::vector<Datagram> datagrams;
    for (header.round = 0; header.round < rounds; ++header.round) {
        for (header.ordinal = 0; header.ordinal < header.datagrams; ++header.ordinal) {
            const bool describe = stream.describe && header.ordinal % 8 == 0;
            header.rtp.marker = header.ordinal + 1 == header.datagrams;
            datagrams.push_back(
                write_part(object, plan[header.ordinal], header, stream.datagram_bytes, describe));
            ++header.rtp.sequence;
            header.rtp.timestamp += stream.timestamp_step;
        }
    }
    return datagrams;
}

Datagram made_datagram(const protocol::DatagramHeader& header, std::uint32_t first,
                       const std::vector<VertexRecord>& vertices) {
    DatagramWriter writer(header, protocol::kMaxDatagramBytes);
    writer.add_vertices(first, 1, vertices);
    return writer.finish();
}

Datagram made_datagram(const protocol::DatagramHeader& header, std::uint32_t first,
                       const std::vector<EllipsoidRecord>& ellipsoids) {
    DatagramWriter writer(header, protocol::kMaxDatagramBytes);
    writer.add_ellipsoids(first, 1, ellipsoids);
    return writer.finish();
}

Datagram made_datagram(const protocol::DatagramHeader& header,
                       const protocol::Description& description) {
    DatagramWriter writer(header, protocol::kMaxDatagramBytes);
    if (!writer.add_description(description)) throw std::logic_error("does not fit");
    return writer.finish();
}

}  // namespace ellicast::tests
