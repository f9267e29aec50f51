#include "protocol/session_description.hpp"

#include <catch2/catch.hpp>
#include <limits>
#include <string>

namespace {

using namespace ellicast::protocol;

SessionDescription to_a_group() {
    SessionDescription made;
    made.name = "horse";
    made.session = 4'822'678'189'205'111;
    made.sender = "10.77.0.1";
    made.address = "239.255.0.1";
    made.ttl = 4;
    made.port = 5004;
    made.source = "10.77.0.1";
    made.kbit_per_second = 20'000;
    made.ssrc = 7;
    made.cname = "00112233445566aa";
    made.wire_version = kWireVersion;
    made.datagram_bytes = 1200;
    made.sealed = true;
    made.public_key = std::string(64, 'a');
    return made;
}

const std::string kGolden =
    "v=0\r\n"
    "o=- 4822678189205111 1 IN IP4 10.77.0.1\r\n"
    "s=horse\r\n"
    "c=IN IP4 239.255.0.1/4\r\n"
    "b=AS:20000\r\n"
    "t=0 0\r\n"
    "a=recvonly\r\n"
    "a=source-filter: incl IN IP4 239.255.0.1 10.77.0.1\r\n"
    "m=application 5004 RTP/AVP 96\r\n"
    "b=RS:0\r\n"
    "b=RR:0\r\n"
    "a=rtpmap:96 ellicast/90000\r\n"
    "a=fmtp:96 version=1;datagram=1200;sealed=1;key="
    "aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa\r\n"
    "a=ssrc:7 cname:00112233445566aa\r\n";

/// The golden text with one line in place of another; without it where that is "".
std::string with(const std::string& line, const std::string& other) {
    std::string text = kGolden;
    const std::size_t at = text.find(line + "\r\n");
    REQUIRE(at != std::string::npos);
    return text.replace(at, line.size() + 2, other.empty() ? "" : other + "\r\n");
}

std::string reason(const std::string& text) {
    try {
        (void)parse_session_description(text);
    } catch (const SessionDescriptionError& error) {
        CHECK(std::string(error.what()).find_first_of("\r\n") == std::string::npos);
        return error.what();
    }
    return "";
}

std::string reason_with(const std::string& line, const std::string& other) {
    return reason(with(line, other));
}

constexpr const char* kConnection = "c=IN IP4 239.255.0.1/4";
constexpr const char* kFilter = "a=source-filter: incl IN IP4 239.255.0.1 10.77.0.1";
constexpr const char* kMedium = "m=application 5004 RTP/AVP 96";
constexpr const char* kMap = "a=rtpmap:96 ellicast/90000";

}  // namespace

TEST_CASE("a description has the golden lines, and they say what was written") {
    CHECK(session_description_text(to_a_group()) == kGolden);
    CHECK(parse_session_description(kGolden) == to_a_group());
}

TEST_CASE("what was written is read again") {
    SessionDescription made;
    made.address = GENERATE("192.0.2.7", "2001:db8::7", "ff15::77", "232.1.2.3");
    made.port = GENERATE(as<std::uint16_t>{}, 1, 65'535);
    made.session = GENERATE(as<std::uint64_t>{}, 0u, std::numeric_limits<std::uint64_t>::max());
    const bool v6 = made.address.find(':') != std::string::npos;
    if (made.to_group()) made.source = v6 ? "2001:db8::1" : "192.0.2.1";
    if (made.to_group() && !v6) made.ttl = 255;
    made.sender = GENERATE("", "192.0.2.1", "2001:db8::1");
    made.payload_type = GENERATE(as<std::uint8_t>{}, 96, 127);
    made.name = GENERATE("-", "a b=c", "\xc3\xa4\xe2\x82\xac");
    CHECK(parse_session_description(session_description_text(made)) == made);
}

TEST_CASE("a name cannot add lines") {
    SessionDescription made = to_a_group();
    made.name = "a\r\na=evil\x7f";
    CHECK(parse_session_description(session_description_text(made)).name == "a__a=evil_");
    made.name = "";
    CHECK(parse_session_description(session_description_text(made)).name == "-");
}

TEST_CASE("of several media the first that is ours is taken, with its own lines") {
    const std::string text =
        "v=0\n"
        "o=alice 1 2 IN IP4 host.example.org\n"
        "s= \n"
        "i=more\n"
        "c=IN IP4 239.1.1.1/1\n"
        "b=AS:1\n"
        "t=0 0\n"
        "t=1 2\n"
        "a=source-filter: incl IN IP4 239.1.1.1 10.0.0.1\n"
        "m=audio 0 RTP/AVP 0 8\n"
        "m=video 5000 RTP/AVP 96\n"
        "a=rtpmap:96 H264/90000\n"
        "m=application 5002 RTP/SAVP 96\n"
        "a=rtpmap:96 ellicast/90000\n"
        "m=application 5006 RTP/AVP 0 97 98\n"
        "c=IN IP6 ff15::1\n"
        "b=X-YZ:128\n"
        "b=AS:300\n"
        "a=rtpmap:97 other/90000\n"
        "a=rtpmap:99 ellicast/8000\n"
        "a=rtpmap:98 ELLICAST/90000\n"
        "a=fmtp:97 version=200\n"
        "a=fmtp:98 unknown=3; datagram=600 ;version=1;\n"
        "a=source-filter:incl IN * * fd00::1\n"
        "a=ssrc:4294967295 fmt:1\n"
        "a=ssrc:5 cname:x y\n"
        "a=ssrc:6 cname:z\n"
        "m=application 5008 RTP/AVP 96\n"
        "a=rtpmap:96 ellicast/90000";
    const SessionDescription read = parse_session_description(text);
    CHECK(read.port == 5006);
    CHECK(read.payload_type == 98);
    CHECK(read.address == "ff15::1");
    CHECK_FALSE(read.ttl.has_value());
    CHECK(read.source == "fd00::1");
    CHECK(read.kbit_per_second == 300);
    CHECK(read.datagram_bytes == 600);
    CHECK(read.wire_version == 1);
    CHECK(read.ssrc == 5u);
    CHECK(read.cname == "x");
    CHECK(read.name == " ");
    CHECK(read.sender.empty());
}

TEST_CASE("hosts may have names, groups need no TTL, and filters may be for all of them") {
    const auto read = [](const std::string& line, const std::string& other) {
        return parse_session_description(with(line, other));
    };
    CHECK(read(kConnection, "c=IN IP4 hall.example.org").address == "hall.example.org");
    CHECK(read(kConnection, "c=IN IP4 hall.example.org").source.empty());
    CHECK(read(kConnection, "c=IN IP4 192.0.2.7").source.empty());
    CHECK_FALSE(read(kConnection, "c=IN IP4 239.255.0.1").ttl.has_value());
    CHECK(read(kConnection, "c=IN IP4 239.255.0.1/0/1").ttl == 0);
    CHECK(read(kFilter, "a=source-filter: incl IN IP4 * 10.77.0.9").source == "10.77.0.9");
    CHECK(read(kFilter, "").source.empty());
    CHECK(read(kMedium, "m=application 5004/1 RTP/AVP 96").port == 5004);
}

TEST_CASE("the session's filters for other media's addresses do not count") {
    // By value, and names whatever their case.
    const std::string filter = GENERATE(
        "incl IN IP6 ff15:0::77 fd77::1", "excl IN IP6 ff15::77 fd77::1 fd77::2",
        "incl IN IP4 Hall.example.org 10.77.0.1", "incl IN * hall.example.org host.example.org");
    CAPTURE(filter);
    const std::string text = with(kFilter, "a=source-filter: " + filter) +
                             "m=audio 5010 RTP/AVP 0\r\nc=IN IP6 ff15::77\r\n"
                             "m=audio 5012 RTP/AVP 0\r\nc=IN IP4 hall.EXAMPLE.org\r\n";
    CHECK(parse_session_description(text).source.empty());
}

TEST_CASE("a medium's own filter stands in for the session's") {
    const std::string own = "a=source-filter: incl IN IP4 239.255.0.1 10.77.0.9\r\n";
    CHECK(parse_session_description(kGolden + own).source == "10.77.0.9");
    CHECK(parse_session_description(with(kFilter, "a=source-filter: excl IN IP4 * 10.77.0.9") + own)
              .source == "10.77.0.9");
}

TEST_CASE("filters for an address that no c= line of theirs has are refused, with it") {
    const auto [before, address, after] = GENERATE(table<std::string, std::string, std::string>(
        {{"incl IN IP4 ", "239.255.0.2", " 10.77.0.1"},
         {"excl IN IP4 ", "239.255.0.2", " 10.77.0.1"},
         {"incl IN IP4 ", "group.example.org", " 10.77.0.1"},
         {"incl IN * ", "group.example.org", " 10.77.0.1"},
         {"incl IN IP6 ", "ff15::1", " fd77::1"},
         {"incl IN IP4 ", "239.255.0.1/4", " 10.77.0.1"}}));
    CAPTURE(before, address);
    const std::string filter = "a=source-filter: " + before + address + after;
    const std::string said = ": the filter is for '" + address + "'";
    CHECK_THAT(reason_with(kFilter, filter), Catch::StartsWith("line 8" + said));
    // A medium's own cannot be about another medium either.
    const std::string elsewhere = "m=audio 5010 RTP/AVP 0\r\nc=IN IP4 239.255.0.2\r\n";
    CHECK_THAT(reason(kGolden + filter + "\r\n" + elsewhere), Catch::StartsWith("line 15" + said));
}

TEST_CASE("what cannot be is told with its line") {
    CHECK(reason_with("v=0", "v=1") == "line 1: expected v=0, as session descriptions begin");
    CHECK_THAT(reason(""), Catch::StartsWith("line 1: expected v=0"));
    CHECK_THAT(reason(std::string("v=0\n\0\n", 6)), Catch::StartsWith("line 2: holds a zero byte"));
    CHECK_THAT(reason("v=0\nx=1\n"), Catch::StartsWith("line 2: expected a letter of SDP"));
    CHECK_THAT(reason("v=0\n\n"), Catch::StartsWith("line 2: expected a letter of SDP"));
    CHECK_THAT(reason("v=0\n\x1b[2J\n"), Catch::Contains("'_[2J'"));
    CHECK_THAT(reason("v=0\ns=" + std::string(kMaxSessionDescriptionLine, 'x')),
               Catch::StartsWith("line 2: is longer than 4096 bytes"));
    CHECK(reason(kGolden + std::string(kMaxSessionDescriptionBytes, '\n')) ==
          "is larger than 65536 bytes");
    CHECK_THAT(reason_with("s=horse", ""), Catch::Contains("no s= line"));
    CHECK_THAT(reason_with("t=0 0", ""), Catch::Contains("no t= line"));
    CHECK_THAT(reason_with("o=- 4822678189205111 1 IN IP4 10.77.0.1", ""),
               Catch::Contains("no o= line"));
    CHECK_THAT(reason_with("o=- 4822678189205111 1 IN IP4 10.77.0.1", "o=- x 1 IN IP4 h"),
               Catch::StartsWith("line 2: expected o="));
    CHECK_THAT(reason_with("o=- 4822678189205111 1 IN IP4 10.77.0.1",
                           "o=- 1 99999999999999999999 IN IP4 h"),
               Catch::StartsWith("line 2: expected o="));
    CHECK_THAT(reason_with("b=AS:20000", "b=AS:-1"), Catch::StartsWith("line 5: the bandwidth"));
}

TEST_CASE("addresses that cannot be are told with their line") {
    const std::string line = GENERATE(
        "c=IN IP4 239.255.0.1/256", "c=IN IP4 239.255.0.1/", "c=IN IP4 239.255.0.1/4/2",
        "c=IN IP4 239.255.0.1/4/1/1", "c=IN IP4 239.255.0.1/-1", "c=IN IP4 192.0.2.7/4",
        "c=IN IP4 ff15::1", "c=IN IP6 239.255.0.1", "c=IN IP6 ff15::1/4", "c=IN IP6 ff15::1%eth0",
        "c=IN IP4 a_b", "c=IN IP4 -oops", "c=IN IP4", "c=ATM IP4 239.255.0.1", "c=IN IP5 1.2.3.4",
        "c=IN IP4 239.255.0.1 4", "c=IN IP4 host/1");
    CAPTURE(line);
    CHECK_THAT(reason_with(kConnection, line), Catch::StartsWith("line 4: "));
}

TEST_CASE("two or no addresses of one stream are refused") {
    CHECK_THAT(reason_with(kConnection, ""), Catch::Contains("there is no c= line"));
    CHECK_THAT(reason_with(kConnection, std::string(kConnection) + "\n" + kConnection),
               Catch::StartsWith("line 5: there is another c= line"));
}

TEST_CASE("filters that cannot be honoured are refused, never passed over") {
    const std::string line = GENERATE(
        "a=source-filter: excl IN IP4 239.255.0.1 10.77.0.1",
        "a=source-filter: excl IN IP4 * 10.77.0.1",
        "a=source-filter: incl IN IP4 239.255.0.1 10.77.0.1 10.77.0.2",
        "a=source-filter: incl IN IP4 239.255.0.1 fd77::1",
        "a=source-filter: incl IN * 239.255.0.1 fd77::1",
        "a=source-filter: incl IN IP4 239.255.0.1 239.255.0.1",
        "a=source-filter: incl IN IP4 239.255.0.1 host", "a=source-filter: incl IN IP4 239.255.0.1",
        "a=source-filter: some IN IP4 * 10.77.0.1", "a=source-filter: incl XX IP4 * 10.77.0.1",
        "a=source-filter:");
    CAPTURE(line);
    CHECK_THAT(reason_with(kFilter, line), Catch::StartsWith("line 8: "));
}

TEST_CASE("media that cannot be are told with their line") {
    const std::string port =
        GENERATE("0", "70000", "-1", "+5004", "5004/2", "5004/", "5004/1/1", "x", "0x1");
    CAPTURE(port);
    CHECK_THAT(reason_with(kMedium, "m=application " + port + " RTP/AVP 96"),
               Catch::StartsWith("line 9: "));
    CHECK_THAT(reason_with(kMedium, "m=application 5004 RTP/AVP"), Catch::StartsWith("line 9: "));
}

TEST_CASE("streams that are none of ours are told") {
    const auto nothing = Catch::StartsWith("describes no ellicast stream");
    CHECK_THAT(reason_with(kMap, "a=rtpmap:96 H264/90000"), nothing);
    CHECK_THAT(reason_with(kMap, "a=rtpmap:97 ellicast/90000"), nothing);
    CHECK_THAT(reason_with(kMap, ""), nothing);
    CHECK_THAT(reason_with(kMedium, "m=application 5004 udp 96"), nothing);
    CHECK_THAT(reason_with(kMedium, ""), nothing);
}

TEST_CASE("bad attributes of ours are told with their line") {
    CHECK_THAT(reason_with(kMap, "a=rtpmap:96 ellicast/8000"), Catch::StartsWith("line 12: "));
    CHECK_THAT(reason_with(kMap, "a=rtpmap:96 ellicast"), Catch::StartsWith("line 12: "));
    CHECK_THAT(reason(with(kMedium, "m=application 5004 RTP/AVP 8")
                          .replace(kGolden.find(kMap) - 1, std::string(kMap).size(),
                                   "a=rtpmap:8 ellicast/90000")),
               Catch::StartsWith("line 12: the payload type"));
    const auto with_format = [](const std::string& format) {
        return reason(kGolden + "a=fmtp:96 " + format);
    };
    CHECK(with_format("version=2") ==
          "line 15: the stream is of version 2, and this program knows 1");
    for (const std::string format : {"version=0", "version=256", "datagram=575", "datagram=65508",
                                     "sealed=yes", "key=12", "key"}) {
        CAPTURE(format);
        CHECK_THAT(with_format(format), Catch::StartsWith("line 15: bad '"));
    }
    CHECK_THAT(reason(kGolden + "a=ssrc:4294967296 cname:x"),
               Catch::StartsWith("line 15: the SSRC"));
    CHECK_THAT(reason(kGolden + "a=ssrc:"), Catch::StartsWith("line 15: the SSRC"));
}

TEST_CASE("no prefix of a description and no damaged byte does harm") {
    for (std::size_t length = 0; length < kGolden.size(); ++length) {
        (void)reason(kGolden.substr(0, length));
        std::string damaged = kGolden;
        damaged[length] = static_cast<char>(damaged[length] ^ 0x15);
        (void)reason(damaged);
    }
    CHECK_FALSE(reason(kGolden.substr(0, kGolden.find("a=rtpmap"))).empty());
}
