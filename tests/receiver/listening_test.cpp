#include "receiver/listening.hpp"

#include <catch2/catch.hpp>
#include <fstream>
#include <string>

#include "tests/support/child_process.hpp"

namespace {

using namespace ellicast;
using namespace ellicast::receiver;

const std::string kText =
    "v=0\no=- 1 1 IN IP4 10.77.0.1\ns=horse\nc=IN IP4 232.7.7.7/4\nt=0 0\n"
    "a=source-filter: incl IN IP4 232.7.7.7 10.77.0.1\nm=application 6000 RTP/AVP 99\n"
    "a=rtpmap:99 ellicast/90000\n";

struct Place {
    tests::TemporaryDirectory directory;
    Options options;

    explicit Place(const std::string& text) {
        options.interface = "eth7";
        options.sdp = directory.path() / "stream.sdp";
        std::ofstream(*options.sdp, std::ios::binary) << text;
    }
    [[nodiscard]] std::string reason() const {
        try {
            (void)listening_of(options);
        } catch (const ListenError& error) {
            return error.what();
        }
        return "";
    }
};

std::string with_connection(const std::string& address) {
    std::string text = kText;
    const std::string old = "IN IP4 232.7.7.7/4";
    return text.replace(text.find(old), old.size(), address);
}

}  // namespace

TEST_CASE("a group's description says where to listen, to whom, and for what") {
    const Listening listening = listening_of(Place(kText).options);
    CHECK(listening.where.listen == common::Endpoint{"232.7.7.7", 6000});
    CHECK(listening.where.source == "10.77.0.1");
    CHECK(listening.where.interface == "eth7");
    CHECK(listening.payload_type == 99);
    CHECK(listening.description->name == "horse");
}

TEST_CASE("a host's description says the port, whichever its address is here") {
    for (const char* address : {"IN IP4 192.0.2.7", "IN IP6 2001:db8::7", "IN IP4 hall.example"}) {
        CAPTURE(address);
        const ListenOptions where = listening_of(Place(with_connection(address)).options).where;
        CHECK(where.listen == common::Endpoint{"", 6000});
        CHECK(where.source.empty());
    }
}

TEST_CASE("without a description the options say where to listen, for any payload type") {
    Options options;
    options.listen = {"239.1.1.1", 7000};
    options.source = "10.0.0.1";
    const Listening listening = listening_of(options);
    CHECK(listening.where.listen == options.listen);
    CHECK(listening.where.source == options.source);
    CHECK_FALSE(listening.payload_type.has_value());
    CHECK_FALSE(listening.description.has_value());
}

TEST_CASE("a file that cannot be used is named, and its line") {
    const Place bad(with_connection("IN IP4 232.7.7.7/400"));
    CHECK(bad.reason() ==
          "--sdp " + bad.options.sdp->string() + ": line 4: the TTL '400' is not from 0 to 255");
    const Place large(kText + std::string(1 << 20, '\n'));
    CHECK_THAT(large.reason(), Catch::EndsWith("stream.sdp: is larger than 65536 bytes"));
    Place missing(kText);
    missing.options.sdp = missing.directory.path() / "none";
    CHECK_THAT(missing.reason(), Catch::EndsWith("none: No such file or directory"));
    missing.options.sdp = missing.directory.path();
    CHECK_THAT(missing.reason(), Catch::EndsWith(": Is a directory"));
    missing.options.sdp = "/dev/zero";  // without an end
    CHECK_THAT(missing.reason(), Catch::EndsWith("/dev/zero: is larger than 65536 bytes"));
    missing.options.sdp = "/dev/null";
    CHECK_THAT(missing.reason(), Catch::Contains("line 1: expected v=0"));
}
