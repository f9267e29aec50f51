// sender/round_plan.hpp
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "protocol/datagram.hpp"
#include "sender/broadcast_object.hpp"
#include "sender/round_layout.hpp"

namespace ellicast::sender {

inline constexpr double kMaxRedundancy = 3.0;

struct PlanOptions {
    std::size_t datagram_bytes = protocol::kDefaultDatagramBytes;  // UDP payload, all included
    /// Times that every ellipsoid is in a round, at least: on large models there are more, so that
    /// no 8 datagrams in a row are without any. 1 means exactly once, at the start.
    std::size_t copies = 3;
    /// Bytes of a round, as a multiple of what it has when every vertex is in it just once. The
    /// rest are copies of vertices, the first indices first. 1 to kMaxRedundancy.
    double redundancy = 1.0;
    std::uint64_t bits_per_second = 20'000'000;  // spaces the descriptions; 0: unpaced
    std::uint32_t rounds = 1;                    // said in every header; 0: forever
    protocol::SessionId session{};
    /// Of datagram_bytes, what sealing and signing add later: at most protocol::kMostSecurityBytes.
    std::size_t security_bytes = 0;
    /// Leave room for a line of the table of contents beside every description.
    bool paged = false;
};

/// The table of contents of a carousel, a line for each page.
using Contents = std::vector<protocol::PageEntry>;

/// What a plan's place in a running session adds to it.
struct PlanPlace {
    std::uint32_t first_round = 0;             // of the session, in which the object is new
    std::uint16_t page = 0;                    // its own line in the contents
    std::shared_ptr<const Contents> contents;  // null: none are told
};

/// What only the moment of sending knows of a datagram.
struct Stamp {
    std::uint16_t sequence = 0;
    std::uint32_t timestamp = 0;
    std::uint32_t ssrc = 0;
};

/// Lays the rounds of one object out (DESIGN section 5) and makes any datagram of any round on
/// demand. Every round holds each vertex once, or more often when it is redundant, and each
/// ellipsoid exactly copies() times:
/// - first the description and one copy of all ellipsoids, as residue classes of their ranks, so
/// that every
///   datagram is an even sample of the ranking; what room is left holds vertices;
/// - then vertices, with a section of ellipsoids in at least every 8th datagram; every copy divides
/// the
///   ellipsoids into another number of classes, so that they are lost in other company;
/// - the edges, twice, in sections of up to a quarter of a datagram at even distances;
/// - the description again at least every 64 datagrams and, at the given rate, every 200 ms.
/// Vertices go in index order in round 0; later rounds take another odd stride and start (see
/// VertexWalk, also for copies), and rotate the sections of ellipsoids and edges.
/// Memory: the object and 4 bytes a datagram.
class RoundPlan {
  public:
    /// Requires an object as make_object gives it, a datagram size within the protocol's limits,
    /// copies >= 1 (asserted). A description that would leave no room for a record loses its
    /// certificate, unit, sender version and the end of its name, in this order. Linear in the
    /// number of datagrams.
    RoundPlan(BroadcastObject object, const PlanOptions& options);

    [[nodiscard]] const BroadcastObject& object() const { return object_; }
    /// Of every ellipsoid in a round.
    [[nodiscard]] std::size_t copies() const { return 1 + layout_.groups.size(); }
    /// Datagrams from one description to the next.
    [[nodiscard]] std::uint32_t description_interval() const { return description_interval_; }

    /// Datagrams in each round.
    [[nodiscard]] std::uint32_t datagrams() const { return layout_.datagrams(); }
    [[nodiscard]] double redundancy() const { return options_.redundancy; }

    /// From now on datagrams are those of this place: rounds are laid out as if first_round were
    /// round 0, and each description has a line of the contents beside it, the page's own first
    /// and then the others in turn. Requires PlanOptions::paged where there are contents
    /// (asserted).
    void set_place(PlanPlace place);
    [[nodiscard]] std::uint32_t rounds() const { return options_.rounds; }
    [[nodiscard]] bool paged() const { return options_.paged; }
    /// Datagram `ordinal` of `round`, at most datagram_bytes less security_bytes, complete with
    /// checksum. A function of the object, the options, the place and the arguments alone, made in
    /// the memory of `spent`, whose content is forgotten. Requires ordinal < datagrams() and round
    /// >= the place's first (asserted).
    [[nodiscard]] std::vector<std::uint8_t> datagram(std::uint32_t round, std::uint32_t ordinal,
                                                     const Stamp& stamp,
                                                     std::vector<std::uint8_t> spent = {}) const;

  private:
    void add_description(protocol::DatagramWriter& writer, std::uint32_t round,
                         std::uint32_t ordinal) const;
    void add_ellipsoids(protocol::DatagramWriter& writer, std::uint32_t round,
                        std::uint32_t ordinal) const;
    void add_edges(protocol::DatagramWriter& writer, std::uint32_t round,
                   std::uint32_t ordinal) const;
    void add_vertices(protocol::DatagramWriter& writer, std::uint32_t round,
                      std::uint32_t ordinal) const;
    void cut_edges(std::size_t bytes);

    BroadcastObject object_;
    PlanOptions options_;
    std::uint32_t description_interval_ = 1;
    std::uint32_t most_vertices_ = 1;       // in a datagram
    std::vector<std::uint32_t> edge_runs_;  // running sums of edges, section by section
    RoundLayout layout_;
    PlanPlace place_;
};

}  // namespace ellicast::sender
