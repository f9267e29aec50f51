// sender/round_plan.cpp
#include "sender/round_plan.hpp"

#include <algorithm>
#include <cassert>
#include <span>
#include <utility>

#include "common/random.hpp"

namespace ellicast::sender {
namespace {

using protocol::kEllipsoidBytes;
using protocol::kHeaderBytes;
using protocol::kSectionHeaderBytes;
using protocol::kTrailerBytes;

constexpr std::uint32_t kDescriptionEvery = 64;          // datagrams, DESIGN section 5
constexpr std::uint64_t kDescriptionEveryPerSecond = 5;  // 200 ms, DESIGN section 5
constexpr std::size_t kLargestIpUdpBytes = 48;           // IPv6 and UDP headers: the slower case

std::size_t section_bytes(const protocol::Description& description) {
    protocol::DatagramWriter writer(protocol::DatagramHeader{}, protocol::kMaxDatagramBytes);
    [[maybe_unused]] const bool fits = writer.add_description(description);
    assert(fits);
    return writer.finish().size() - kHeaderBytes - kTrailerBytes;
}

/// Leaves room for a record beside the description. The origin stays, for it carries the precision,
/// and the name, whose at most 255 bytes fit into the smallest datagram.
void shorten(protocol::Description& description, std::size_t payload) {
    const std::size_t room = payload - 2 * kSectionHeaderBytes - kEllipsoidBytes;
    for (std::string* text :
         {&description.certificate, &description.unit, &description.sender_version}) {
        if (section_bytes(description) <= room) return;
        text->clear();
    }
    assert(section_bytes(description) <= room);
}

std::uint32_t description_interval(const PlanOptions& options) {
    if (options.bits_per_second == 0) return kDescriptionEvery;
    const std::uint64_t bits = 8 * (options.datagram_bytes + kLargestIpUdpBytes);
    const std::uint64_t datagrams = options.bits_per_second / (kDescriptionEveryPerSecond * bits);
    return static_cast<std::uint32_t>(std::clamp<std::uint64_t>(datagrams, 1, kDescriptionEvery));
}

/// Numbers for one round that are the same wherever they are asked for.
common::Random random_of(const protocol::ObjectId& id, std::uint32_t round) {
    std::uint64_t seed = round;
    for (const std::uint8_t byte : id) seed = seed * 257 + byte;
    return common::Random(seed);
}

/// The order of vertices in a round as a walk over positions 0 .. vertices-1: class by class modulo
/// the stride, beginning at position `start` and wrapping around.
struct VertexOrder {
    std::uint32_t vertices = 1;
    std::uint32_t stride = 1;
    std::uint32_t start = 0;

    [[nodiscard]] std::uint32_t class_begin(std::uint32_t j) const {
        return j * (vertices / stride) + std::min(j, vertices % stride);
    }
    [[nodiscard]] std::uint32_t class_of(std::uint32_t position) const {
        const std::uint32_t longer = vertices % stride;  // classes with one vertex more
        const std::uint32_t size = vertices / stride;
        const std::uint32_t in_longer = longer * (size + 1);
        return position < in_longer ? position / (size + 1)
                                    : longer + (position - in_longer) / size;
    }
};

VertexOrder vertex_order(const BroadcastObject& object, std::uint32_t round,
                         std::uint32_t largest_stride) {
    VertexOrder order;
    order.vertices = static_cast<std::uint32_t>(object.vertices.size());
    if (round == 0) return order;
    common::Random random = random_of(object.id, round);
    // Odd, so that a datagram stays an even sample: spread_order goes by the binary digits of the
    // index.
    order.stride = 1 + 2 * static_cast<std::uint32_t>(random.below((largest_stride + 1) / 2));
    // At the start of a class: then a datagram meets at most one border between classes.
    order.start = order.stride == 1
                      ? static_cast<std::uint32_t>(random.below(order.vertices))
                      : order.class_begin(static_cast<std::uint32_t>(random.below(order.stride)));
    return order;
}

template <class Record>
std::vector<Record> pick(const std::vector<Record>& records, std::uint32_t first,
                         std::uint32_t stride, std::uint32_t count) {
    std::vector<Record> picked;
    picked.reserve(count);
    for (std::size_t k = 0; k < count; ++k) picked.push_back(records[first + k * stride]);
    return picked;
}

}  // namespace

RoundPlan::RoundPlan(BroadcastObject object, const PlanOptions& options)
    : object_(std::move(object)), options_(options) {
    assert(options.datagram_bytes >= protocol::kMinDatagramBytes &&
           options.datagram_bytes <= protocol::kMaxDatagramBytes);
    assert(!object_.ellipsoids.empty() && !object_.vertices.empty());
    LayoutSizes sizes;
    sizes.payload = options.datagram_bytes - kHeaderBytes - kTrailerBytes;
    shorten(object_.description, sizes.payload);
    sizes.description = section_bytes(object_.description);
    description_interval_ = ellicast::sender::description_interval(options);
    sizes.description_interval = description_interval_;
    sizes.ellipsoids = static_cast<std::uint32_t>(object_.ellipsoids.size());
    sizes.vertices = static_cast<std::uint32_t>(object_.vertices.size());
    sizes.format = object_.hint.format;
    sizes.copies = options.copies;

    // In later rounds a datagram may hold the end of one class and the beginning of the next.
    sizes.vertex_sections = options.rounds == 1 ? 1 : 2;
    layout_ = lay_out(sizes);
    // No class is shorter than a datagram's vertices, so that it holds parts of two at most.
    const std::size_t most = sizes.format.vertices_within(sizes.payload - kSectionHeaderBytes);
    largest_stride_ =
        static_cast<std::uint32_t>(std::max<std::size_t>(1, object_.vertices.size() / most));
}

std::vector<std::uint8_t> RoundPlan::datagram(std::uint32_t round, std::uint32_t ordinal,
                                              const Stamp& stamp) const {
    assert(ordinal < datagrams());
    assert(options_.rounds == 0 || round < options_.rounds);
    protocol::DatagramHeader header;
    header.rtp.marker = ordinal + 1 == datagrams();
    header.rtp.sequence = stamp.sequence;
    header.rtp.timestamp = stamp.timestamp;
    header.rtp.ssrc = stamp.ssrc;
    header.session = options_.session;
    header.object = object_.id;
    header.hint = object_.hint;
    header.round = round;
    header.rounds = options_.rounds;
    header.ordinal = ordinal;
    header.datagrams = datagrams();

    protocol::DatagramWriter writer(header, options_.datagram_bytes);
    if (ordinal % description_interval_ == 0) {
        [[maybe_unused]] const bool fits = writer.add_description(object_.description);
        assert(fits);
    }
    add_ellipsoids(writer, round, ordinal);
    add_vertices(writer, round, ordinal);
    return writer.finish();
}

void RoundPlan::add_ellipsoids(protocol::DatagramWriter& writer, std::uint32_t round,
                               std::uint32_t ordinal) const {
    const auto run = layout_.ellipsoids_at(ordinal, round);
    if (!run) return;
    writer.add_ellipsoids(run->first, run->stride,
                          pick(object_.ellipsoids, run->first, run->stride, run->count));
}

void RoundPlan::add_vertices(protocol::DatagramWriter& writer, std::uint32_t round,
                             std::uint32_t ordinal) const {
    const std::uint32_t begin = layout_.first_vertex[ordinal];
    std::uint32_t left = layout_.first_vertex[ordinal + 1] - begin;
    const VertexOrder order = vertex_order(object_, round, largest_stride_);
    auto position =
        static_cast<std::uint32_t>((std::uint64_t{begin} + order.start) % order.vertices);
    while (left > 0) {
        const std::uint32_t j = order.class_of(position);
        const std::uint32_t count = std::min(left, order.class_begin(j + 1) - position);
        const std::uint32_t first = j + (position - order.class_begin(j)) * order.stride;
        if (order.stride == 1) {
            writer.add_vertices(first, 1, std::span(object_.vertices).subspan(first, count));
        } else {
            writer.add_vertices(first, order.stride,
                                pick(object_.vertices, first, order.stride, count));
        }
        left -= count;
        position = (position + count) % order.vertices;
    }
}

}  // namespace ellicast::sender
