#pragma once

#include <cstdint>
#include <string>

#include "sender/session.hpp"
#include "sender/udp_endpoint.hpp"

namespace ellicast::sender {

/// What a session does not know of itself.
struct StatusFacts {
    const char* state = "sending";  // sending, stopping or ended
    std::string peer;
    Time running{};
    std::uint64_t asked_rate = 0;
    double recent_rate = 0;
};

/// The JSON of --status:
///   program, version, state, to
///   seconds    since the first datagram was due
///   round      its number, from 0;  rounds: in all, 0 = forever
///   page       the one being sent: {page, name, object_id, version, ordinal, datagrams}
///   pages      [{page, name, object_id, version, vertices, ellipsoids, datagrams}]
///   rate       {asked, recent}: bits per second with IP and UDP headers; asked 0: unpaced
///   datagrams  as in the report
std::string status_json(const StatusFacts& facts, const Session& session,
                        const EndpointCounts& counts);

}  // namespace ellicast::sender
