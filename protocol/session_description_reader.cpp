#include <algorithm>
#include <array>
#include <charconv>
#include <limits>
#include <span>
#include <system_error>
#include <utility>
#include <vector>

#include "protocol/description.hpp"
#include "protocol/ip_address.hpp"
#include "protocol/session_description.hpp"

namespace ellicast::protocol {
namespace {

using Error = SessionDescriptionError;
using Words = std::vector<std::string_view>;

constexpr std::string_view kTypes = "vosiuepcbtrzkam";  // all of RFC 8866
constexpr std::uint8_t kFirstDynamicType = 96;          // RFC 3551
constexpr std::uint8_t kLastType = 127;
constexpr std::size_t kMaxHostName = 253;
constexpr std::string_view kClock = "/90000";
static_assert(kRtpClockHz == 90'000);

struct Line {
    std::size_t number = 0;
    char type = '\0';
    std::string_view value;
};
using Lines = std::span<const Line>;

/// For messages: short, and fit to be shown.
std::string quoted(std::string_view text) {
    return "'" + presentable(text, 60) + "'";
}

Words words_of(std::string_view text) {
    Words words;
    while (!text.empty()) {
        const std::string_view word = text.substr(0, text.find(' '));
        if (!word.empty()) words.push_back(word);
        text.remove_prefix(std::min(text.size(), word.size() + 1));
    }
    return words;
}

template <class T>
std::optional<T> number_of(std::string_view word, T low = 0,
                           T high = std::numeric_limits<T>::max()) {
    T value{};
    const char* const end = word.data() + word.size();
    const auto [stop, error] = std::from_chars(word.data(), end, value);
    if (error != std::errc{} || stop != end || value < low || value > high) return std::nullopt;
    return value;
}

Line line_of(std::size_t number, std::string_view text) {
    if (text.ends_with('\r')) text.remove_suffix(1);
    if (text.size() > kMaxSessionDescriptionLine) {
        throw Error(number,
                    "is longer than " + std::to_string(kMaxSessionDescriptionLine) + " bytes");
    }
    if (text.find('\0') != std::string_view::npos) throw Error(number, "holds a zero byte");
    if (text.size() < 2 || text[1] != '=' || kTypes.find(text[0]) == std::string_view::npos) {
        throw Error(number, "expected a letter of SDP and '=', not " + quoted(text));
    }
    return {number, text[0], text.substr(2)};
}

std::vector<Line> lines_of(std::string_view text) {
    if (text.size() > kMaxSessionDescriptionBytes) {
        throw Error(0, "is larger than " + std::to_string(kMaxSessionDescriptionBytes) + " bytes");
    }
    std::vector<Line> lines;
    while (!text.empty()) {
        const std::string_view line = text.substr(0, text.find('\n'));
        lines.push_back(line_of(lines.size() + 1, line));
        text.remove_prefix(std::min(text.size(), line.size() + 1));
    }
    if (lines.empty() || lines[0].type != 'v' || lines[0].value != "0") {
        throw Error(1, "expected v=0, as session descriptions begin");
    }
    return lines;
}

/// The value of an attribute "name:value"; nothing when the line is another.
std::optional<std::string_view> attribute(const Line& line, std::string_view name) {
    if (line.type != 'a' || !line.value.starts_with(name)) return std::nullopt;
    std::string_view rest = line.value.substr(name.size());
    if (!rest.starts_with(':')) return std::nullopt;
    rest.remove_prefix(1);
    return rest;
}

/// Of "96 ...", where that is the payload type: what follows.
std::optional<std::string_view> of_type(std::string_view value, std::uint8_t type) {
    const std::string_view word = value.substr(0, value.find(' '));
    if (number_of<std::uint8_t>(word) != type) return std::nullopt;
    value.remove_prefix(std::min(value.size(), word.size() + 1));
    return value;
}

/// Whatever the case of their letters.
bool is_same_word(std::string_view a, std::string_view b) {
    const auto small = [](char c) {
        return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    };
    return std::ranges::equal(a, b, {}, small, small);
}

/// The session's own lines, and those of each medium.
struct Sections {
    Lines session;
    std::vector<Lines> media;
};

Sections sections_of(const std::vector<Line>& lines) {
    const auto is_medium = [](const Line& line) { return line.type == 'm'; };
    auto at = std::ranges::find_if(lines, is_medium);
    Sections sections{{lines.begin(), at}, {}};
    while (at != lines.end()) {
        const auto next = std::find_if(at + 1, lines.end(), is_medium);
        sections.media.emplace_back(at, next);
        at = next;
    }
    return sections;
}

/// A medium of ours: its first line, and the payload type that a=rtpmap calls ours.
struct OurMedium {
    std::string_view port;
    std::uint8_t type = 0;
    std::string_view clock;  // "/90000"
    std::size_t line = 0;    // of a=rtpmap
};

std::optional<OurMedium> our_medium(Lines medium) {
    const Words words = words_of(medium[0].value);
    if (words.size() < 4) {
        throw Error(medium[0].number, "expected m=MEDIA PORT PROTOCOL FORMATS");
    }
    if (words[2] != "RTP/AVP") return std::nullopt;
    std::array<bool, kLastType + 1> offered{};
    for (std::size_t k = 3; k < words.size(); ++k) {
        if (const auto type = number_of<std::uint8_t>(words[k], 0, kLastType))
            offered[*type] = true;
    }
    for (const Line& line : medium) {
        const std::string_view map = attribute(line, "rtpmap").value_or("");
        const auto type = number_of<std::uint8_t>(map.substr(0, map.find(' ')), 0, kLastType);
        if (!type || !offered[*type]) continue;
        const std::string_view encoding = *of_type(map, *type);
        const std::string_view name = encoding.substr(0, encoding.find('/'));
        if (!is_same_word(name, "ellicast")) continue;  // RFC 4855: names have no case
        return OurMedium{words[1], *type, encoding.substr(name.size()), line.number};
    }
    return std::nullopt;
}

void read_medium(const Line& first, const OurMedium& ours, SessionDescription& description) {
    const std::string_view port = ours.port.substr(0, ours.port.find('/'));
    const auto number = number_of<std::uint16_t>(port, 1);
    if (!number) {
        throw Error(first.number, "the port " + quoted(port) + " is not a number from 1 to 65535");
    }
    if (port.size() < ours.port.size() && ours.port.substr(port.size()) != "/1") {
        throw Error(first.number, "a stream has one port, not " + quoted(ours.port));
    }
    if (ours.type < kFirstDynamicType || ours.type > kLastType) {
        throw Error(ours.line, "the payload type is not a dynamic one, from 96 to 127");
    }
    if (ours.clock != kClock) throw Error(ours.line, "the clock of a stream runs at 90000 Hz");
    description.port = *number;
    description.payload_type = ours.type;
}

bool is_host_name(std::string_view text) {
    return !text.empty() && text.size() <= kMaxHostName && text[0] != '-' && text[0] != '.' &&
           std::ranges::all_of(text, [](char c) {
               return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                      c == '-' || c == '.';
           });
}

/// "IN IP4 ADDRESS": checks the first two words; true for IPv6.
bool is_v6(const Line& line, std::string_view network, std::string_view family) {
    if (network != "IN" || (family != "IP4" && family != "IP6")) {
        throw Error(line.number, "expected IN IP4 or IN IP6");
    }
    return family == "IP6";
}

/// What follows a group's address: "/TTL" and "/NUMBER" of groups, without a TTL for IPv6.
void read_scope(const Line& line, std::string_view scope, bool v6,
                SessionDescription& description) {
    Words parts;
    while (!scope.empty()) {
        scope.remove_prefix(1);
        parts.push_back(scope.substr(0, scope.find('/')));
        scope.remove_prefix(parts.back().size());
    }
    if (!v6 && !parts.empty()) {
        description.ttl = number_of<std::uint8_t>(parts[0]);
        if (!description.ttl) {
            throw Error(line.number, "the TTL " + quoted(parts[0]) + " is not from 0 to 255");
        }
        parts.erase(parts.begin());
    }
    if (parts.size() > 1 || (parts.size() == 1 && parts[0] != "1")) {
        throw Error(line.number, "a stream is sent to one group");
    }
}

void read_connection(const Line& line, SessionDescription& description) {
    const Words words = words_of(line.value);
    if (words.size() != 3) throw Error(line.number, "expected c=IN IP4 or IP6 and an address");
    const bool v6 = is_v6(line, words[0], words[1]);
    const std::string_view address = words[2].substr(0, words[2].find('/'));
    const std::string_view scope = words[2].substr(address.size());
    const auto parsed = parse_ip_address(address);
    const bool numeric = parsed && parsed->v6 == v6;
    if (!numeric && (parsed || !is_host_name(address))) {
        throw Error(line.number, quoted(address) + " is not an address of IPv" + (v6 ? "6" : "4"));
    }
    if (numeric && is_multicast(*parsed)) {
        read_scope(line, scope, v6, description);
    } else if (!scope.empty()) {
        throw Error(line.number, "only a group's address is followed by '/'");
    }
    description.address = address;
}

/// The medium's line of that type, or else the session's; null without either.
const Line* find_line(char type, Lines session, Lines medium) {
    const Line* found = nullptr;
    for (const Lines lines : {medium, session}) {
        for (const Line& line : lines) {
            if (line.type != type) continue;
            if (found) throw Error(line.number, std::string("there is another ") + type + "= line");
            found = &line;
        }
        if (found) return found;
    }
    return found;
}

/// By value, or, where one is a name, letter by letter; names have no case.
bool is_same_address(std::string_view a, std::string_view b) {
    const auto number = parse_ip_address(a);
    return number ? number == parse_ip_address(b) : is_same_word(a, b);
}

/// Addresses of c= lines, those of other media too.
std::vector<std::string_view> connections_of(const Sections& sections) {
    std::vector<std::string_view> addresses;
    const auto add = [&](Lines lines) {
        for (const Line& line : lines) {
            const Words words = words_of(line.type == 'c' ? line.value : "");
            if (words.size() == 3) addresses.push_back(words[2].substr(0, words[2].find('/')));
        }
    };
    add(sections.session);
    std::ranges::for_each(sections.media, add);
    return addresses;
}

/// Whether a filter is for our group, by `destinations` or by all of them. One that is for none of
/// those that it may be for is a mistake: to pass over it would open the group to all sources. So
/// is a name that no c= line has, for it may be our group's.
bool is_about(const Line& line, std::string_view destination, const SessionDescription& description,
              std::span<const std::string_view> destinations) {
    if (destination == "*" || is_same_address(destination, description.address)) return true;
    const auto is_it = [&](std::string_view other) { return is_same_address(destination, other); };
    if (std::ranges::none_of(destinations, is_it)) {
        throw Error(line.number, "the filter is for " + quoted(destination) +
                                     ", which is not the address of its c= line");
    }
    return false;
}

/// RFC 4570: "incl IN IP4 GROUP SOURCES".
void read_filter(const Line& line, std::string_view value,
                 std::span<const std::string_view> destinations, SessionDescription& description) {
    const Words words = words_of(value);
    if (words.size() < 5 || (words[0] != "incl" && words[0] != "excl")) {
        throw Error(line.number, "expected a=source-filter: incl IN IP4 GROUP SOURCE");
    }
    const bool any_family = words[2] == "*";
    const bool v6 = is_v6(line, words[1], any_family ? "IP4" : words[2]);
    if (!is_about(line, words[3], description, destinations)) return;
    const auto source = parse_ip_address(words[4]);
    if (words[0] == "excl") throw Error(line.number, "sources can be chosen, not excluded");
    if (words.size() > 5 || !description.source.empty()) {
        throw Error(line.number, "one source can be chosen, not several");
    }
    const bool fits = source && !is_multicast(*source) && (any_family || source->v6 == v6) &&
                      source->v6 == parse_ip_address(description.address)->v6;
    if (!fits) {
        throw Error(line.number, quoted(words[4]) + " is not the address of a source of the group");
    }
    description.source = words[4];
}

/// A medium's own filters stand in for the session's, all of them (RFC 4570 section 3.1), and can
/// only be for its own group; the session's for those of any medium.
void read_filters(const Sections& sections, Lines medium, SessionDescription& description) {
    if (!description.to_group()) return;
    const auto read = [&](Lines lines, std::span<const std::string_view> destinations) {
        bool found = false;
        for (const Line& line : lines) {
            const auto value = attribute(line, "source-filter");
            if (!value) continue;
            found = true;
            read_filter(line, *value, destinations, description);
        }
        return found;
    };
    if (!read(medium, {})) read(sections.session, connections_of(sections));
}

bool is_key(std::string_view text) {
    return text.size() == 64 && std::ranges::all_of(text, [](char c) {
               return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f') || (c >= 'A' && c <= 'F');
           });
}

void read_parameter(const Line& line, std::string_view name, std::string_view value,
                    SessionDescription& description) {
    const auto refuse = [&] { throw Error(line.number, "bad " + quoted(name) + " in a=fmtp"); };
    if (name == "version") {
        description.wire_version = number_of<std::uint8_t>(value, 1).value_or(0);
        if (description.wire_version == 0) refuse();
        if (description.wire_version != kWireVersion) {
            throw Error(line.number, "the stream is of version " + std::string(value) +
                                         ", and this program knows " +
                                         std::to_string(kWireVersion));
        }
    } else if (name == "datagram") {
        description.datagram_bytes =
            number_of<std::uint16_t>(value, kMinDatagramBytes, kMaxDatagramBytes).value_or(0);
        if (description.datagram_bytes == 0) refuse();
    } else if (name == "sealed") {
        if (value != "0" && value != "1") refuse();
        description.sealed = value == "1";
    } else if (name == "key") {
        if (!is_key(value)) refuse();
        description.public_key = value;
    }
}

void read_format(const Line& line, std::string_view text, SessionDescription& description) {
    while (!text.empty()) {
        std::string_view parameter = text.substr(0, text.find(';'));
        text.remove_prefix(std::min(text.size(), parameter.size() + 1));
        while (parameter.starts_with(' ')) parameter.remove_prefix(1);
        while (parameter.ends_with(' ')) parameter.remove_suffix(1);
        const std::string_view name = parameter.substr(0, parameter.find('='));
        read_parameter(line, name, parameter.substr(std::min(parameter.size(), name.size() + 1)),
                       description);
    }
}

/// "ID cname:VALUE"; other sources and their other attributes are passed over.
void read_source(const Line& line, std::string_view value, SessionDescription& description) {
    const Words words = words_of(value);
    const auto ssrc = number_of<std::uint32_t>(words.empty() ? "" : words[0]);
    if (!ssrc) throw Error(line.number, "the SSRC is not a number below 2^32");
    if (description.ssrc || words.size() < 2 || !words[1].starts_with("cname:")) return;
    description.ssrc = ssrc;
    description.cname = presentable(words[1].substr(6));
}

void read_attributes(Lines medium, SessionDescription& description) {
    for (const Line& line : medium) {
        if (const auto format = attribute(line, "fmtp")) {
            const auto ours = of_type(*format, description.payload_type);
            if (ours) read_format(line, *ours, description);
        }
        if (const auto source = attribute(line, "ssrc")) read_source(line, *source, description);
    }
}

void read_origin(const Line& line, SessionDescription& description) {
    const Words words = words_of(line.value);
    const auto session = number_of<std::uint64_t>(words.size() == 6 ? words[1] : "");
    const auto revision = number_of<std::uint64_t>(words.size() == 6 ? words[2] : "");
    if (!session || !revision) {
        throw Error(line.number, "expected o=USER NUMBER NUMBER IN IP4 ADDRESS");
    }
    description.session = *session;
    description.revision = *revision;
    const auto sender = parse_ip_address(words[5]);
    if (sender && *sender != IpAddress{sender->v6, {}}) description.sender = words[5];
}

void read_session(Lines session, SessionDescription& description) {
    for (const char type : {'o', 's', 't'}) {
        if (std::ranges::none_of(session, [type](const Line& line) { return line.type == type; })) {
            throw Error(0, std::string("there is no ") + type + "= line before the media");
        }
    }
    read_origin(*find_line('o', session, {}), description);
    const std::string_view name = find_line('s', session, {})->value;
    if (!name.empty()) description.name = presentable(name);
}

/// Bandwidth of the application, RFC 8866 section 5.8.
void read_bandwidth(Lines session, Lines medium, SessionDescription& description) {
    for (const Lines lines : {session, medium}) {
        for (const Line& line : lines) {
            if (line.type != 'b' || !line.value.starts_with("AS:")) continue;
            const auto kbit = number_of<std::uint64_t>(line.value.substr(3));
            if (!kbit) throw Error(line.number, "the bandwidth is not a number of kbit/s");
            description.kbit_per_second = *kbit;
        }
    }
}

}  // namespace

SessionDescription parse_session_description(std::string_view text) {
    const std::vector<Line> lines = lines_of(text);
    const Sections sections = sections_of(lines);
    SessionDescription description;
    read_session(sections.session, description);
    for (const Lines medium : sections.media) {
        const std::optional<OurMedium> ours = our_medium(medium);
        if (!ours) continue;
        read_medium(medium[0], *ours, description);
        const Line* const connection = find_line('c', sections.session, medium);
        if (!connection) throw Error(medium[0].number, "there is no c= line for this stream");
        read_connection(*connection, description);
        read_filters(sections, medium, description);
        read_attributes(medium, description);
        read_bandwidth(sections.session, medium, description);
        return description;
    }
    throw Error(0, "describes no ellicast stream: there is no a=rtpmap:N ellicast/90000");
}

}  // namespace ellicast::protocol
