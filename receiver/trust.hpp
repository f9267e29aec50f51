// receiver/trust.hpp: the user's keys and the file of session starts, for the gate.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "receiver/datagram_gate.hpp"

namespace ellicast::receiver {

/// As the user gave them; nothing was looked at yet.
struct TrustSources {
    std::vector<std::string> verify;  // public keys: hex digits, or names of files
    std::optional<std::filesystem::path> psk;
    std::optional<std::filesystem::path> state;
};

/// Reads keys and session starts into `gate`. Of a damaged file of starts what can be read is
/// taken; the log says what could not, and what that means. Throws common::KeyError and
/// common::ModelError with the file and the reason.
void read_trust(const TrustSources& sources, GateOptions& gate);

/// Keeps the file of session starts up to date, as a whole each time. A failure is told once, and
/// reception goes on.
class StartsFile {
  public:
    StartsFile(const TrustSources& sources, const GateOptions& gate);
    /// Writes when anything changed since the last time.
    void update(const SessionStarts& starts);

  private:
    std::optional<std::filesystem::path> path_;
    std::uint64_t written_;  // SessionStarts::changes() of what the file has
    bool failed_ = false;
};

/// Tells once when all that is authentic is refused for its age, which looks like silence else.
class AgeWarning {
  public:
    void look_at(const DatagramGate& gate);

  private:
    bool told_ = false;
};

}  // namespace ellicast::receiver
