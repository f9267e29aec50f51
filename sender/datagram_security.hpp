// sender/datagram_security.hpp
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/secure_datagram.hpp"
#include "protocol/secured_datagram.hpp"

namespace ellicast::sender {

/// What the user's keys are. Without any there is nothing to do.
struct StreamKeys {
    std::optional<common::SigningKey> sign;
    std::optional<common::SharedKey> psk;

    [[nodiscard]] protocol::Protection protection() const {
        return {.sealed = psk.has_value(), .is_signed = sign.has_value()};
    }
};

/// Seals and signs the datagrams of one session, in the order in which they are sent. It holds the
/// session's counter of sealed datagrams, so there must be one of it for a session and key: it
/// moves, and does not copy. Deterministic.
class DatagramSecurity {
  public:
    /// `session` is fresh from the operating system's random source; `start_us` are microseconds
    /// since 1970 UTC by this host's clock. Requires a key (asserted).
    DatagramSecurity(StreamKeys keys, const protocol::SessionId& session, std::uint64_t start_us);
    DatagramSecurity(DatagramSecurity&&) = default;
    DatagramSecurity& operator=(DatagramSecurity&&) = default;
    DatagramSecurity(const DatagramSecurity&) = delete;
    DatagramSecurity& operator=(const DatagramSecurity&) = delete;
    ~DatagramSecurity() = default;

    /// A clear datagram of this session, sealed, then signed, as far as there are keys;
    /// protocol::security_bytes longer. `since_start_us`: microseconds since the start.
    [[nodiscard]] std::vector<std::uint8_t> secure(std::span<const std::uint8_t> clear,
                                                   std::uint64_t since_start_us);

    [[nodiscard]] protocol::Protection protection() const { return keys_.protection(); }
    /// Datagrams sealed or signed so far.
    [[nodiscard]] std::uint64_t count() const { return counter_; }

  private:
    StreamKeys keys_;
    std::optional<common::SessionSeal> seal_;
    protocol::KeyId key_id_{};
    std::uint64_t start_us_;
    std::uint64_t counter_ = 0;
};

}  // namespace ellicast::sender
