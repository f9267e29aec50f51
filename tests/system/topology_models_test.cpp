// tests/system/topology_models_test.cpp: the promised topology under loss, on the reference models.
#include <array>
#include <catch2/catch.hpp>

#include "receiver/reconstruction.hpp"
#include "tests/support/meshes.hpp"
#include "tests/support/simulation.hpp"

using namespace ellicast;

namespace {

constexpr unsigned kSeeds = 5;
constexpr std::array kModels = {"horse", "stanford-bunny", "rocker-arm",
                                "spot",  "fertility",      "homer"};

std::size_t right_of(const sender::BroadcastObject& object, double loss) {
    std::size_t right = 0;
    for (unsigned seed = 1; seed <= kSeeds; ++seed) {
        tests::BroadcastOptions how;
        how.impairment.drop = loss;
        how.impairment.seed = seed;
        const auto reception = tests::receive(tests::broadcast(object, how));
        if (!reception.object) continue;
        const auto result = receiver::reconstruct(*reception.object);
        right += result && result->topology_as_promised ? 1 : 0;
    }
    return right;
}

void check_models(int normal_bits) {
    const auto directory = tests::models_dir();
    if (!directory) {
        WARN("SKIPPED: no reference models here (set ELLICAST_MODELS)");
        return;
    }
    const std::array losses = {0.0, 0.1, 0.3, 0.5, 0.7, 0.9};
    std::array<std::size_t, losses.size()> right{};
    for (const char* name : kModels) {
        const auto model = tests::load_simulated(*directory / (std::string(name) + ".ply"), {},
                                                 {.normal_bits = normal_bits});
        for (std::size_t l = 0; l < losses.size(); ++l) {
            const std::size_t here = right_of(model.loaded.object, losses[l]);
            if (here < kSeeds) WARN(name << " at loss " << losses[l] << ": " << here);
            right[l] += here;
        }
    }
    for (std::size_t l = 0; l < losses.size(); ++l) {
        WARN(normal_bits << " bits, loss " << losses[l] << ": " << right[l] << " of 30");
        CHECK(right[l] >= 29);
    }
}

}  // namespace

TEST_CASE("with normals the topology is the promised one up to 90 % loss") {
    check_models(8);
}

TEST_CASE("without normals the topology is the promised one up to 90 % loss") {
    check_models(0);
}
