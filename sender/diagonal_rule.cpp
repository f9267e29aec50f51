// sender/diagonal_rule.cpp
#include "sender/diagonal_rule.hpp"

#include <algorithm>
#include <cstddef>
#include <vector>

#include "common/diagonal_choice.hpp"
#include "common/parallel.hpp"
#include "sender/diagonal_quads.hpp"

namespace ellicast::sender {
namespace {

// Of more half-edges, evenly chosen ones speak for all: the sums of the rules differ by far more
// than by what is left to chance in half a million of them.
constexpr std::size_t kMostHalfEdges = 1u << 19;

// Of which a sum is made, whoever makes it.
constexpr std::size_t kPart = 1u << 13;

}  // namespace

RuleCosts rule_costs(const common::TriangleMesh& solid, const Quads& quads, bool tagged,
                     unsigned threads) {
    const double unit = common::mean_edge_length(solid);
    std::array<common::DiagonalWeights, common::kDiagonalRules> weights;
    for (std::uint8_t rule = 0; rule < common::kDiagonalRules; ++rule) {
        weights[rule] = common::diagonal_weights(rule, tagged, 0.0);
    }
    const std::size_t step = std::max<std::size_t>(1, 3 * solid.triangles.size() / kMostHalfEdges);
    const auto cost_of = [&](std::size_t begin, std::size_t end) {
        RuleCosts costs{};
        for (std::size_t i = begin; i < end; i += step) {
            const auto h = static_cast<HalfEdge>(i);
            if (!quads.has_quad(h)) continue;
            const common::DiagonalGain gain = common::diagonal_gain(quads.quad(h));
            const double wrong = quads.wrong_diagonal(h);
            for (std::size_t rule = 0; rule < common::kDiagonalRules; ++rule) {
                const double gained = gain.weighed(weights[rule].angle, weights[rule].rise, unit);
                if (gained > common::kLeastDiagonalGain * unit) costs[rule] += wrong;
            }
        }
        return costs;
    };
    RuleCosts sums{};
    for (const RuleCosts& part :
         common::in_parts(quads.half_edges(), step * kPart, threads, cost_of)) {
        for (std::size_t rule = 0; rule < sums.size(); ++rule) sums[rule] += part[rule];
    }
    for (double& sum : sums) sum *= static_cast<double>(step);
    return sums;
}

std::uint8_t best_diagonal_rule(const RuleCosts& costs) {
    return static_cast<std::uint8_t>(std::min_element(costs.begin(), costs.end()) - costs.begin());
}

}  // namespace ellicast::sender
