// sender/stream_security.hpp: the user's keys, from files to a session that uses them.
#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "sender/datagram_security.hpp"
#include "sender/options.hpp"

namespace ellicast::sender {

/// What is promised of signed streams with two cores at the receiver; above it the sender measures.
inline constexpr double kPromisedSignedRate = 100e6;  // bits per second

/// For logs and reports.
struct SecuritySummary {
    protocol::Protection protection;
    std::string public_key;  // hex digits; "" when not signed
    /// Bits per second that this host could sign on one core, headers below the payload included:
    /// measured when more than the promise is asked for.
    std::optional<double> signing_rate;
};

/// Reads the key files of the options. Throws common::KeyError.
StreamKeys read_stream_keys(const Options& options);

/// Measures, where it matters, and warns when less can be signed than was asked for. Takes about
/// 10 ms then.
SecuritySummary summarise(const StreamKeys& keys, const Options& options, std::size_t ip_udp_bytes);

/// For a session that starts now, by this host's clock; empty without keys.
std::optional<DatagramSecurity> begin_security(StreamKeys keys, const protocol::SessionId& session);

}  // namespace ellicast::sender
