// sender/certified_loading.cpp
#include "sender/certified_loading.hpp"

#include <array>
#include <bit>
#include <fstream>
#include <span>
#include <string_view>
#include <utility>

#include "common/atomic_file.hpp"
#include "common/hex_text.hpp"
#include "common/number_text.hpp"
#include "common/object_id.hpp"

namespace ellicast::sender {
namespace {

namespace fs = std::filesystem;

// Counts up when the file's layout or the result of certify() changes.
constexpr std::string_view kMagic = "ellicert 1";

void update(common::Digest& digest, std::uint64_t value) {
    std::array<std::uint8_t, 8> bytes{};
    for (std::size_t i = 0; i < 8; ++i) bytes[i] = static_cast<std::uint8_t>(value >> (8 * i));
    digest.update(bytes);
}

Certificate search(const std::function<LoadedModel(std::size_t)>& load, const LoadedModel& first,
                   const CertificationOptions& options) {
    const auto object_of = [&](std::size_t ellipsoids) {
        return ellipsoids == options.ellipsoids ? first.object : load(ellipsoids).object;
    };
    return certify(object_of, options.ellipsoids, options.plan, options.trial);
}

// The line "name value" as a count.
std::optional<std::size_t> count_in(std::ifstream& in, std::string_view name) {
    std::string word, value;
    if (!(in >> word >> value) || word != name) return std::nullopt;
    return common::number<std::size_t>(value);
}

}  // namespace

std::string certificate_key(const BroadcastObject& object, const PlanOptions& plan,
                            const TrialOptions& trial) {
    common::Digest digest;
    digest.update({reinterpret_cast<const std::uint8_t*>(kMagic.data()), kMagic.size()});
    update(digest, std::bit_cast<std::uint64_t>(trial.goal.loss));
    update(digest, std::bit_cast<std::uint64_t>(trial.goal.share));
    update(digest, trial.seed);
    update(digest, static_cast<std::uint64_t>(trial.cells));
    PlanOptions anonymous = plan;
    anonymous.session = {};
    const RoundPlan round(object, anonymous);
    for (std::uint32_t ordinal = 0; ordinal < round.datagrams(); ++ordinal) {
        digest.update(round.datagram(0, ordinal, {}));
    }
    const std::array<std::uint8_t, 32> sum = digest.finish32();
    return common::hex_text(std::span(sum).first(16));
}

void write_certificate(const fs::path& path, const std::string& key,
                       const Certificate& certificate) {
    std::string text(kMagic);
    text += "\nkey " + key + "\ndraws " + std::to_string(certificate.draws) + "\nright " +
            std::to_string(certificate.right) + "\ncopies " + std::to_string(certificate.copies) +
            "\nellipsoids " + std::to_string(certificate.ellipsoids) + "\n";
    common::write_file_atomically(path, text);
}

std::optional<Certificate> read_certificate(const fs::path& path, const std::string& key,
                                            const CertificateGoal& goal) {
    std::ifstream in(path);
    std::string line;
    if (!std::getline(in, line) || line != kMagic) return std::nullopt;
    if (!std::getline(in, line) || line != "key " + key) return std::nullopt;
    const auto draws = count_in(in, "draws");
    const auto right = count_in(in, "right");
    const auto copies = count_in(in, "copies");
    const auto ellipsoids = count_in(in, "ellipsoids");
    if (!draws || !right || !copies || !ellipsoids) return std::nullopt;
    const bool possible = *draws >= 1 && *draws <= draws_for(goal.share) && *right <= *draws &&
                          *copies >= 1 && *copies <= 64 && *ellipsoids >= 1 &&
                          *ellipsoids <= protocol::kMaxEllipsoids;
    if (!possible) return std::nullopt;
    return certificate_of(goal, {*draws, *right}, *copies, *ellipsoids);
}

LoadedModel load_certified(const std::function<LoadedModel(std::size_t)>& load,
                           const CertificationOptions& options) {
    LoadedModel model = load(options.ellipsoids);
    if (model.promise.approximate) {
        model.warnings.emplace_back("no topology certificate, for the topology is not certain");
        return model;
    }
    std::optional<Certificate> found;
    const std::string key = certificate_key(model.object, options.plan, options.trial);
    const fs::path file = options.cache.value_or(fs::path()) / (key + ".certificate");
    if (options.cache) found = read_certificate(file, key, options.trial.goal);
    if (!found) {
        found = timed(model.stages, "certify", [&] { return search(load, model, options); });
        try {
            if (options.cache) write_certificate(file, key, *found);
        } catch (const common::WriteFailure& failure) {
            model.warnings.push_back("certificate not cached: " + std::string(failure.what()));
        }
    }
    if (found->ellipsoids != options.ellipsoids) {
        LoadedModel larger = load(found->ellipsoids);
        larger.stages.insert(larger.stages.begin(), model.stages.begin(), model.stages.end());
        model = std::move(larger);
    }
    model.object.description.certificate = certificate_text(*found);
    model.certificate = *found;
    return model;
}

}  // namespace ellicast::sender
