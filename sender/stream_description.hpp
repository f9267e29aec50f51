// sender/stream_description.hpp
#pragma once

#include <string>
#include <vector>

#include "protocol/session_description.hpp"
#include "sender/options.hpp"
#include "sender/program.hpp"

namespace ellicast::sender {

/// From where to where a stream goes: numeric addresses without zones; `local` "" when unknown.
struct StreamWay {
    std::string peer;
    std::string local;
};

/// What --sdp says of a stream with these pages; `public_key` as hex digits, "" when not signed.
/// The sender of a multicast group is named as its one source. Pure.
protocol::SessionDescription describe_stream(const Options& options, const Identity& identity,
                                             const std::vector<std::string>& pages,
                                             const StreamWay& way, const std::string& public_key);

}  // namespace ellicast::sender
