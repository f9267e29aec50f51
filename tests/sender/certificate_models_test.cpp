// tests/sender/certificate_models_test.cpp: topology certificates of the reference models.
#include <catch2/catch.hpp>
#include <string>

#include "sender/certified_loading.hpp"
#include "tests/support/meshes.hpp"

namespace ellicast::sender {
namespace {

// With three copies of 400 ellipsoids, as they are sent by default.
void check_certificate(const std::string& name, const CertificateGoal& goal) {
    const auto directory = tests::models_dir();
    if (!directory) {
        WARN("SKIPPED: no reference models here (set ELLICAST_MODELS); " << name << " not tried");
        return;
    }
    CertificationOptions options;
    options.trial.goal = goal;
    options.ellipsoids = 400;
    const LoadedModel model = load_certified(
        [&](std::size_t ellipsoids) {
            DecompositionOptions decomposition;
            decomposition.ellipsoids = ellipsoids;
            return load_model(*directory / (name + ".ply"), decomposition, {});
        },
        options);
    REQUIRE(model.certificate);
    WARN(name << ": " << certificate_text(*model.certificate) << ", copies "
              << model.certificate->copies << " of " << model.certificate->ellipsoids);
    CHECK(model.certificate->holds);
    CHECK(model.certificate->copies == options.plan.copies);
    CHECK(model.certificate->ellipsoids == options.ellipsoids);
}

TEST_CASE("the default copies are certified at half the datagrams lost") {
    for (const char* name :
         {"horse", "stanford-bunny", "rocker-arm", "spot", "fertility", "homer"}) {
        check_certificate(name, {0.5, 0.95});
    }
}
TEST_CASE("the default copies of horse and fertility are certified at 70 % lost") {
    check_certificate("horse", {0.7, 0.95});
    check_certificate("fertility", {0.7, 0.95});
}

}  // namespace
}  // namespace ellicast::sender
