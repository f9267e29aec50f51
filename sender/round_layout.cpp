// sender/round_layout.cpp
#include "sender/round_layout.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>

namespace ellicast::sender {
namespace {

using protocol::kEllipsoidBytes;
using protocol::kSectionHeaderBytes;

// DESIGN section 5: whoever joins late has a shape at once.
constexpr std::uint32_t kSectionEvery = 8;

// On models so large that a section in every 8th datagram means more copies than asked for, a
// section holds this many: a shape for the late at once, for 3 % of the bytes (301 in 8 datagrams
// of 1200).
constexpr std::uint32_t kRidingEllipsoids = 8;

// Positions a vertex, on average and at most, so that a handful of vertices does not have to
// outweigh many ellipsoids.
constexpr double kMostOften = 12.0;

std::uint32_t ceil_div(std::uint64_t a, std::uint64_t b) {
    return static_cast<std::uint32_t>((a + b - 1) / b);
}

std::uint32_t ellipsoids_that_fit(std::size_t bytes) {
    return bytes < kSectionHeaderBytes
               ? 0
               : static_cast<std::uint32_t>((bytes - kSectionHeaderBytes) / kEllipsoidBytes);
}

/// Size of residue class j of 0 .. count-1.
std::uint32_t class_size(std::uint32_t count, std::uint32_t classes, std::uint32_t j) {
    return count / classes + (j < count % classes ? 1 : 0);
}

std::uint32_t head_length(const LayoutSizes& sizes) {
    return ceil_div(sizes.ellipsoids, ellipsoids_that_fit(sizes.payload - sizes.description));
}

/// How many ellipsoids a riding section may hold. Half a datagram when there are enough vertices
/// for the other half, else all that is left beside a description.
struct SectionLimits {
    std::uint32_t usual = 1;
    std::uint32_t full = 1;
    std::uint32_t least = 1;
};
SectionLimits section_limits(const LayoutSizes& sizes) {
    SectionLimits limits;
    limits.full = ellipsoids_that_fit(sizes.payload - sizes.description - sizes.edges);
    limits.usual = std::clamp(ellipsoids_that_fit(sizes.payload / 2), 1u, limits.full);
    limits.least = std::min(kRidingEllipsoids, limits.usual);
    return limits;
}

/// Numbers of classes for further copies: `copies` or more of them, the first at least n, each of
/// the first few without a common divisor with those before it (then with the last three: with many
/// copies that is what matters, and numbers stay near n), until the sum is at least `sections`.
std::vector<std::uint32_t> choose_groups(std::uint32_t head, std::uint32_t n,
                                         std::uint32_t ellipsoids, std::size_t copies,
                                         std::uint32_t sections) {
    // One class is the whole: what fits into one section stays together.
    const std::uint32_t largest = n == 1 ? 1 : std::min(ellipsoids, n + n / 4 + 3);
    std::vector<std::uint32_t> groups;
    std::uint64_t sum = 0;
    std::uint32_t candidate = n;
    const auto coprime = [&](std::uint32_t value) {
        if (std::gcd(value, head) != 1) return false;
        const std::size_t from = groups.size() > 3 ? groups.size() - 3 : 0;
        return std::all_of(groups.begin() + static_cast<std::ptrdiff_t>(from), groups.end(),
                           [&](std::uint32_t other) { return std::gcd(value, other) == 1; });
    };
    while (groups.size() < copies || sum < sections) {
        std::uint32_t chosen = candidate;
        std::uint32_t tried = 0;
        const std::uint32_t span = largest - n + 1;
        while (!coprime(chosen) && tried++ < span) chosen = chosen < largest ? chosen + 1 : n;
        groups.push_back(chosen);
        sum += chosen;
        candidate = chosen < largest ? chosen + 1 : n;
    }
    return groups;
}

/// Groups for a body of that many datagrams; empty when they have no place in it.
std::optional<std::vector<std::uint32_t>> groups_for(const LayoutSizes& sizes, std::uint32_t head,
                                                     std::uint32_t body) {
    if (sizes.copies <= 1) return std::vector<std::uint32_t>{};
    const SectionLimits limits = section_limits(sizes);
    const std::size_t further = sizes.copies - 1;
    const std::uint32_t sections = ceil_div(body, kSectionEvery);
    const std::uint32_t fewest = ceil_div(sizes.ellipsoids, limits.full);
    const std::uint32_t wanted =
        std::clamp(ceil_div(sections, further), ceil_div(sizes.ellipsoids, limits.usual),
                   ceil_div(sizes.ellipsoids, limits.least));
    for (std::uint32_t n = wanted; n >= fewest; --n) {
        std::vector<std::uint32_t> groups =
            choose_groups(head, n, sizes.ellipsoids, further, sections);
        if (std::accumulate(groups.begin(), groups.end(), std::uint64_t{0}) <= body) return groups;
    }
    return std::nullopt;
}

void set_groups(RoundLayout& layout, std::vector<std::uint32_t> groups) {
    layout.first_group.assign(1, 0);
    for (const std::uint32_t n : groups)
        layout.first_group.push_back(layout.first_group.back() + n);
    layout.groups = std::move(groups);
}

std::size_t ellipsoid_section(const EllipsoidRun& run) {
    return kSectionHeaderBytes + run.count * kEllipsoidBytes;
}

/// Vertices that fit into one datagram beside everything else in it.
std::uint32_t vertex_room(const LayoutSizes& sizes, const RoundLayout& layout,
                          std::uint32_t ordinal) {
    // Two sections may end in padding where one would not.
    std::size_t taken = sizes.vertex_sections * (kSectionHeaderBytes + 1) - 1;
    if (sizes.format.tag_bits() % 8 == 0) taken = sizes.vertex_sections * kSectionHeaderBytes;
    if (ordinal % sizes.description_interval == 0) taken += sizes.description;
    if (layout.edges_at(ordinal)) taken += sizes.edges;
    if (auto run = layout.ellipsoids_at(ordinal, 0)) {
        // Another rotation may put a class with one more record here.
        run->count = ceil_div(layout.ellipsoids, run->stride);
        taken += ellipsoid_section(*run);
    }
    if (taken >= sizes.payload) return 0;
    const auto room =
        static_cast<std::uint32_t>(sizes.format.vertices_within(sizes.payload - taken));
    return sizes.redundancy > 1.0 ? std::min(room, sizes.vertices) : room;
}

std::uint64_t room_in_all(const LayoutSizes& sizes, const RoundLayout& layout) {
    std::uint64_t room = 0;
    for (std::uint32_t k = 0; k < layout.datagrams(); ++k) room += vertex_room(sizes, layout, k);
    return room;
}

/// Gives every datagram the share of the positions that its room is of all room, so that the last
/// one is as full as the others.
void share_vertices(const LayoutSizes& sizes, std::uint32_t positions, RoundLayout& layout) {
    const std::uint64_t all = room_in_all(sizes, layout);
    assert(all >= positions);
    std::uint64_t room = 0;
    layout.first_vertex.assign(1, 0);
    layout.first_vertex.reserve(layout.datagrams() + std::size_t{1});
    for (std::uint32_t k = 0; k < layout.datagrams(); ++k) {
        room += vertex_room(sizes, layout, k);
        // Room and positions are below 2^31 each: the product fits.
        layout.first_vertex.push_back(static_cast<std::uint32_t>(room * positions / all));
    }
}

/// The next body length to try when `missing` vertices find no room.
std::uint32_t lengthen(const LayoutSizes& sizes, std::uint32_t body, std::uint64_t missing) {
    std::uint64_t each = sizes.format.vertices_within(sizes.payload - kSectionHeaderBytes);
    if (sizes.redundancy > 1.0) each = std::min<std::uint64_t>(each, sizes.vertices);
    return body + static_cast<std::uint32_t>(std::max<std::uint64_t>(1, missing / each));
}

/// The shortest layout with that many positions for vertices.
RoundLayout lay_out_positions(const LayoutSizes& sizes, std::uint32_t positions) {
    RoundLayout layout;
    layout.ellipsoids = sizes.ellipsoids;
    layout.head = head_length(sizes);
    const std::uint64_t fewest = ceil_div(sizes.ellipsoids, section_limits(sizes).full);
    layout.edge_sections = sizes.edge_sections;
    layout.body =
        std::max(static_cast<std::uint32_t>((sizes.copies - 1) * fewest), sizes.edge_sections);
    for (;;) {
        std::optional<std::vector<std::uint32_t>> groups =
            groups_for(sizes, layout.head, layout.body);
        if (!groups) {
            ++layout.body;
            continue;
        }
        set_groups(layout, std::move(*groups));
        const std::uint64_t room = room_in_all(sizes, layout);
        if (room >= positions) break;
        layout.body = lengthen(sizes, layout.body, positions - room);
    }
    share_vertices(sizes, positions, layout);
    return layout;
}

/// UDP payload of a whole round, but for the few headers where a second section of vertices begins.
std::uint64_t round_bytes(const LayoutSizes& sizes, const RoundLayout& layout) {
    std::uint64_t bytes = 0;
    for (std::uint32_t k = 0; k < layout.datagrams(); ++k) {
        bytes += protocol::kHeaderBytes + protocol::kTrailerBytes;
        if (k % sizes.description_interval == 0) bytes += sizes.description;
        if (layout.edges_at(k)) bytes += sizes.edges;
        if (const auto run = layout.ellipsoids_at(k, 0)) bytes += ellipsoid_section(*run);
        const std::uint64_t vertices = layout.first_vertex[k + 1] - layout.first_vertex[k];
        if (vertices > 0) bytes += kSectionHeaderBytes + sizes.format.vertex_bytes(vertices);
    }
    return bytes;
}

/// The layout with copies whose bytes are nearest to `target`. More positions are more bytes, at
/// first order those of their share of a datagram; a few steps of that lead there.
RoundLayout lay_out_bytes(const LayoutSizes& sizes, RoundLayout layout, double target) {
    constexpr int kSteps = 8;
    RoundLayout best = layout;
    double best_gap = target - static_cast<double>(round_bytes(sizes, layout));
    double gap = best_gap;
    const auto vertex_bytes = static_cast<double>(sizes.format.vertex_bytes(1));
    for (int step = 0; step < kSteps && std::abs(gap) >= vertex_bytes; ++step) {
        const double positions = layout.first_vertex.back();
        const double each = step == 0 ? (target - gap) / positions : vertex_bytes;
        const double wanted = std::clamp<double>(positions + std::floor(gap / each), sizes.vertices,
                                                 kMostOften * sizes.vertices);
        if (wanted == positions) break;
        layout = lay_out_positions(sizes, static_cast<std::uint32_t>(wanted));
        gap = target - static_cast<double>(round_bytes(sizes, layout));
        if (std::abs(gap) < std::abs(best_gap)) {
            best = layout;
            best_gap = gap;
        }
    }
    return best;
}

}  // namespace

std::optional<std::uint32_t> RoundLayout::edges_at(std::uint32_t ordinal) const {
    if (ordinal < head) return std::nullopt;
    const std::uint64_t d = ordinal - head;
    const std::uint64_t before = d * edge_sections / body;
    if (before == (d + 1) * edge_sections / body) return std::nullopt;
    return static_cast<std::uint32_t>(before);
}

std::optional<EllipsoidRun> RoundLayout::ellipsoids_at(std::uint32_t ordinal,
                                                       std::uint32_t rotation) const {
    if (ordinal < head) {
        const std::uint32_t j = (ordinal + rotation % head) % head;
        return EllipsoidRun{j, head, class_size(ellipsoids, head, j)};
    }
    // Sections stand at even distances: datagram d of the body has one where the running sum
    // floor((d + 1) sections / body) steps up. Two neighbours are at most ceil(body / sections)
    // apart.
    const std::uint64_t d = ordinal - head;
    const std::uint64_t before = d * sections() / body;
    if (before == (d + 1) * sections() / body) return std::nullopt;
    // The classes of a copy are rotated among its places, so that a place has at most one record
    // more or less than in another round.
    const auto copy = static_cast<std::size_t>(
        std::upper_bound(first_group.begin(), first_group.end(), before) - first_group.begin() - 1);
    const std::uint32_t n = groups[copy];
    const auto j = static_cast<std::uint32_t>((before - first_group[copy] + rotation % n) % n);
    return EllipsoidRun{j, n, class_size(ellipsoids, n, j)};
}

RoundLayout lay_out(const LayoutSizes& sizes) {
    assert(sizes.ellipsoids >= 1 && sizes.vertices >= 1 && sizes.copies >= 1);
    assert(sizes.vertex_sections >= 1 && sizes.description_interval >= 1);
    assert(sizes.payload >=
           sizes.description + sizes.edges + 2 * kSectionHeaderBytes + kEllipsoidBytes);
    assert(sizes.redundancy >= 1.0);
    LayoutSizes plain = sizes;
    plain.redundancy = 1.0;
    RoundLayout layout = lay_out_positions(plain, sizes.vertices);
    if (sizes.redundancy == 1.0) return layout;
    LayoutSizes redundant = sizes;
    ++redundant.vertex_sections;
    const double target = sizes.redundancy * static_cast<double>(round_bytes(plain, layout));
    return lay_out_bytes(redundant, std::move(layout), target);
}

}  // namespace ellicast::sender
