// receiver/listening.hpp
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "protocol/session_description.hpp"
#include "receiver/options.hpp"
#include "receiver/udp_endpoint.hpp"

namespace ellicast::receiver {

/// Where to listen and for what, from the options or from the session description that they name.
struct Listening {
    ListenOptions where;
    std::optional<std::uint8_t> payload_type;  // of RTP; empty: any
    std::optional<protocol::SessionDescription> description;
};

/// Reads the file of --sdp, when there is one. Throws ListenError, which names the file and the
/// line.
Listening listening_of(const Options& options);

/// Of a group: join it, hear its source alone when one is named. Of a host: the port on all
/// addresses, since a name or a translated address need not be one of ours.
ListenOptions listen_options_of(const protocol::SessionDescription& description,
                                const std::string& interface);

/// Logs what the description says of keys that the options do not have. A key in it is a hint for
/// the user and never taken: who made the file could have signed the stream.
void log_key_hints(const protocol::SessionDescription& description, const Options& options);

}  // namespace ellicast::receiver
