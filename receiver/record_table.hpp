// receiver/record_table.hpp
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <map>
#include <span>
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

/// Whether the records are the same, bit for bit. Requires as many of both (asserted).
template <class Record>
bool same_bits(std::span<const Record> a, std::span<const Record> b) {
    assert(a.size() == b.size());
    return std::memcmp(std::as_bytes(a).data(), std::as_bytes(b).data(), a.size_bytes()) == 0;
}
// Without padding, so that equal records have equal bytes.
static_assert(sizeof(protocol::EllipsoidRecord) == 36 && sizeof(protocol::VertexRecord) == 20);

enum class Insertion {
    fresh,        // the index was not there
    same,         // it was, with the same bits
    conflicting,  // it was, with other bits
    refused       // no memory left for it; nothing changed
};

/// What became of several records.
struct InsertionCounts {
    std::size_t same = 0;
    std::size_t refused = 0;

    void add(Insertion outcome) {
        same += outcome == Insertion::same ? 1 : 0;
        refused += outcome == Insertion::refused ? 1 : 0;
    }
    InsertionCounts& operator+=(const InsertionCounts& other) {
        same += other.same;
        refused += other.refused;
        return *this;
    }
};

/// The records of one kind of one object by index. Content and disputes are functions of the set of
/// (index, record) pairs inserted, in whatever order and however often: of several records with one
/// index the bytewise smallest big-endian form is kept. Memory follows what arrived, not what a
/// hint claims: an ordered map of chunks of eight until one index in 16 is there, a flat array from
/// then on. So a received record costs at most about 16 records' bytes.
template <class Record>
class RecordTable {
  public:
    explicit RecordTable(std::uint32_t expected) : expected_(expected) {}

    /// Requires index < expected (asserted). Logarithmic while sparse, constant when dense.
    Insertion insert(std::uint32_t index, const Record& record, MemoryBudget& budget);

    /// The same for records with indices first, first + stride, ..., all of them below expected
    /// (asserted). Neighbours that are all new to a dense table, or all known to it, go in at once.
    InsertionCounts insert_run(std::uint32_t first, std::uint32_t stride,
                               std::span<const Record> records, MemoryBudget& budget);

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
    // Neighbours, which mostly come together. Few, for a lonely record takes the room of all.
    struct Chunk {
        std::array<Record, 8> records{};
        std::uint8_t present = 0;  // bit k: record k
        std::uint8_t disputed = 0;
    };
    static constexpr std::uint32_t kChunk = 8;
    static constexpr std::size_t kDenseShare = 16;
    // A red-black node: three pointers and a colour, the pair, and the allocator's own 16 bytes.
    static constexpr std::size_t kChunkBytes = 48 + sizeof(std::pair<const std::uint32_t, Chunk>);

    static std::uint64_t bit(std::uint32_t index) { return std::uint64_t{1} << (index % 64); }
    [[nodiscard]] std::size_t words() const { return (std::size_t{expected_} + 63) / 64; }
    [[nodiscard]] std::size_t dense_bytes() const {
        return expected_ * sizeof(Record) + 2 * words() * sizeof(std::uint64_t);
    }
    [[nodiscard]] bool is_dense() const { return !dense_.empty(); }

    static std::uint8_t chunk_bit(std::uint32_t index) {
        return static_cast<std::uint8_t>(1u << index % kChunk);
    }

    Insertion insert_one(std::uint32_t index, const Record& record, MemoryBudget& budget,
                         Chunk*& latest);
    Insertion insert_sparse(std::uint32_t index, const Record& record, Chunk& chunk);
    Chunk* chunk_of(std::uint32_t index, MemoryBudget& budget);
    Insertion insert_dense(std::uint32_t index, const Record& record);
    bool insert_together(std::uint32_t first, std::span<const Record> records,
                         InsertionCounts& counts);
    void densify(MemoryBudget& budget);
    void dispute(std::uint32_t index);

    template <class Visit>
    void visit_entries(Visit&& visit) const;

    std::uint32_t expected_;
    std::size_t size_ = 0;
    std::size_t disputed_count_ = 0;
    std::size_t bytes_ = 0;
    std::map<std::uint32_t, Chunk> sparse_;  // by index / kChunk
    std::vector<Record> dense_;              // by index, when dense
    std::vector<std::uint64_t> present_;
    std::vector<std::uint64_t> disputed_;
};

template <class Record>
Insertion RecordTable<Record>::insert(std::uint32_t index, const Record& record,
                                      MemoryBudget& budget) {
    Chunk* none = nullptr;
    return insert_one(index, record, budget, none);
}

template <class Record>
InsertionCounts RecordTable<Record>::insert_run(std::uint32_t first, std::uint32_t stride,
                                                std::span<const Record> records,
                                                MemoryBudget& budget) {
    InsertionCounts counts;
    Chunk* latest = nullptr;
    while (!records.empty()) {
        // As many as one word of bits speaks of.
        const std::size_t block =
            stride == 1 ? std::min<std::size_t>(records.size(), 64 - first % 64) : records.size();
        const auto now = records.first(block);
        if (stride != 1 || !is_dense() || !insert_together(first, now, counts)) {
            for (std::size_t k = 0; k < block; ++k) {
                const auto index = first + static_cast<std::uint32_t>(k) * stride;
                if (k == 0 || index / kChunk != (index - stride) / kChunk) latest = nullptr;
                counts.add(insert_one(index, now[k], budget, latest));
            }
        }
        records = records.subspan(block);
        first += static_cast<std::uint32_t>(block);
    }
    return counts;
}

// `latest` is the chunk of this index where that is known, and known afterwards.
template <class Record>
Insertion RecordTable<Record>::insert_one(std::uint32_t index, const Record& record,
                                          MemoryBudget& budget, Chunk*& latest) {
    assert(index < expected_);
    if (is_dense()) return insert_dense(index, record);
    if (latest == nullptr) latest = chunk_of(index, budget);
    const Insertion outcome =
        latest == nullptr ? Insertion::refused : insert_sparse(index, record, *latest);
    if (size_ * kDenseShare >= expected_) densify(budget);
    return outcome;
}

// Requires neighbours of one word. False, and nothing done, when they must go one by one.
template <class Record>
bool RecordTable<Record>::insert_together(std::uint32_t first, std::span<const Record> records,
                                          InsertionCounts& counts) {
    assert(!records.empty() && first + records.size() <= expected_);
    const std::uint64_t run = ~std::uint64_t{0} >> (64 - records.size()) << first % 64;
    std::uint64_t& word = present_[first / 64];
    Record* const kept = dense_.data() + first;
    if ((word & run) == 0) {
        std::copy(records.begin(), records.end(), kept);
        word |= run;
        size_ += records.size();
        return true;
    }
    if ((word & run) != run) return false;
    const bool same = same_bits(records, std::span<const Record>(kept, records.size()));
    if (same) counts.same += records.size();
    return same;
}

// Null when there is none and no memory for one.
template <class Record>
typename RecordTable<Record>::Chunk* RecordTable<Record>::chunk_of(std::uint32_t index,
                                                                   MemoryBudget& budget) {
    const std::uint32_t key = index / kChunk;
    const auto place = sparse_.lower_bound(key);
    if (place != sparse_.end() && place->first == key) return &place->second;
    if (!budget.take(kChunkBytes, bytes_)) return nullptr;
    bytes_ += kChunkBytes;
    return &sparse_.emplace_hint(place, key, Chunk{})->second;
}

template <class Record>
Insertion RecordTable<Record>::insert_sparse(std::uint32_t index, const Record& record,
                                             Chunk& chunk) {
    Record& kept = chunk.records[index % kChunk];
    if ((chunk.present & chunk_bit(index)) == 0) {
        chunk.present |= chunk_bit(index);
        kept = record;
        ++size_;
        return Insertion::fresh;
    }
    if (order_of(record) == order_of(kept)) return Insertion::same;
    if (order_of(record) < order_of(kept)) kept = record;
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
    for (const auto& [key, chunk] : sparse_) {
        const std::size_t word = key * kChunk / 64;
        const std::size_t shift = key * kChunk % 64;
        const std::size_t inside = std::min<std::size_t>(kChunk, expected_ - key * kChunk);
        std::copy_n(chunk.records.begin(), inside, dense_.begin() + key * kChunk);
        present_[word] |= std::uint64_t{chunk.present} << shift;
        disputed_[word] |= std::uint64_t{chunk.disputed} << shift;
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
        Chunk& chunk = sparse_.at(index / kChunk);
        if ((chunk.disputed & chunk_bit(index)) == 0) ++disputed_count_;
        chunk.disputed |= chunk_bit(index);
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
    for (const auto& [key, chunk] : sparse_) {
        for (std::uint32_t index = key * kChunk; index < (key + 1) * kChunk; ++index) {
            if ((chunk.present & chunk_bit(index)) == 0) continue;
            visit(index, chunk.records[index % kChunk], (chunk.disputed & chunk_bit(index)) != 0);
        }
    }
    for (std::size_t w = 0; w < present_.size(); ++w) {
        for (std::uint64_t rest = present_[w]; rest != 0; rest &= rest - 1) {
            const auto index = static_cast<std::uint32_t>(
                64 * w + static_cast<std::size_t>(std::countr_zero(rest)));
            visit(index, dense_[index], (disputed_[w] & bit(index)) != 0);
        }
    }
}

}  // namespace ellicast::receiver
