// protocol/session_description.hpp: a stream as a file that receivers are given, SDP [RFC 8866].
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

#include "protocol/datagram.hpp"

namespace ellicast::protocol {

/// What a description says of one of our streams. It is as trustworthy as where it came from: keys
/// in it are hints for people. WIRE_FORMAT.md section 14 has the lines.
struct SessionDescription {
    std::string name = "-";           // for people
    std::uint64_t session = 0;        // of the description itself, a number in its o= line
    std::uint64_t revision = 1;       // of the same session's descriptions
    std::string sender;               // numeric address of the sending host; "": unknown
    std::string address;              // where it is sent: numeric, or, of a host, a name
    std::optional<std::uint8_t> ttl;  // of an IPv4 group, hops
    std::uint16_t port = 0;           // from 1 on
    std::uint8_t payload_type = kRtpPayloadType;  // 96 to 127
    std::string source;  // of a group, the one sender to be heard, numeric; "": any (RFC 4570)
    std::uint64_t kbit_per_second = 0;  // with IP and UDP headers (b=AS); 0: not said
    std::optional<std::uint32_t> ssrc;  // of the present run (RFC 5576)
    std::string cname;                  // beside the SSRC; letters and digits
    std::uint8_t wire_version = 0;      // 0: not said
    std::uint16_t datagram_bytes = 0;   // UDP payload, at most; 0: not said
    bool sealed = false;                // who has not the shared key can read nothing
    std::string public_key;             // 64 hex digits that signatures are said to fit; "": none
    bool operator==(const SessionDescription&) const = default;

    /// Whether it is sent to a multicast group.
    [[nodiscard]] bool to_group() const;
};

/// What is wrong with a description: "line 7: the port ...", one line that may be shown.
class SessionDescriptionError : public std::runtime_error {
  public:
    /// Lines count from 1; 0 is the file as a whole.
    SessionDescriptionError(std::size_t line, const std::string& reason);
};

inline constexpr std::size_t kMaxSessionDescriptionBytes = 65'536;
inline constexpr std::size_t kMaxSessionDescriptionLine = 4096;  // bytes

/// The text of the description, lines ended by CR and LF. Control characters in the name become
/// '_'. Requires numeric addresses, a TTL just for an IPv4 group, a source just for a group and of
/// its family, and the other fields in their ranges (asserted).
std::string session_description_text(const SessionDescription& description);

/// Reads what others may have written: of several media the first that is ours, by its a=rtpmap.
/// Lines may end in LF alone; attributes that are not known, and what is said of other media, are
/// passed over. A filter of sources for a destination that is no group is as good as none; one that
/// cannot be honoured, or is for an address that no c= line has, is an error. Throws
/// SessionDescriptionError. Linear in the text's length.
SessionDescription parse_session_description(std::string_view text);

}  // namespace ellicast::protocol
