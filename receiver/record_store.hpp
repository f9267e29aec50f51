// receiver/record_store.hpp
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "protocol/datagram.hpp"
#include "receiver/arrival.hpp"
#include "receiver/edge_set.hpp"
#include "receiver/received_object.hpp"
#include "receiver/record_table.hpp"
#include "receiver/round_progress.hpp"

namespace ellicast::receiver {

/// What strangers may make us hold.
struct StoreLimits {
    std::size_t groups = 64;
    std::uint32_t vertices = 1u << 25;  // of one object; an object that hints more is not taken in
    /// Records of all groups together. One group gets half (MemoryBudget): enough for 2^25
    /// vertices.
    std::size_t bytes = std::size_t{3} << 29;
};

/// One sender instance, as its datagrams name it.
struct SenderKey {
    Source source;
    protocol::SessionId session{};
    auto operator<=>(const SenderKey&) const = default;
};

/// Whether two senders are one station, so that one may go on with what the other began, and send
/// other versions of its pages: with keys the same verified key, without them the same source
/// address.
bool same_station(const SenderKey& a, const SenderKey& b);

struct StoreCounts {
    std::uint64_t repeated = 0;    // records that were there already, bit for bit
    std::uint64_t refused = 0;     // records for which no memory was left
    std::uint64_t over_limit = 0;  // datagrams of objects beyond StoreLimits::vertices
    std::uint64_t evicted = 0;     // groups given up for others
    std::uint64_t merged = 0;      // groups united with a later one
};

/// Keeps records by who sent what (DESIGN section 5, "Who belongs together"): a group per verified
/// key, or else source address, port and session, and object id and hint. Groups never contribute
/// to one another, but a group without a key that was silent for 5 s is united with a later one
/// from the same address with the same object id and hint: the restarted sender. The content of a
/// group is a function of the set of its accepted records (RecordTable). Memory is bounded by the
/// limits: when there are too many groups a lesser one goes (entry_to_evict); when there are too
/// many bytes, new records are refused. Pure: time is an argument.
class RecordStore {
  public:
    explicit RecordStore(const StoreLimits& limits = {});

    /// Takes a datagram's records in. False when its object is over the limits; nothing changed
    /// then. Cost: linear in the records, logarithmic each until a sixteenth of the object is
    /// there.
    bool accept(Time now, const SenderKey& sender, const protocol::DatagramView& datagram);

    /// Unites what is due at `now`. accept does it too; call it before looking after a silence.
    void merge_silent(Time now);

    /// A group as it stands; invalid after the next call that is not const.
    struct Group {
        SenderKey sender;  // the latest, when groups were united
        protocol::ObjectId object{};
        protocol::Hint hint;
        std::array<std::uint8_t, protocol::kCanonicalHintBytes> hint_bytes{};
        std::array<std::uint8_t, 8> hint_digest{};
        std::vector<SenderKey> senders;  // all that fed it, the first kMaxSenders
        Time last_seen{};
        std::uint64_t datagrams = 0;
        RoundProgress progress;  // of the latest sender
        std::optional<protocol::Description> description;
        RecordTable<protocol::EllipsoidRecord> ellipsoids;
        RecordTable<protocol::VertexRecord> vertices;
        EdgeSet edges;  // advice: no records, they neither complete nor show a group

        [[nodiscard]] std::size_t records() const { return ellipsoids.size() + vertices.size(); }
        [[nodiscard]] bool complete() const { return ellipsoids.complete() && vertices.complete(); }
    };
    static constexpr std::size_t kMaxSenders = 64;

    /// The group with the most distinct records, ties by the smaller hint digest, then object id
    /// and sender. Null before anything was accepted.
    [[nodiscard]] const Group* shown() const;
    /// The same among the groups for which `counts` is true.
    [[nodiscard]] const Group* greatest(const std::function<bool(const Group&)>& counts) const;
    /// The group of the last datagram accepted; null before.
    [[nodiscard]] const Group* latest() const;
    /// Goes up whenever a group comes, becomes complete, or its name known.
    [[nodiscard]] std::uint64_t changes() const { return changes_; }
    /// Gives a group up, with all its records. Requires one of groups() (asserted).
    void forget(const Group& group);
    [[nodiscard]] const std::vector<Group>& groups() const { return groups_; }
    [[nodiscard]] std::size_t bytes() const { return budget_.used(); }
    [[nodiscard]] const StoreCounts& counts() const { return counts_; }

    /// When any group of the shown group's station last sent something valid.
    [[nodiscard]] std::optional<Time> last_heard() const;

    /// The shown group as a value; empty before anything was accepted. Linear in its records.
    [[nodiscard]] std::optional<ReceivedObject> snapshot() const;
    /// The same of any group.
    static ReceivedObject snapshot_of(const Group& group);

  private:
    std::size_t group_of(const SenderKey& sender, const protocol::DatagramHeader& header);
    std::size_t add_group(const SenderKey& sender, const protocol::DatagramHeader& header);
    void take_section(Group& group, const protocol::SectionView& section);
    void merge_into(Group& newer, Group& older);
    void remove(std::size_t group);

    StoreLimits limits_;
    MemoryBudget budget_;
    StoreCounts counts_;
    std::uint64_t changes_ = 0;
    std::vector<Group> groups_;  // in order of arrival
    std::size_t latest_ = 0;     // index of the group of the last datagram
};

}  // namespace ellicast::receiver
