// tests/receiver/edge_set_test.cpp
#include "receiver/edge_set.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <vector>

#include "common/random.hpp"

namespace ellicast::receiver {
namespace {

using protocol::EdgeRecord;

std::vector<EdgeRecord> random_edges(std::size_t count, std::uint64_t seed) {
    common::Random random(seed);
    std::vector<EdgeRecord> edges(count);
    for (EdgeRecord& edge : edges) {
        edge.among = 100 + static_cast<std::uint32_t>(random.below(3));
        edge.b = 1 + static_cast<std::uint32_t>(random.below(99));
        edge.a = static_cast<std::uint32_t>(random.below(edge.b));
    }
    return edges;
}

std::vector<EdgeRecord> kept_of(const std::vector<EdgeRecord>& edges, std::uint32_t vertices) {
    MemoryBudget budget(1 << 20);
    EdgeSet set(vertices);
    for (const EdgeRecord& edge : edges) CHECK(set.insert(edge, budget));
    return {set.edges().begin(), set.edges().end()};
}

}  // namespace

TEST_CASE("what is kept of the edges depends neither on order nor on copies") {
    for (const std::uint32_t vertices : {100u, 5'000u}) {  // at most 64 and 312
        for (std::uint64_t seed = 1; seed <= 20; ++seed) {
            CAPTURE(vertices, seed);
            std::vector<EdgeRecord> edges = random_edges(300, seed);
            std::vector<EdgeRecord> sorted = edges;
            std::sort(sorted.begin(), sorted.end());
            sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
            sorted.resize(std::min<std::size_t>(sorted.size(), vertices == 100 ? 64 : 312));
            CHECK(kept_of(edges, vertices) == sorted);
            std::reverse(edges.begin(), edges.end());
            edges.insert(edges.end(), sorted.begin(), sorted.end());
            CHECK(kept_of(edges, vertices) == sorted);
        }
    }
}

TEST_CASE("the memory of edges is taken and given back") {
    MemoryBudget budget(1 << 20);
    EdgeSet a(100'000);
    EdgeSet b(100'000);
    for (const EdgeRecord& edge : random_edges(500, 1)) REQUIRE(a.insert(edge, budget));
    for (const EdgeRecord& edge : random_edges(500, 2)) REQUIRE(b.insert(edge, budget));
    const std::size_t before = budget.used();
    CHECK(before >= (a.size() + b.size()) * sizeof(EdgeRecord));
    CHECK(a.merge(b, budget));
    b.release(budget);
    CHECK(b.size() == 0);
    CHECK(budget.used() <= before);
    a.release(budget);
    CHECK(budget.used() == 0);
}

TEST_CASE("edges beyond the memory are refused, those that are there stay") {
    MemoryBudget budget(2'000);
    EdgeSet set(100'000);
    std::size_t taken = 0;
    for (const EdgeRecord& edge : random_edges(500, 3)) taken += set.insert(edge, budget) ? 1 : 0;
    CHECK(taken < 500);
    CHECK(set.size() > 0);
    CHECK(budget.used() <= 2'000);
}

}  // namespace ellicast::receiver
