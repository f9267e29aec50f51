#include "sender/stream_description.hpp"

#include "common/hex_text.hpp"

namespace ellicast::sender {
namespace {

/// Readers keep it in a signed number (RFC 3264).
std::uint64_t number_of(const protocol::SessionId& session) {
    std::uint64_t number = 0;
    for (const std::uint8_t byte : session) number = number << 8 | byte;
    return number & 0x7fff'ffff'ffff'ffff;
}

}  // namespace

protocol::SessionDescription describe_stream(const Options& options, const Identity& identity,
                                             const std::vector<std::string>& pages,
                                             const StreamWay& way, const std::string& public_key) {
    protocol::SessionDescription description;
    description.name = pages.size() == 1 ? pages[0] : std::to_string(pages.size()) + " pages";
    description.session = number_of(identity.session);
    description.sender = way.local;
    description.address = way.peer;
    if (description.to_group()) {
        description.source = way.local;
        const bool v6 = way.peer.find(':') != std::string::npos;
        if (!v6) description.ttl = static_cast<std::uint8_t>(options.ttl.value_or(1));
    }
    description.port = options.port;
    description.kbit_per_second = (options.bits_per_second + 999) / 1000;
    description.ssrc = identity.ssrc;
    description.cname = common::hex_text(identity.session);
    description.wire_version = protocol::kWireVersion;
    description.datagram_bytes = static_cast<std::uint16_t>(options.datagram_bytes);
    description.sealed = options.psk.has_value();
    description.public_key = public_key;
    return description;
}

}  // namespace ellicast::sender
