// receiver/trust.cpp
#include "receiver/trust.hpp"

#include <spdlog/spdlog.h>

#include <cerrno>
#include <fstream>
#include <string>
#include <system_error>

#include "common/atomic_file.hpp"
#include "common/key_file.hpp"
#include "common/model_io.hpp"

namespace ellicast::receiver {
namespace {

namespace fs = std::filesystem;

// 10 000 keys; whatever is larger is not our file.
constexpr std::uintmax_t kMostBytes = 1 << 20;

SessionStarts read_starts(const fs::path& path) {
    const auto fail = [&](const std::string& reason) {
        throw common::ModelError("cannot read '" + path.string() + "': " + reason);
    };
    std::error_code error;
    if (!fs::exists(path, error)) return {};
    const std::uintmax_t size = fs::file_size(path, error);
    if (error) fail(error.message());
    if (size > kMostBytes) fail("is too large to be a file of session starts");
    std::ifstream file(path, std::ios::binary);
    std::string text(static_cast<std::size_t>(size), '\0');
    file.read(text.data(), static_cast<std::streamsize>(size));
    if (!file) fail(std::generic_category().message(errno));
    std::vector<std::size_t> damaged;
    SessionStarts starts = SessionStarts::of_text(text, damaged);
    if (!damaged.empty()) {
        spdlog::warn(
            "'{}': line {} is damaged, {} of its keys are known: older sessions of the "
            "others will be accepted once more",
            path.string(), damaged.front(), starts.size());
    }
    return starts;
}

}  // namespace

void read_trust(const TrustSources& sources, GateOptions& gate) {
    for (const std::string& key : sources.verify) {
        gate.verify.push_back(common::read_public_key(key));
    }
    if (sources.psk) gate.psk = common::read_shared_key(*sources.psk);
    gate.refuse_older_sessions = sources.state.has_value();
    if (sources.state) gate.starts = read_starts(*sources.state);
}

StartsFile::StartsFile(const TrustSources& sources, const GateOptions& gate)
    : path_(sources.state), written_(gate.starts.changes()) {}

void StartsFile::update(const SessionStarts& starts) {
    if (!path_ || starts.changes() == written_) return;
    written_ = starts.changes();
    try {
        common::write_file_atomically(*path_, starts.text());
    } catch (const common::WriteFailure& failure) {
        if (!failed_) {
            spdlog::error("cannot write '{}': {}; the next start will not know this session",
                          path_->string(), failure.what());
        }
        failed_ = true;
    }
}

void AgeWarning::look_at(const DatagramGate& gate) {
    const std::uint64_t refused = gate.refused()[static_cast<std::size_t>(Refusal::out_of_date)];
    if (told_ || refused == 0 || gate.admitted() > 0) return;
    told_ = true;
    spdlog::warn(
        "all {} authentic datagrams so far are refused by --max-age: this clock or the "
        "sender's is wrong, or they are a recording",
        refused);
}

}  // namespace ellicast::receiver
