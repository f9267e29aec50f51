// tests/receiver/record_table_test.cpp
#include "receiver/record_table.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <map>

#include "common/random.hpp"

using namespace ellicast;
using protocol::VertexRecord;
using receiver::Insertion;
using receiver::InsertionCounts;
using receiver::MemoryBudget;

namespace {

using Table = receiver::RecordTable<VertexRecord>;

/// One of few records, so that indices come again with the same bits and with others.
VertexRecord some_record(common::Random& random) {
    VertexRecord record;
    record.position[0] = static_cast<float>(random.below(2));
    return record;
}

std::map<std::uint32_t, float> content_of(const Table& table) {
    std::map<std::uint32_t, float> content;
    table.for_each([&](std::uint32_t index, const VertexRecord& record) {
        content[index] = record.position[0];
    });
    return content;
}

}  // namespace

TEST_CASE("a run of records does what its records do one by one, sparse and dense") {
    for (const std::uint32_t expected : {1u, 7u, 64u, 65u, 1000u, 20'000u}) {
        common::Random random(expected);
        MemoryBudget budget(1 << 24);
        Table runs(expected);
        Table singles(expected);
        for (int round = 0; round < 60; ++round) {
            const auto first = static_cast<std::uint32_t>(random.below(expected));
            const auto stride =
                static_cast<std::uint32_t>(random.chance(0.5) ? 1 : 1 + random.below(70));
            const std::size_t count =
                std::min<std::size_t>(1 + random.below(200), (expected - 1 - first) / stride + 1);
            std::vector<VertexRecord> records;
            const VertexRecord common = some_record(random);
            const bool alike = random.chance(0.7);
            for (std::size_t k = 0; k < count; ++k) {
                records.push_back(alike ? common : some_record(random));
            }
            const InsertionCounts together = runs.insert_run(first, stride, records, budget);
            InsertionCounts apart;
            for (std::size_t k = 0; k < count; ++k) {
                const auto index = first + static_cast<std::uint32_t>(k) * stride;
                apart.add(singles.insert(index, records[k], budget));
            }
            CAPTURE(expected, round, first, stride, count);
            REQUIRE(together.same == apart.same);
            REQUIRE(together.refused == apart.refused);
            REQUIRE(runs.size() == singles.size());
            REQUIRE(runs.conflicting() == singles.conflicting());
            REQUIRE(runs.bytes() == singles.bytes());
        }
        CHECK(content_of(runs) == content_of(singles));
        CHECK(runs.conflicting() > 0);
    }
}

TEST_CASE("what a table without memory refuses is counted, and the rest of the run goes in") {
    MemoryBudget budget(1000);  // half of it for one table: a chunk or two
    Table table(100'000);
    const std::vector<VertexRecord> records(64);
    const InsertionCounts counts = table.insert_run(0, 1, records, budget);
    CHECK(counts.refused > 0);
    CHECK(counts.refused + table.size() == records.size());
    CHECK(table.size() > 0);
    CHECK(content_of(table).size() == table.size());
}

TEST_CASE("lonely records of a sparse table take no more than sixteen records' bytes each") {
    MemoryBudget budget(1 << 24);
    Table table(1'000'000);
    for (std::uint32_t k = 0; k < 100; ++k) {
        REQUIRE(table.insert(9973 * k, {}, budget) == Insertion::fresh);
    }
    CHECK(table.bytes() <= 100 * 16 * sizeof(VertexRecord));
}
