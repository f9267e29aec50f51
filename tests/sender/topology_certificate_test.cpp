// tests/sender/topology_certificate_test.cpp
#include "sender/topology_certificate.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "common/atomic_file.hpp"
#include "sender/certified_loading.hpp"
#include "tests/support/meshes.hpp"

namespace ellicast::sender {
namespace {

// A ring out of few ellipsoids, so that it breaks when some are lost.
LoadedModel ring_of(std::size_t ellipsoids) {
    const PreparedModel model = prepare_model(tests::torus(1.0, 0.3, 80, 40));
    DecompositionOptions options;
    options.candidates = 300;
    options.grid = 48;
    options.refine = 4;
    options.ellipsoids = ellipsoids;
    LoadedModel loaded;
    loaded.promise = promise_topology(model);
    loaded.object = make_object(model, loaded.promise, decompose(model.solid, options), {"ring"});
    return loaded;
}

BroadcastObject ring_object(std::size_t ellipsoids) {
    return ring_of(ellipsoids).object;
}

TrialOptions goal(double loss, double share) {
    TrialOptions options;
    options.goal = {loss, share};
    options.cells = 40;
    return options;
}

LossTrial tried(const BroadcastObject& object, std::size_t copies, const TrialOptions& options) {
    PlanOptions plan;
    plan.copies = copies;
    return try_losses(RoundPlan(object, plan), options);
}

struct TemporaryFolder {
    std::filesystem::path path = std::filesystem::temp_directory_path() / "ellicast-certificates";
    TemporaryFolder() {
        std::filesystem::remove_all(path);
        std::filesystem::create_directories(path);
    }
    ~TemporaryFolder() { std::filesystem::remove_all(path); }
};

}  // namespace

TEST_CASE("the bound is that of Clopper and Pearson") {
    CHECK(share_at_least(59, 59) == Approx(std::pow(0.05, 1.0 / 59)).epsilon(1e-9));
    CHECK(share_at_least(59, 59) > 0.95);
    CHECK(share_at_least(58, 58) < 0.95);
    // Tables: one-sided 95 % lower bounds.
    CHECK(share_at_least(49, 50) == Approx(0.9086).margin(1e-4));
    CHECK(share_at_least(9, 10) == Approx(0.6058).margin(1e-4));
    CHECK(share_at_least(1, 10) == Approx(1.0 - std::pow(0.95, 0.1)).epsilon(1e-6));
    CHECK(share_at_least(0, 10) == 0.0);
}

TEST_CASE("there are just as many draws as a flawless series needs, at least 50") {
    CHECK(draws_for(0.5) == 50);
    CHECK(draws_for(0.95) == 59);
    CHECK(draws_for(0.99) == 299);
    CHECK(share_at_least(299, 299) >= 0.99);
}

TEST_CASE("nothing lost is right in every draw, everything lost in none") {
    const BroadcastObject ring = ring_object(40);
    REQUIRE_FALSE(ring.hint.approximate);
    const LossTrial whole = tried(ring, 3, goal(0.0, 0.95));
    CHECK(whole.draws == 59);
    CHECK(whole.right == 59);
    const LossTrial none = tried(ring, 3, goal(0.9999, 0.95));
    CHECK(none.right == 0);
    CHECK(none.draws < 59);
}

TEST_CASE("threads change no draw, another seed does") {
    const BroadcastObject ring = ring_object(20);
    TrialOptions options = goal(0.7, 0.1);
    options.threads = 1;
    const LossTrial one = tried(ring, 1, options);
    options.threads = 3;
    const LossTrial three = tried(ring, 1, options);
    CHECK(one.right == three.right);
    CHECK(one.draws == three.draws);
    CHECK(one.right < one.draws);
    bool other = false;
    for (options.seed = 2; options.seed < 6; ++options.seed) {
        other = other || tried(ring, 1, options).right != one.right;
    }
    CHECK(other);
}

TEST_CASE("more copies keep the ring whole in more draws") {
    const BroadcastObject ring = ring_object(20);
    CHECK(tried(ring, 8, goal(0.6, 0.1)).right > tried(ring, 1, goal(0.6, 0.1)).right + 5);
}

TEST_CASE("copies are added until the certificate holds") {
    PlanOptions plan;
    plan.copies = 1;
    const Certificate found = certify(ring_object, 20, plan, goal(0.5, 0.9));
    CHECK(found.holds);
    CHECK(found.copies > 1);
    CHECK(found.lower_bound >= 0.9);
    CHECK(found.draws == draws_for(0.9));
    const std::string text = certificate_text(found);
    CHECK(text.starts_with("topology 0.9 at loss 0.5: "));
    CHECK(text.ends_with("/50 draws"));
}

TEST_CASE("what cannot be certified says what it reached, and is no certificate") {
    const Certificate found = certify(ring_object, 20, {}, goal(0.98, 0.99));
    CHECK_FALSE(found.holds);
    CHECK(found.draws > 0);
    CHECK(found.right < found.draws);
    CHECK(found.lower_bound < 0.99);
    CHECK(certificate_text(found).empty());
}

TEST_CASE("too few ellipsoids become more where copies cannot help") {
    // The smaller object promises handles that nothing of it makes, even when all arrives.
    std::vector<std::size_t> asked;
    const auto object_of = [&](std::size_t ellipsoids) {
        asked.push_back(ellipsoids);
        BroadcastObject object = ring_object(40);
        if (ellipsoids < 15) object.hint.euler_all = object.hint.euler_largest = -4;
        return object;
    };
    const Certificate found = certify(object_of, 10, {}, goal(0.1, 0.5));
    CHECK(asked == std::vector<std::size_t>{10, 15});
    CHECK(found.holds);
    CHECK(found.ellipsoids == 15);
    CHECK(found.copies == PlanOptions{}.copies);
}

TEST_CASE("a certificate is read from the cache as it was written, and by its key alone") {
    const TemporaryFolder folder;
    const CertificateGoal wanted{0.5, 0.95};
    const Certificate written = certificate_of(wanted, {59, 59}, 4, 300);
    const std::string key(32, 'a');
    const std::filesystem::path file = folder.path / "x.certificate";
    CHECK_FALSE(read_certificate(file, key, wanted));
    write_certificate(file, key, written);
    const auto read = read_certificate(file, key, wanted);
    REQUIRE(read);
    CHECK(read->holds);
    CHECK(read->copies == 4);
    CHECK(read->ellipsoids == 300);
    CHECK(certificate_text(*read) == certificate_text(written));
    CHECK_FALSE(read_certificate(file, std::string(32, 'b'), wanted));
    for (const char* lie : {"draws 60\nright 60", "draws 59\nright 60", "draws 0\nright 0",
                            "draws x\nright 59", "draws 59\nright -1"}) {
        const std::string text =
            "ellicert 1\nkey " + key + "\n" + lie + "\ncopies 3\nellipsoids 9\n";
        common::write_file_atomically(file, text);
        CAPTURE(lie);
        CHECK_FALSE(read_certificate(file, key, wanted));
    }
}

TEST_CASE("the key changes with goal, seed, plan and object, not with threads or session") {
    const BroadcastObject ring = ring_object(20);
    const TrialOptions options = goal(0.5, 0.95);
    const std::string key = certificate_key(ring, {}, options);
    CHECK(key.size() == 32);
    CHECK(certificate_key(ring, {}, goal(0.4, 0.95)) != key);
    CHECK(certificate_key(ring, {}, goal(0.5, 0.9)) != key);
    TrialOptions other = options;
    other.seed = 9;
    CHECK(certificate_key(ring, {}, other) != key);
    other = options;
    other.threads = 5;
    CHECK(certificate_key(ring, {}, other) == key);
    PlanOptions plan;
    plan.session.fill(7);
    CHECK(certificate_key(ring, plan, options) == key);
    plan.copies = 5;
    CHECK(certificate_key(ring, plan, options) != key);
    CHECK(certificate_key(ring_object(21), {}, options) != key);
}

TEST_CASE("a certified model carries its text, and comes from the cache the second time") {
    const TemporaryFolder folder;
    CertificationOptions options;
    options.trial = goal(0.3, 0.9);
    options.ellipsoids = 40;
    options.cache = folder.path;
    std::size_t looks = 0;
    options.trial.on_draws = [&](const LossTrial&) { ++looks; };
    const LoadedModel first = load_certified(ring_of, options);
    REQUIRE(first.certificate);
    CHECK(first.certificate->holds);
    CHECK(first.object.description.certificate == certificate_text(*first.certificate));
    CHECK(looks > 0);
    looks = 0;
    const LoadedModel second = load_certified(ring_of, options);
    CHECK(looks == 0);
    CHECK(second.object.description.certificate == first.object.description.certificate);
    CHECK(second.object.id == first.object.id);
}

TEST_CASE("an uncertain topology is not certified") {
    CertificationOptions options;
    options.trial = goal(0.3, 0.9);
    options.ellipsoids = 20;
    const LoadedModel model = load_certified(
        [](std::size_t n) {
            LoadedModel loaded = ring_of(n);
            loaded.promise.approximate = true;
            return loaded;
        },
        options);
    CHECK_FALSE(model.certificate);
    CHECK(model.object.description.certificate.empty());
    CHECK_FALSE(model.warnings.empty());
}

}  // namespace ellicast::sender
