// protocol/session_description.cpp: writing; session_description_reader.cpp reads.
#include "protocol/session_description.hpp"

#include <cassert>
#include <utility>

#include "protocol/description.hpp"
#include "protocol/ip_address.hpp"

namespace ellicast::protocol {
namespace {

class Lines {
  public:
    void add(char type, const std::string& value) {
        text_.append(1, type).append("=").append(value).append("\r\n");
    }
    std::string take() { return std::move(text_); }

  private:
    std::string text_;
};

bool is_v6(const std::string& address) {
    return address.find(':') != std::string::npos;
}

std::string with_family(const std::string& address) {
    return (is_v6(address) ? "IN IP6 " : "IN IP4 ") + address;
}

/// Semicolons between them, as RFC 4855 has it.
std::string parameters(const SessionDescription& description) {
    std::string text;
    const auto add = [&text](const std::string& parameter) {
        if (!text.empty()) text += ";";
        text += parameter;
    };
    if (description.wire_version > 0) add("version=" + std::to_string(description.wire_version));
    if (description.datagram_bytes > 0) {
        add("datagram=" + std::to_string(description.datagram_bytes));
    }
    if (description.sealed) add("sealed=1");
    if (!description.public_key.empty()) add("key=" + description.public_key);
    return text;
}

void add_medium(Lines& lines, const SessionDescription& description) {
    const std::string type = std::to_string(description.payload_type);
    lines.add('m', "application " + std::to_string(description.port) + " RTP/AVP " + type);
    // No RTCP, in either direction (RFC 3556): nobody answers.
    lines.add('b', "RS:0");
    lines.add('b', "RR:0");
    lines.add('a', "rtpmap:" + type + " ellicast/" + std::to_string(kRtpClockHz));
    const std::string format = parameters(description);
    if (!format.empty()) lines.add('a', "fmtp:" + type + " " + format);
    if (description.ssrc) {
        lines.add('a', "ssrc:" + std::to_string(*description.ssrc) + " cname:" + description.cname);
    }
}

[[maybe_unused]] bool is_fit(const SessionDescription& description) {
    const auto address = parse_ip_address(description.address);
    if (!address || description.port == 0) return false;
    const bool group = is_multicast(*address);
    const auto source = parse_ip_address(description.source);
    const bool any_source = description.source.empty();
    return (any_source || (group && source && source->v6 == address->v6)) &&
           (description.sender.empty() || parse_ip_address(description.sender)) &&
           description.ttl.has_value() == (group && !address->v6) &&
           description.payload_type >= kRtpPayloadType && description.payload_type < 128;
}

}  // namespace

bool SessionDescription::to_group() const {
    const auto parsed = parse_ip_address(address);
    return parsed && is_multicast(*parsed);
}

SessionDescriptionError::SessionDescriptionError(std::size_t line, const std::string& reason)
    : std::runtime_error(line == 0 ? reason : "line " + std::to_string(line) + ": " + reason) {}

std::string session_description_text(const SessionDescription& description) {
    assert(is_fit(description));
    const std::string name = presentable(description.name);
    const std::string nobody = is_v6(description.address) ? "::" : "0.0.0.0";
    Lines lines;
    lines.add('v', "0");
    lines.add('o', "- " + std::to_string(description.session) + " " +
                       std::to_string(description.revision) + " " +
                       with_family(description.sender.empty() ? nobody : description.sender));
    lines.add('s', name.empty() ? "-" : name);
    std::string connection = with_family(description.address);
    if (description.ttl) connection.append("/").append(std::to_string(*description.ttl));
    lines.add('c', connection);
    if (description.kbit_per_second > 0) {
        lines.add('b', "AS:" + std::to_string(description.kbit_per_second));
    }
    lines.add('t', "0 0");
    lines.add('a', "recvonly");
    if (!description.source.empty()) {
        lines.add('a', "source-filter: incl " + with_family(description.address) + " " +
                           description.source);
    }
    add_medium(lines, description);
    return lines.take();
}

}  // namespace ellicast::protocol
