// receiver/record_table.hpp
#pragma once

#include <array>
#include <bit>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "protocol/datagram.hpp"

namespace ellicast::receiver {

/// Bytes that all tables together may hold. No table may hold more than stays free for the others:
/// one alone gets half, and whoever comes later still gets something.
class MemoryBudget {
  public:
    explicit MemoryBudget(std::size_t limit) : limit_(limit) {}

    /// For a table that holds `held` bytes already. False, and nothing taken, when it is too much.
    [[nodiscard]] bool take(std::size_t bytes, std::size_t held) {
        const std::size_t free = limit_ - used_;
        if (bytes > free || held + bytes > free - bytes) return false;
        used_ += bytes;
        return true;
    }
    void give_back(std::size_t bytes) {
        assert(bytes <= used_);
        used_ -= bytes;
    }
    [[nodiscard]] std::size_t used() const { return used_; }

  private:
    std::size_t limit_;
    std::size_t used_ = 0;
};

/// Keys that compare as the records' canonical bytes do (WIRE_FORMAT.md section 7), whatever the
/// machine.
inline std::array<std::uint32_t, 9> order_of(const protocol::EllipsoidRecord& record) {
    return std::bit_cast<std::array<std::uint32_t, 9>>(record.scalars);
}
inline std::array<std::uint32_t, 5> order_of(const protocol::VertexRecord& record) {
    const auto [x, y, z] = std::bit_cast<std::array<std::uint32_t, 3>>(record.position);
    const auto& [red, green, blue] = record.colour;
    return {x, y, z, std::uint32_t{record.normal} << 16 | record.ring,
            std::uint32_t{red} << 16 | std::uint32_t{green} << 8 | blue};
}

enum class Insertion {
    fresh,        // the index was not there
    same,         // it was, with the same bits
    conflicting,  // it was, with other bits
    refused       // no memory left for it; nothing changed
};

/// The records of one kind of one object by index. Content and disputes are functions of the set of
/// (index, record) pairs inserted, in whatever order and however often: of several records with one
/// index the bytewise smallest big-endian form is kept. Memory follows what arrived, not what a
/// hint claims: an ordered map until one index in 16 is there, a flat array from then on. So a
/// received record costs at most about 16 records' bytes.
template <class Record>
class RecordTable {
  public:
    explicit RecordTable(std::uint32_t expected) : expected_(expected) {}

    /// Requires index < expected (asserted). Logarithmic while sparse, constant when dense.
    Insertion insert(std::uint32_t index, const Record& record, MemoryBudget& budget);

    /// Inserts all of `other`, disputes too. False when memory ran out on the way.
    bool merge(const RecordTable& other, MemoryBudget& budget);

    /// Gives everything back; the table is empty then.
    void release(MemoryBudget& budget);

    [[nodiscard]] std::uint32_t expected() const { return expected_; }
    [[nodiscard]] std::size_t size() const { return size_; }  // distinct indices
    [[nodiscard]] bool complete() const { return size_ == expected_; }
    [[nodiscard]] std::size_t conflicting() const { return disputed_count_; }  // indices
    [[nodiscard]] std::size_t bytes() const { return bytes_; }  // as taken from the budget

    /// Calls visit(index, record) in ascending order of index.
    template <class Visit>
    void for_each(Visit&& visit) const {
        visit_entries(
            [&](std::uint32_t index, const Record& record, bool) { visit(index, record); });
    }

  private:
    struct Entry {
        Record record;
        bool disputed = false;
    };
    static constexpr std::size_t kDenseShare = 16;
    // A red-black node: three pointers and a colour, the pair, and the allocator's own 16 bytes.
    static constexpr std::size_t kSparseBytes = 48 + sizeof(std::pair<const std::uint32_t, Entry>);

    static std::uint64_t bit(std::uint32_t index) { return std::uint64_t{1} << (index % 64); }
    [[nodiscard]] std::size_t words() const { return (std::size_t{expected_} + 63) / 64; }
    [[nodiscard]] std::size_t dense_bytes() const {
        return expected_ * sizeof(Record) + 2 * words() * sizeof(std::uint64_t);
    }
    [[nodiscard]] bool is_dense() const { return !dense_.empty(); }

    Insertion insert_sparse(std::uint32_t index, const Record& record, MemoryBudget& budget);
    Insertion insert_dense(std::uint32_t index, const Record& record);
    void densify(MemoryBudget& budget);
    void dispute(std::uint32_t index);

    template <class Visit>
    void visit_entries(Visit&& visit) const;

    std::uint32_t expected_;
    std::size_t size_ = 0;
    std::size_t disputed_count_ = 0;
    std::size_t bytes_ = 0;
    std::map<std::uint32_t, Entry> sparse_;
    std::vector<Record> dense_;  // by index, when dense
    std::vector<std::uint64_t> present_;
    std::vector<std::uint64_t> disputed_;
};

template <class Record>
Insertion RecordTable<Record>::insert(std::uint32_t index, const Record& record,
                                      MemoryBudget& budget) {
    assert(index < expected_);
    if (is_dense()) return insert_dense(index, record);
    const Insertion outcome = insert_sparse(index, record, budget);
    if (size_ * kDenseShare >= expected_) densify(budget);
    return outcome;
}

template <class Record>
Insertion RecordTable<Record>::insert_sparse(std::uint32_t index, const Record& record,
                                             MemoryBudget& budget) {
    const auto place = sparse_.lower_bound(index);
    if (place == sparse_.end() || place->first != index) {
        if (!budget.take(kSparseBytes, bytes_)) return Insertion::refused;
        bytes_ += kSparseBytes;
        sparse_.emplace_hint(place, index, Entry{record});
        ++size_;
        return Insertion::fresh;
    }
    Entry& entry = place->second;
    if (order_of(record) == order_of(entry.record)) return Insertion::same;
    if (order_of(record) < order_of(entry.record)) entry.record = record;
    dispute(index);
    return Insertion::conflicting;
}

template <class Record>
Insertion RecordTable<Record>::insert_dense(std::uint32_t index, const Record& record) {
    std::uint64_t& word = present_[index / 64];
    Record& kept = dense_[index];
    if ((word & bit(index)) == 0) {
        word |= bit(index);
        kept = record;
        ++size_;
        return Insertion::fresh;
    }
    if (order_of(record) == order_of(kept)) return Insertion::same;
    if (order_of(record) < order_of(kept)) kept = record;
    dispute(index);
    return Insertion::conflicting;
}

// Stays sparse when the budget cannot hold both forms for a moment. What the sparse form holds does
// not count against the table's share, for it goes back at once.
template <class Record>
void RecordTable<Record>::densify(MemoryBudget& budget) {
    if (!budget.take(dense_bytes(), 0)) return;
    present_.resize(words());
    disputed_.resize(words());
    dense_.resize(expected_);
    for (const auto& [index, entry] : sparse_) {
        dense_[index] = entry.record;
        present_[index / 64] |= bit(index);
        if (entry.disputed) disputed_[index / 64] |= bit(index);
    }
    sparse_.clear();
    budget.give_back(bytes_);
    bytes_ = dense_bytes();
}

template <class Record>
void RecordTable<Record>::dispute(std::uint32_t index) {
    if (is_dense()) {
        std::uint64_t& word = disputed_[index / 64];
        if ((word & bit(index)) == 0) ++disputed_count_;
        word |= bit(index);
    } else {
        Entry& entry = sparse_.at(index);
        if (!entry.disputed) ++disputed_count_;
        entry.disputed = true;
    }
}

template <class Record>
bool RecordTable<Record>::merge(const RecordTable& other, MemoryBudget& budget) {
    assert(other.expected_ == expected_);
    bool whole = true;
    other.visit_entries([&](std::uint32_t index, const Record& record, bool disputed) {
        if (insert(index, record, budget) == Insertion::refused) {
            whole = false;
        } else if (disputed) {
            dispute(index);
        }
    });
    return whole;
}

template <class Record>
void RecordTable<Record>::release(MemoryBudget& budget) {
    budget.give_back(bytes_);
    *this = RecordTable(expected_);
}

template <class Record>
template <class Visit>
void RecordTable<Record>::visit_entries(Visit&& visit) const {
    for (const auto& [index, entry] : sparse_) visit(index, entry.record, entry.disputed);
    for (std::size_t w = 0; w < present_.size(); ++w) {
        for (std::uint64_t rest = present_[w]; rest != 0; rest &= rest - 1) {
            const auto index = static_cast<std::uint32_t>(
                64 * w + static_cast<std::size_t>(std::countr_zero(rest)));
            visit(index, dense_[index], (disputed_[w] & bit(index)) != 0);
        }
    }
}

}  // namespace ellicast::receiver
