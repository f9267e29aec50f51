// receiver/record_store.cpp
#include "receiver/record_store.hpp"

#include <algorithm>
#include <bit>
#include <cassert>
#include <chrono>
#include <tuple>
#include <utility>

#include "common/object_id.hpp"
#include "receiver/eviction.hpp"

namespace ellicast::receiver {
namespace {

using Group = RecordStore::Group;

// How long a group is silent before a later one from the same address may take it over: longer than
// any pause of a sender that still lives, short for whoever waits for its restart.
constexpr Time kSilence = std::chrono::seconds(5);

// A verified key is one sender, whatever address and session it comes with.
bool is_owner(const Group& group, const SenderKey& sender) {
    const Authenticity& said = sender.source.authenticity;
    return said.verified() ? group.sender.source.authenticity.key == said.key
                           : group.sender == sender;
}

bool holds(const Group& group, const SenderKey& sender, const protocol::DatagramHeader& header,
           const std::array<std::uint8_t, protocol::kCanonicalHintBytes>& hint_bytes) {
    return is_owner(group, sender) && group.object == header.object &&
           group.hint_bytes == hint_bytes;
}

// Sent by one station, and the same object.
bool akin(const Group& a, const Group& b) {
    return same_station(a.sender, b.sender) && a.object == b.object && a.hint_bytes == b.hint_bytes;
}

auto order_of(const Group& group) {
    return std::tie(group.hint_digest, group.object, group.sender);
}

auto order_of(const protocol::Description& d) {
    const auto origin = std::bit_cast<std::array<std::uint64_t, 3>>(d.origin);
    return std::tuple(d.name, origin, d.unit, d.certificate, d.sender_version);
}

// Of contradictory descriptions the smallest stays, so that the order of arrival means nothing.
void keep_smaller(std::optional<protocol::Description>& kept, protocol::Description other) {
    if (!kept || order_of(other) < order_of(*kept)) kept = std::move(other);
}

/// Decodes a section's records, some at a time, into a table.
template <class Record>
InsertionCounts insert_all(RecordTable<Record>& table, const protocol::SectionView& section,
                           MemoryBudget& budget) {
    InsertionCounts counts;
    std::array<Record, 64> block;
    for (std::size_t k = 0; k < section.count; k += block.size()) {
        const std::size_t size = std::min(block.size(), section.count - k);
        const auto records = std::span(block).first(size);
        section.read(k, records);
        counts += table.insert_run(section.index(k), section.stride,
                                   std::span<const Record>(records), budget);
    }
    return counts;
}

void add_sender(std::vector<SenderKey>& senders, const SenderKey& sender) {
    if (senders.size() >= RecordStore::kMaxSenders) return;
    if (std::find(senders.begin(), senders.end(), sender) == senders.end()) {
        senders.push_back(sender);
    }
}

// Another run of the sender, or another way to us: its rounds are its own.
void change_sender(Group& group, const SenderKey& sender) {
    if (group.sender.session != sender.session) group.progress = {};
    group.sender = sender;
    add_sender(group.senders, sender);
}

}  // namespace

bool same_station(const SenderKey& a, const SenderKey& b) {
    const Authenticity& key = a.source.authenticity;
    if (key.key != b.source.authenticity.key) return false;
    return key.verified() || a.source.address == b.source.address;
}

RecordStore::RecordStore(const StoreLimits& limits) : limits_(limits), budget_(limits.bytes) {
    limits_.groups = std::max<std::size_t>(limits_.groups, 1);
}

bool RecordStore::accept(Time now, const SenderKey& sender,
                         const protocol::DatagramView& datagram) {
    if (datagram.header.hint.vertices > limits_.vertices) {
        ++counts_.over_limit;
        return false;
    }
    latest_ = group_of(sender, datagram.header);
    Group& group = groups_[latest_];
    if (group.sender != sender) change_sender(group, sender);
    group.last_seen = now;
    ++group.datagrams;
    group.progress.on_header(now, datagram.header);
    const bool was_complete = group.complete();
    const bool was_described = group.description.has_value();
    for (const protocol::SectionView& section : datagram.sections()) take_section(group, section);
    if (group.complete() != was_complete || group.description.has_value() != was_described) {
        ++changes_;
    }

    for (std::size_t k = groups_.size(); k-- > 0 && groups_.size() > 1;) {
        const Group& other = groups_[k];
        if (k == latest_ || now - other.last_seen < kSilence || !akin(groups_[latest_], other)) {
            continue;
        }
        merge_into(groups_[latest_], groups_[k]);
        remove(k);
    }
    return true;
}

std::size_t RecordStore::group_of(const SenderKey& sender, const protocol::DatagramHeader& header) {
    const auto hint_bytes = protocol::canonical_bytes(header.hint);
    if (latest_ < groups_.size() && holds(groups_[latest_], sender, header, hint_bytes)) {
        return latest_;
    }
    for (std::size_t k = 0; k < groups_.size(); ++k) {
        if (holds(groups_[k], sender, header, hint_bytes)) return k;
    }
    return add_group(sender, header);
}

std::size_t RecordStore::add_group(const SenderKey& sender,
                                   const protocol::DatagramHeader& header) {
    if (groups_.size() >= limits_.groups) {
        remove(entry_to_evict(
            groups_, [](const Group& g) { return g.records(); },
            [](const Group& g) { return g.last_seen; }));
        ++counts_.evicted;
    }
    common::Digest digest;
    const auto hint_bytes = protocol::canonical_bytes(header.hint);
    digest.update(hint_bytes);
    groups_.push_back(
        Group{.sender = sender,
              .object = header.object,
              .hint = header.hint,
              .hint_bytes = hint_bytes,
              .hint_digest = digest.finish8(),
              .senders = {sender},
              .last_seen = {},
              .datagrams = 0,
              .progress = {},
              .description = std::nullopt,
              .ellipsoids = RecordTable<protocol::EllipsoidRecord>(header.hint.ellipsoids),
              .vertices = RecordTable<protocol::VertexRecord>(header.hint.vertices),
              .edges = EdgeSet(header.hint.vertices)});
    ++changes_;
    return groups_.size() - 1;
}

void RecordStore::take_section(Group& group, const protocol::SectionView& section) {
    const auto count = [&](const InsertionCounts& counts) {
        counts_.repeated += counts.same;
        counts_.refused += counts.refused;
    };
    switch (section.kind) {
        case protocol::SectionKind::ellipsoids:
            count(insert_all(group.ellipsoids, section, budget_));
            break;
        case protocol::SectionKind::vertices:
            count(insert_all(group.vertices, section, budget_));
            break;
        case protocol::SectionKind::edges:
            for (std::size_t k = 0; k < section.count; ++k) {
                if (!group.edges.insert(section.edge(k), budget_)) ++counts_.refused;
            }
            break;
        case protocol::SectionKind::description:
            keep_smaller(group.description, section.description());
            break;
        case protocol::SectionKind::page:  // receiver/catalogue.hpp
            break;
    }
}

void RecordStore::merge_silent(Time now) {
    for (std::size_t older = groups_.size(); older-- > 0;) {
        if (now - groups_[older].last_seen < kSilence) continue;
        for (std::size_t newer = groups_.size(); newer-- > 0;) {
            if (newer == older || !akin(groups_[newer], groups_[older])) continue;
            if (std::pair(groups_[newer].last_seen, newer) <
                std::pair(groups_[older].last_seen, older)) {
                continue;
            }
            merge_into(groups_[newer], groups_[older]);
            remove(older);
            break;
        }
    }
}

// Leaves `older` without records. The smaller tables are poured into the greater ones: that needs
// the least memory and time, and the union is the same.
void RecordStore::merge_into(Group& newer, Group& older) {
    const auto unite = [&](auto& into, auto& from) {
        if (from.size() > into.size()) std::swap(into, from);
        if (!into.merge(from, budget_)) ++counts_.refused;
        from.release(budget_);
    };
    unite(newer.ellipsoids, older.ellipsoids);
    unite(newer.vertices, older.vertices);
    unite(newer.edges, older.edges);
    if (older.description) keep_smaller(newer.description, *std::move(older.description));
    for (const SenderKey& sender : older.senders) add_sender(newer.senders, sender);
    newer.datagrams += older.datagrams;
    ++changes_;
    ++counts_.merged;
}

void RecordStore::remove(std::size_t group) {
    groups_[group].ellipsoids.release(budget_);
    groups_[group].vertices.release(budget_);
    groups_[group].edges.release(budget_);
    groups_.erase(groups_.begin() + static_cast<std::ptrdiff_t>(group));
    if (latest_ == group) {
        latest_ = groups_.size();  // none
    } else if (latest_ > group) {
        --latest_;
    }
}

const RecordStore::Group* RecordStore::shown() const {
    return greatest([](const Group&) { return true; });
}

const RecordStore::Group* RecordStore::greatest(
    const std::function<bool(const Group&)>& counts) const {
    const Group* best = nullptr;
    for (const Group& group : groups_) {
        if (!counts(group)) continue;
        if (!best || group.records() > best->records() ||
            (group.records() == best->records() && order_of(group) < order_of(*best))) {
            best = &group;
        }
    }
    return best;
}

const RecordStore::Group* RecordStore::latest() const {
    return latest_ < groups_.size() ? &groups_[latest_] : nullptr;
}

void RecordStore::forget(const Group& group) {
    assert(&group >= groups_.data() && &group < groups_.data() + groups_.size());
    remove(static_cast<std::size_t>(&group - groups_.data()));
}

std::optional<Time> RecordStore::last_heard() const {
    const Group* const best = shown();
    if (!best) return std::nullopt;
    Time latest = best->last_seen;
    for (const Group& group : groups_) {
        if (same_station(group.sender, best->sender)) {
            latest = std::max(latest, group.last_seen);
        }
    }
    return latest;
}

std::optional<ReceivedObject> RecordStore::snapshot() const {
    const Group* const group = shown();
    if (!group) return std::nullopt;
    return snapshot_of(*group);
}

ReceivedObject RecordStore::snapshot_of(const Group& group) {
    ReceivedObject object;
    object.id = group.object;
    object.hint = group.hint;
    object.description = group.description;
    const auto copy = [](const auto& table, auto& indices, auto& records) {
        indices.reserve(table.size());
        records.reserve(table.size());
        table.for_each([&](std::uint32_t index, const auto& record) {
            indices.push_back(index);
            records.push_back(record);
        });
    };
    copy(group.ellipsoids, object.ellipsoid_index, object.ellipsoids);
    copy(group.vertices, object.vertex_index, object.vertices);
    object.edges.assign(group.edges.edges().begin(), group.edges.edges().end());
    return object;
}

}  // namespace ellicast::receiver
