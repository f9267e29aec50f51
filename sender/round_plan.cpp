// sender/round_plan.cpp
#include "sender/round_plan.hpp"

#include <algorithm>
#include <cassert>
#include <span>
#include <utility>

#include "protocol/secured_datagram.hpp"
#include "sender/vertex_walk.hpp"

namespace ellicast::sender {
namespace {

using protocol::kEllipsoidBytes;
using protocol::kHeaderBytes;
using protocol::kSectionHeaderBytes;
using protocol::kTrailerBytes;

constexpr std::uint32_t kDescriptionEvery = 64;          // datagrams, DESIGN section 5
constexpr std::uint64_t kDescriptionEveryPerSecond = 5;  // 200 ms, DESIGN section 5
// Every section of edges, in a round: at 30 % loss nine in ten arrive.
constexpr std::uint32_t kEdgeCopies = 2;
constexpr std::size_t kLargestIpUdpBytes = 48;  // IPv6 and UDP headers: the slower case
// Of a page's section with the longest name: kind, length, and 31 bytes before the name.
constexpr std::size_t kPageSectionBytes = 3 + 31 + protocol::kMaxPageNameBytes;

std::size_t section_bytes(const protocol::Description& description) {
    protocol::DatagramWriter writer(protocol::DatagramHeader{}, protocol::kMaxDatagramBytes);
    [[maybe_unused]] const bool fits = writer.add_description(description);
    assert(fits);
    return writer.finish().size() - kHeaderBytes - kTrailerBytes;
}

/// Leaves room for a record beside the description. The origin stays, for it carries the precision,
/// and of the name as much as fits: all of it, but in the smallest datagrams that are secured, too.
void shorten(protocol::Description& description, std::size_t payload) {
    const std::size_t room = payload - 2 * kSectionHeaderBytes - kEllipsoidBytes;
    for (std::string* text :
         {&description.certificate, &description.unit, &description.sender_version}) {
        if (section_bytes(description) <= room) return;
        text->clear();
    }
    std::string& name = description.name;
    while (section_bytes(description) > room && !name.empty()) {
        while (name.size() > 1 && (name.back() & 0xc0) == 0x80) name.pop_back();
        name.pop_back();
    }
    assert(section_bytes(description) <= room);
}

std::uint32_t description_interval(const PlanOptions& options) {
    if (options.bits_per_second == 0) return kDescriptionEvery;
    const std::uint64_t bits = 8 * (options.datagram_bytes + kLargestIpUdpBytes);
    const std::uint64_t datagrams = options.bits_per_second / (kDescriptionEveryPerSecond * bits);
    return static_cast<std::uint32_t>(std::clamp<std::uint64_t>(datagrams, 1, kDescriptionEvery));
}

}  // namespace

RoundPlan::RoundPlan(BroadcastObject object, const PlanOptions& options)
    : object_(std::move(object)), options_(options) {
    assert(options.datagram_bytes >= protocol::kMinDatagramBytes &&
           options.datagram_bytes <= protocol::kMaxDatagramBytes);
    assert(options.security_bytes <= protocol::kMostSecurityBytes);
    assert(options.redundancy >= 1.0 && options.redundancy <= kMaxRedundancy);
    assert(!object_.ellipsoids.empty() && !object_.vertices.empty());
    LayoutSizes sizes;
    sizes.payload = options.datagram_bytes - options.security_bytes - kHeaderBytes - kTrailerBytes;
    const std::size_t page = options.paged ? kPageSectionBytes : 0;
    shorten(object_.description, sizes.payload - page);
    sizes.description = section_bytes(object_.description) + page;
    description_interval_ = ellicast::sender::description_interval(options);
    sizes.description_interval = description_interval_;
    sizes.ellipsoids = static_cast<std::uint32_t>(object_.ellipsoids.size());
    sizes.vertices = static_cast<std::uint32_t>(object_.vertices.size());
    sizes.format = object_.hint.format;
    sizes.copies = options.copies;
    const std::size_t needed = sizes.description + 2 * kSectionHeaderBytes + kEllipsoidBytes;
    cut_edges(std::min(sizes.payload / 4, sizes.payload - needed));
    sizes.edge_sections = kEdgeCopies * static_cast<std::uint32_t>(edge_runs_.size() - 1);
    for (std::size_t k = 1; k < edge_runs_.size(); ++k) {
        sizes.edges =
            std::max(sizes.edges, protocol::kEdgeSectionBytes +
                                      (edge_runs_[k] - edge_runs_[k - 1]) * protocol::kEdgeBytes);
    }

    // In later rounds a datagram may hold the end of one class and the beginning of the next, and
    // among copies the end of one pass and the beginning of the next.
    sizes.redundancy = options.redundancy;
    sizes.vertex_sections = options.rounds == 1 ? 1 : 2;
    layout_ = lay_out(sizes);
    most_vertices_ = static_cast<std::uint32_t>(
        sizes.format.vertices_within(sizes.payload - kSectionHeaderBytes));
}

std::vector<std::uint8_t> RoundPlan::datagram(std::uint32_t round, std::uint32_t ordinal,
                                              const Stamp& stamp,
                                              std::vector<std::uint8_t> spent) const {
    assert(ordinal < datagrams());
    assert(options_.rounds == 0 || round < options_.rounds);
    assert(round >= place_.first_round);
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

    protocol::DatagramWriter writer(header, options_.datagram_bytes - options_.security_bytes,
                                    std::move(spent));
    const std::uint32_t own_round = round - place_.first_round;
    if (ordinal % description_interval_ == 0) add_description(writer, own_round, ordinal);
    add_ellipsoids(writer, own_round, ordinal);
    add_edges(writer, own_round, ordinal);
    add_vertices(writer, own_round, ordinal);
    return writer.finish();
}

void RoundPlan::set_place(PlanPlace place) {
    assert(!place.contents || (options_.paged && place.page < place.contents->size()));
    place_ = std::move(place);
}

void RoundPlan::add_description(protocol::DatagramWriter& writer, std::uint32_t round,
                                std::uint32_t ordinal) const {
    [[maybe_unused]] bool fits = writer.add_description(object_.description);
    assert(fits);
    if (!place_.contents) return;
    const std::uint64_t in_a_round = (datagrams() - 1) / description_interval_ + std::uint64_t{1};
    const std::uint64_t turn = round * in_a_round + ordinal / description_interval_;
    fits = writer.add_page((*place_.contents)[(place_.page + turn) % place_.contents->size()]);
    assert(fits);
}

void RoundPlan::add_ellipsoids(protocol::DatagramWriter& writer, std::uint32_t round,
                               std::uint32_t ordinal) const {
    const auto run = layout_.ellipsoids_at(ordinal, round);
    if (!run) return;
    const protocol::Strided<protocol::EllipsoidRecord> records(object_.ellipsoids, run->first,
                                                               run->stride, run->count);
    writer.add_ellipsoids(run->first, run->stride, records);
}

/// Into sections of at most so many bytes, each among the same vertices; none where not one fits.
void RoundPlan::cut_edges(std::size_t bytes) {
    edge_runs_.assign(1, 0);
    if (bytes < protocol::kEdgeSectionBytes + protocol::kEdgeBytes) return;
    const std::vector<protocol::EdgeRecord>& edges = object_.edges;
    const std::size_t most = (bytes - protocol::kEdgeSectionBytes) / protocol::kEdgeBytes;
    for (std::size_t begin = 0, end = 0; begin < edges.size(); begin = end) {
        while (end < edges.size() && end - begin < most && edges[end].among == edges[begin].among) {
            ++end;
        }
        edge_runs_.push_back(static_cast<std::uint32_t>(end));
    }
}

void RoundPlan::add_edges(protocol::DatagramWriter& writer, std::uint32_t round,
                          std::uint32_t ordinal) const {
    const auto place = layout_.edges_at(ordinal);
    if (!place) return;
    const std::size_t runs = edge_runs_.size() - 1;
    const std::size_t k = (*place + round) % runs;
    writer.add_edges(
        std::span(object_.edges).subspan(edge_runs_[k], edge_runs_[k + 1] - edge_runs_[k]));
}

void RoundPlan::add_vertices(protocol::DatagramWriter& writer, std::uint32_t round,
                             std::uint32_t ordinal) const {
    const std::uint32_t begin = layout_.first_vertex[ordinal];
    const std::uint32_t count = layout_.first_vertex[ordinal + 1] - begin;
    const WalkSizes sizes{static_cast<std::uint32_t>(object_.vertices.size()),
                          layout_.first_vertex.back(), most_vertices_};
    const VertexWalk walk(sizes, object_.id, round);
    walk.for_each_run(begin, count, [&](const VertexRun& run) {
        const protocol::Strided<protocol::VertexRecord> records(object_.vertices, run.first,
                                                                run.stride, run.count);
        writer.add_vertices(run.first, run.stride, records);
    });
}

}  // namespace ellicast::sender
