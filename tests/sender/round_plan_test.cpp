// tests/sender/round_plan_test.cpp
#include "sender/round_plan.hpp"

#include <algorithm>
#include <bitset>
#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "tests/sender/made_objects.hpp"

namespace ellicast::sender {
namespace {

using tests::made_object;

/// Everything that a round says, datagram by datagram, after the protocol's own checks.
struct ReadDatagram {
    std::size_t bytes = 0;
    protocol::DatagramHeader header;
    std::vector<std::uint32_t> ellipsoids;
    std::vector<std::uint32_t> vertices;
    std::vector<std::uint32_t> strides;  // of the sections of vertices
    std::vector<protocol::EdgeRecord> edges;
    std::optional<protocol::Description> description;
};

ReadDatagram read(const RoundPlan& plan, std::uint32_t round, std::uint32_t ordinal) {
    const std::vector<std::uint8_t> bytes = plan.datagram(round, ordinal, {});
    const auto view = protocol::parse_datagram(bytes);
    REQUIRE(view.has_value());
    ReadDatagram datagram;
    datagram.bytes = bytes.size();
    datagram.header = view->header;
    bool records_match = true;
    for (const protocol::SectionView& section : view->sections()) {
        if (section.kind == protocol::SectionKind::description) {
            datagram.description = section.description();
            continue;
        }
        if (section.kind == protocol::SectionKind::edges) {
            for (std::size_t k = 0; k < section.count; ++k) {
                datagram.edges.push_back(section.edge(k));
            }
            continue;
        }
        const bool ellipsoids = section.kind == protocol::SectionKind::ellipsoids;
        if (!ellipsoids) datagram.strides.push_back(section.stride);
        for (std::size_t k = 0; k < section.count; ++k) {
            const std::uint32_t index = section.index(k);
            (ellipsoids ? datagram.ellipsoids : datagram.vertices).push_back(index);
            records_match &= ellipsoids ? section.ellipsoid(k) == plan.object().ellipsoids[index]
                                        : section.vertex(k) == plan.object().vertices[index];
        }
    }
    REQUIRE(records_match);
    return datagram;
}

std::vector<ReadDatagram> read_round(const RoundPlan& plan, std::uint32_t round) {
    std::vector<ReadDatagram> datagrams;
    for (std::uint32_t k = 0; k < plan.datagrams(); ++k) {
        datagrams.push_back(read(plan, round, k));
    }
    return datagrams;
}

/// What must hold in any round of any plan.
void check_round(const RoundPlan& plan, const PlanOptions& options, std::uint32_t round) {
    const std::vector<ReadDatagram> datagrams = read_round(plan, round);
    std::vector<std::size_t> ellipsoids(plan.object().ellipsoids.size(), 0);
    std::vector<std::size_t> vertices(plan.object().vertices.size(), 0);
    std::map<protocol::EdgeRecord, std::size_t> edges;
    std::size_t without_description = 0;
    std::size_t without_ellipsoids = 0;
    for (std::uint32_t k = 0; k < datagrams.size(); ++k) {
        const ReadDatagram& datagram = datagrams[k];
        REQUIRE(datagram.bytes <= options.datagram_bytes);
        REQUIRE(datagram.header.round == round);
        REQUIRE(datagram.header.ordinal == k);
        REQUIRE(datagram.header.datagrams == datagrams.size());
        REQUIRE(datagram.header.rtp.marker == (k + 1 == datagrams.size()));
        REQUIRE(datagram.header.object == plan.object().id);
        REQUIRE(datagram.header.hint == plan.object().hint);
        const bool has_records = !datagram.ellipsoids.empty() || !datagram.vertices.empty();
        REQUIRE((has_records || datagram.description || !datagram.edges.empty()));
        for (const protocol::EdgeRecord& edge : datagram.edges) ++edges[edge];
        for (const std::uint32_t index : datagram.ellipsoids) ++ellipsoids[index];
        for (const std::uint32_t index : datagram.vertices) ++vertices[index];

        without_description = datagram.description ? 0 : without_description + 1;
        REQUIRE(without_description < plan.description_interval());
        without_ellipsoids = datagram.ellipsoids.empty() ? without_ellipsoids + 1 : 0;
        if (options.copies > 1) REQUIRE(without_ellipsoids < 8);
    }
    REQUIRE(datagrams.front().description.has_value());
    const auto all_are = [](const std::vector<std::size_t>& counts, std::size_t value) {
        return std::all_of(counts.begin(), counts.end(),
                           [value](std::size_t count) { return count == value; });
    };
    REQUIRE(all_are(ellipsoids, plan.copies()));
    if (options.redundancy == 1.0) {
        REQUIRE(all_are(vertices, 1));
    } else {
        REQUIRE(std::count(vertices.begin(), vertices.end(), 0u) == 0);
    }
    REQUIRE(edges.size() == plan.object().edges.size());
    for (const auto& [edge, count] : edges) REQUIRE(count == 2);
    REQUIRE(plan.copies() >= options.copies);
    if (options.copies == 1) REQUIRE(plan.copies() == 1);
}

/// The object with so many edges, on three levels.
BroadcastObject with_edges(BroadcastObject object, std::size_t count, std::uint64_t seed) {
    common::Random random(seed);
    const auto vertices = static_cast<std::uint32_t>(object.vertices.size());
    std::set<protocol::EdgeRecord> edges;
    while (vertices > 8 && edges.size() < count) {
        protocol::EdgeRecord edge;
        edge.among = vertices >> random.below(3);
        edge.b = 1 + static_cast<std::uint32_t>(random.below(edge.among - 1));
        edge.a = static_cast<std::uint32_t>(random.below(edge.b));
        edges.insert(edge);
    }
    object.edges.assign(edges.begin(), edges.end());
    return object;
}

}  // namespace

TEST_CASE("every record is in a round exactly as often as promised, whatever the sizes") {
    const std::uint64_t seed = GENERATE(range<std::uint64_t>(1, 61));
    common::Random random(seed);
    const auto log_uniform = [&](double low, double high) {
        return static_cast<std::size_t>(low * std::pow(high / low, random.uniform()));
    };
    PlanOptions options;
    options.rounds = 3;
    options.datagram_bytes = log_uniform(576.0, 9000.0);
    options.copies = 1 + random.below(6);
    options.bits_per_second = random.chance(0.2) ? 0 : log_uniform(1.0e4, 1.0e9);
    const std::size_t ellipsoids = log_uniform(1.0, 3000.0);
    const std::size_t vertices = log_uniform(2.0, 40'000.0);
    CAPTURE(seed, options.datagram_bytes, options.copies, options.bits_per_second, ellipsoids,
            vertices);
    const RoundPlan plan(made_object(ellipsoids, vertices, seed), options);
    for (std::uint32_t round = 0; round < 3; ++round) check_round(plan, options, round);
}

TEST_CASE("every edge is in every round twice, first in the first half of its body") {
    const std::uint64_t seed = GENERATE(range<std::uint64_t>(1, 31));
    common::Random random(seed);
    PlanOptions options;
    options.rounds = 3;
    options.datagram_bytes = random.chance(0.3) ? 576 : 576 + random.below(4000);
    options.copies = 1 + random.below(4);
    options.redundancy = random.chance(0.3) ? 1.5 : 1.0;
    const std::size_t vertices = 20 + random.below(20'000);
    const std::size_t count = 1 + vertices / (20 + random.below(200));
    CAPTURE(seed, options.datagram_bytes, options.copies, vertices, count);
    const RoundPlan plan(
        with_edges(made_object(1 + random.below(500), vertices, seed), count, seed), options);
    for (std::uint32_t round = 0; round < 3; ++round) check_round(plan, options, round);
    std::set<protocol::EdgeRecord> early;
    for (std::uint32_t k = 0; k <= plan.datagrams() / 2 + plan.object().ellipsoids.size() / 10;
         ++k) {
        if (k >= plan.datagrams()) break;
        const ReadDatagram datagram = read(plan, 0, k);
        early.insert(datagram.edges.begin(), datagram.edges.end());
    }
    CHECK(early.size() == plan.object().edges.size());
}

TEST_CASE("edges find their way beside a description that leaves hardly any room") {
    BroadcastObject object = with_edges(made_object(50, 400), 40, 1);
    object.description.name = std::string(255, 'x');
    object.description.unit = std::string(100, 'y');
    PlanOptions options;
    options.datagram_bytes = 576;
    const RoundPlan plan(object, options);
    std::size_t edges = 0;
    for (const ReadDatagram& datagram : read_round(plan, 0)) {
        CHECK(datagram.bytes <= 576);
        edges += datagram.edges.size();
    }
    CHECK((edges == 2 * object.edges.size() || edges == 0));
}

TEST_CASE("the smallest and the most lopsided objects make whole rounds") {
    const auto [ellipsoids, vertices] = GENERATE(
        std::pair<std::size_t, std::size_t>{1, 2}, std::pair<std::size_t, std::size_t>{1, 5000},
        std::pair<std::size_t, std::size_t>{400, 2}, std::pair<std::size_t, std::size_t>{5000, 2},
        std::pair<std::size_t, std::size_t>{5, 40'000});
    PlanOptions options;
    options.copies = GENERATE(1u, 2u, 3u, 9u);
    options.rounds = 0;
    options.datagram_bytes = GENERATE(576u, 1200u, 65507u);
    CAPTURE(ellipsoids, vertices, options.copies, options.datagram_bytes);
    const RoundPlan plan(made_object(ellipsoids, vertices), options);
    for (const std::uint32_t round : {0u, 1u, 77u}) check_round(plan, options, round);
}

TEST_CASE("ellipsoids come first, then vertices in index order with stride one") {
    const RoundPlan plan(made_object(400, 48'485), PlanOptions{});
    const std::vector<ReadDatagram> datagrams = read_round(plan, 0);
    std::set<std::uint32_t> seen;
    std::size_t head = 0;
    while (seen.size() < 400) {
        REQUIRE_FALSE(datagrams[head].ellipsoids.empty());
        seen.insert(datagrams[head].ellipsoids.begin(), datagrams[head].ellipsoids.end());
        ++head;
    }
    CHECK(head <= 15);
    std::uint32_t next = 0;
    for (const ReadDatagram& datagram : datagrams) {
        for (const std::uint32_t index : datagram.vertices) REQUIRE(index == next++);
        for (const std::uint32_t stride : datagram.strides) REQUIRE(stride == 1);
    }
    // 84 vertices a datagram would be 578, the ellipsoids' own bytes 36 more.
    CHECK(datagrams.size() <= 635);
}

TEST_CASE("later rounds change strides, starts and the places of ellipsoids, never an index") {
    PlanOptions options;
    options.rounds = 0;
    const RoundPlan plan(made_object(100, 9000), options);
    std::set<std::vector<std::uint32_t>> first_vertices;
    std::set<std::vector<std::uint32_t>> first_ellipsoids;
    for (std::uint32_t round = 0; round < 6; ++round) {
        const ReadDatagram datagram = read(plan, round, 0);
        first_ellipsoids.insert(datagram.ellipsoids);
        first_vertices.insert(read(plan, round, plan.datagrams() - 3).vertices);
        for (const std::uint32_t stride : datagram.strides) CHECK(stride % 2 == 1);
    }
    CHECK(first_vertices.size() == 6);
    CHECK(first_ellipsoids.size() >= 3);
}

TEST_CASE("every datagram's vertices lie all over the model, in every round") {
    const std::size_t count = GENERATE(2000u, 12'288u, 20'000u);
    const std::vector<Eigen::Vector3d> points = tests::line_points(count);
    PlanOptions options;
    options.rounds = 0;
    const RoundPlan plan(make_object(tests::model_of(points), ShapePromise{},
                                     tests::balls_in(points, 60, 1), {"line", 1}),
                         options);
    for (std::uint32_t round = 0; round < 5; ++round) {
        for (const ReadDatagram& datagram : read_round(plan, round)) {
            // 62 vertices in at most two runs: one of them holds 31, so an aligned 16 of them.
            if (datagram.vertices.size() < 62) continue;
            std::bitset<16> sixteenths;
            for (const std::uint32_t index : datagram.vertices) {
                const double x = static_cast<double>(plan.object().vertices[index].position[0]);
                sixteenths.set(static_cast<std::size_t>(16.0 * x / static_cast<double>(count)));
            }
            CAPTURE(count, round, datagram.header.ordinal, sixteenths);
            REQUIRE(sixteenths.count() >= 15);
        }
    }
}

TEST_CASE("every section of ellipsoids is an even sample of the ranking") {
    const RoundPlan plan(made_object(400, 20'000), PlanOptions{});
    for (const ReadDatagram& datagram : read_round(plan, 0)) {
        const auto& ranks = datagram.ellipsoids;
        for (std::size_t k = 1; k < ranks.size(); ++k) {
            REQUIRE(ranks[k] - ranks[k - 1] == ranks[1] - ranks[0]);
        }
        if (ranks.size() < 2) continue;
        REQUIRE(ranks.front() < ranks[1] - ranks[0]);
        REQUIRE(ranks.back() + (ranks[1] - ranks[0]) >= 400);
    }
}

TEST_CASE("ellipsoids that are lost together in one copy are apart in the others") {
    const RoundPlan plan(made_object(400, 48'485), PlanOptions{});
    REQUIRE(plan.copies() == 3);
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> together;
    for (const ReadDatagram& datagram : read_round(plan, 0)) {
        for (const std::uint32_t a : datagram.ellipsoids) {
            for (const std::uint32_t b : datagram.ellipsoids) {
                if (a < b) ++together[{a, b}];
            }
        }
    }
    // In all three copies: only by all three numbers of classes dividing the distance of the ranks.
    const auto worst = std::max_element(together.begin(), together.end(),
                                        [](auto& a, auto& b) { return a.second < b.second; });
    CHECK(worst->second <= 2);
}

TEST_CASE("a large model gets more copies, for a few percent of its bytes") {
    const RoundPlan plan(made_object(100, 200'000), PlanOptions{});
    CHECK(plan.copies() > 3);
    std::size_t bytes = 0;
    std::size_t for_ellipsoids = 0;
    for (const ReadDatagram& datagram : read_round(plan, 0)) {
        bytes += datagram.bytes;
        for_ellipsoids += 36 * datagram.ellipsoids.size();
    }
    CHECK(static_cast<double>(for_ellipsoids) < 0.05 * static_cast<double>(bytes));
}

TEST_CASE("the description is repeated every 64 datagrams, and every 200 ms when that is sooner") {
    PlanOptions options;
    options.bits_per_second = 20'000'000;
    CHECK(RoundPlan(made_object(10, 5000), options).description_interval() == 64);
    options.bits_per_second = 0;
    CHECK(RoundPlan(made_object(10, 5000), options).description_interval() == 64);
    options.bits_per_second = 1'000'000;  // 100 datagrams of 1248 bytes a second
    CHECK(RoundPlan(made_object(10, 5000), options).description_interval() == 20);
    options.bits_per_second = 1000;
    CHECK(RoundPlan(made_object(10, 5000), options).description_interval() == 1);
}

TEST_CASE("a description too long for the datagram keeps its name and origin") {
    BroadcastObject object = made_object(10, 200);
    object.description.name = std::string(255, 'n');
    object.description.certificate = std::string(255, 'c');
    object.description.unit = "mm";
    object.description.sender_version = std::string(255, 'v');
    object.description.origin = {1.0, 2.0, 3.0};
    PlanOptions options;
    options.datagram_bytes = protocol::kMinDatagramBytes;
    const RoundPlan small(object, options);
    check_round(small, options, 0);
    const protocol::Description shown = *read(small, 0, 0).description;
    CHECK(shown.name == object.description.name);
    CHECK(shown.origin == object.description.origin);
    CHECK(shown.certificate.empty());
    const RoundPlan large(object, PlanOptions{});
    CHECK(read(large, 0, 0).description == object.description);
}

TEST_CASE("a datagram is a function of object, options, round and ordinal, and carries its stamp") {
    PlanOptions options;
    options.rounds = 2;
    options.session = {1, 2, 3, 4, 5, 6, 7, 8};
    const RoundPlan one(made_object(50, 3000), options);
    const RoundPlan two(made_object(50, 3000), options);
    const Stamp stamp{65535, 0xfedcba98u, 0x12345678u};
    for (std::uint32_t k = one.datagrams(); k-- > 0;) {  // backwards, as order must not matter
        REQUIRE(one.datagram(1, k, stamp) == two.datagram(1, k, stamp));
    }
    const std::vector<std::uint8_t> bytes = one.datagram(0, 3, stamp);
    const auto view = protocol::parse_datagram(bytes);
    REQUIRE(view.has_value());
    CHECK(view->header.rtp.sequence == 65535);
    CHECK(view->header.rtp.timestamp == 0xfedcba98u);
    CHECK(view->header.rtp.ssrc == 0x12345678u);
    CHECK(view->header.session == options.session);
    CHECK(view->header.rounds == 2);
    std::vector<std::uint8_t> stamped = one.datagram(0, 3, {0, 0, 0x12345678u});
    protocol::stamp(stamped, 65535, 0xfedcba98u);
    CHECK(stamped == bytes);
}

TEST_CASE("a redundant round has the bytes asked for, within a datagram, and breaks no promise") {
    const std::uint64_t seed = GENERATE(range<std::uint64_t>(1, 31));
    common::Random random(seed);
    PlanOptions options;
    options.rounds = random.chance(0.5) ? 1 : 3;
    options.datagram_bytes = 576 + random.below(2000);
    options.copies = 1 + random.below(4);
    const std::size_t ellipsoids = 1 + random.below(500);
    const std::size_t vertices = 2000 + random.below(20'000);
    CAPTURE(seed, options.rounds, options.datagram_bytes, options.copies, ellipsoids, vertices);
    const BroadcastObject object = made_object(ellipsoids, vertices, seed);
    const auto bytes_of = [](const RoundPlan& plan) {
        std::size_t bytes = 0;
        for (std::uint32_t k = 0; k < plan.datagrams(); ++k) {
            bytes += plan.datagram(0, k, {}).size();
        }
        return static_cast<double>(bytes);
    };
    const double plain = bytes_of(RoundPlan(object, options));
    options.redundancy = 1.0 + 2.0 * random.uniform();
    const RoundPlan plan(object, options);
    CAPTURE(options.redundancy, plain);
    CHECK(std::abs(bytes_of(plan) - options.redundancy * plain) <=
          static_cast<double>(options.datagram_bytes));
    for (std::uint32_t round = 0; round < options.rounds; ++round) {
        check_round(plan, options, round);
    }
}

TEST_CASE("copies follow in breadth before depth: three quarters, one quarter, all") {
    PlanOptions options;
    options.redundancy = GENERATE(1.1, 1.2, 1.5, 1.8, 2.0, 2.3, 2.7, 3.0);
    CAPTURE(options.redundancy);
    const std::size_t count = 8000;
    const RoundPlan plan(made_object(10, count), options);
    std::vector<std::uint32_t> sent;
    for (const ReadDatagram& datagram : read_round(plan, 0)) {
        sent.insert(sent.end(), datagram.vertices.begin(), datagram.vertices.end());
    }
    std::vector<std::uint32_t> wanted;
    for (const std::size_t pass : {count, 3 * count / 4, count / 4, count}) {
        for (std::uint32_t k = 0; k < pass; ++k) wanted.push_back(k);
    }
    wanted.resize(std::min(wanted.size(), sent.size()));
    sent.resize(wanted.size());  // the little that ellipsoids do not take of their share
    CHECK(sent == wanted);
    CHECK(static_cast<double>(sent.size()) >
          0.95 * options.redundancy * static_cast<double>(count));
}

TEST_CASE("a copy is never with its original, and far from it in every round") {
    PlanOptions options;
    options.rounds = 0;
    options.redundancy = GENERATE(1.05, 1.2, 1.75, 2.0, 3.0);
    const std::size_t count = GENERATE(2u, 50u, 91u, 92u, 400u, 3000u, 20'000u);
    CAPTURE(options.redundancy, count);
    const RoundPlan plan(made_object(5, count), options);
    for (std::uint32_t round = 0; round < 8; ++round) {
        const std::vector<ReadDatagram> datagrams = read_round(plan, round);
        std::vector<std::size_t> last(count, datagrams.size());
        std::vector<std::size_t> copies(count, 0);
        std::size_t nearest = datagrams.size();
        for (std::size_t k = 0; k < datagrams.size(); ++k) {
            REQUIRE(datagrams[k].bytes <= options.datagram_bytes);
            for (const std::uint32_t index : datagrams[k].vertices) {
                ++copies[index];
                if (last[index] < datagrams.size()) nearest = std::min(nearest, k - last[index]);
                last[index] = k;
            }
        }
        // Stopping anywhere is good: no vertex is there more often than one before it, but for
        // the one pass that comes again before others have come twice.
        for (std::size_t k = 1; k < count; ++k) REQUIRE(copies[k] <= copies[k - 1]);
        CAPTURE(round, nearest, datagrams.size());
        REQUIRE(nearest >= 1);
        // Of the vertices' datagrams a fifth; three quarters where no pass comes the second time.
        const double pass = static_cast<double>(datagrams.size()) / options.redundancy;
        if (count == 20'000 && options.redundancy >= 1.2)
            REQUIRE(static_cast<double>(nearest) > 0.2 * pass);
        if (count == 20'000 && options.redundancy == 1.75)
            REQUIRE(static_cast<double>(nearest) > 0.7 * pass);
    }
}

TEST_CASE("later rounds of a redundant plan copy the same vertices in other company") {
    PlanOptions options;
    options.rounds = 0;
    options.redundancy = 1.5;
    const RoundPlan plan(made_object(10, 20'000), options);
    std::set<std::vector<std::uint32_t>> last_datagrams;
    std::set<std::vector<std::uint32_t>> sent_often;
    for (std::uint32_t round = 0; round < 4; ++round) {
        const std::vector<ReadDatagram> datagrams = read_round(plan, round);
        last_datagrams.insert(datagrams.back().vertices);
        std::map<std::uint32_t, std::size_t> counts;
        for (const ReadDatagram& datagram : datagrams) {
            for (const std::uint32_t index : datagram.vertices) ++counts[index];
        }
        std::vector<std::uint32_t> often;
        for (const auto& [index, times] : counts) {
            if (times > 1) often.push_back(index);
        }
        sent_often.insert(often);
    }
    CHECK(last_datagrams.size() == 4);
    CHECK(sent_often.size() == 1);
}

TEST_CASE("laying out 2^26 vertices takes memory for datagrams, not for vertices") {
    LayoutSizes sizes;
    sizes.payload = 1200 - 93;
    sizes.description = 80;
    sizes.description_interval = 64;
    sizes.ellipsoids = 400;
    sizes.vertices = 1u << 26;
    sizes.copies = 3;
    const RoundLayout layout = lay_out(sizes);
    CHECK(layout.first_vertex.back() == sizes.vertices);
    CHECK(layout.datagrams() < 1.06 * static_cast<double>(1u << 26) / 91.0);
    sizes.redundancy = 3.0;
    CHECK(lay_out(sizes).first_vertex.back() > 2.9 * static_cast<double>(sizes.vertices));
}

}  // namespace ellicast::sender
