// sender/round_plan.cpp
#include "sender/round_plan.hpp"

#include <algorithm>
#include <cassert>
#include <span>
#include <utility>

#include "sender/vertex_walk.hpp"

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
    assert(options.redundancy >= 1.0 && options.redundancy <= kMaxRedundancy);
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

    // In later rounds a datagram may hold the end of one class and the beginning of the next, and
    // among copies the end of one pass and the beginning of the next.
    sizes.redundancy = options.redundancy;
    sizes.vertex_sections = options.rounds == 1 ? 1 : 2;
    layout_ = lay_out(sizes);
    most_vertices_ = static_cast<std::uint32_t>(
        sizes.format.vertices_within(sizes.payload - kSectionHeaderBytes));
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
    const std::uint32_t count = layout_.first_vertex[ordinal + 1] - begin;
    const WalkSizes sizes{static_cast<std::uint32_t>(object_.vertices.size()),
                          layout_.first_vertex.back(), most_vertices_};
    for (const VertexRun& run : VertexWalk(sizes, object_.id, round).runs(begin, count)) {
        if (run.stride == 1) {
            writer.add_vertices(run.first, 1,
                                std::span(object_.vertices).subspan(run.first, run.count));
        } else {
            writer.add_vertices(run.first, run.stride,
                                pick(object_.vertices, run.first, run.stride, run.count));
        }
    }
}

}  // namespace ellicast::sender
