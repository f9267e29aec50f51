// tests/fuzz/make_session_description_corpus.cpp: writes the seeds of corpus/session_description.
//     build/release/tests/fuzz/make_session_description_corpus
//     tests/fuzz/corpus/session_description
#include <string>
#include <vector>

#include "protocol/session_description.hpp"
#include "tests/fuzz/corpus_writer.hpp"

namespace {

using ellicast::protocol::SessionDescription;
using ellicast::tests::Seed;

std::vector<std::uint8_t> bytes_of(const std::string& text) {
    return {text.begin(), text.end()};
}

SessionDescription group() {
    SessionDescription made;
    made.name = "horse";
    made.session = 1;
    made.sender = "10.0.0.1";
    made.address = "239.255.0.1";
    made.ttl = 1;
    made.port = 5004;
    made.source = "10.0.0.1";
    made.kbit_per_second = 20'000;
    made.ssrc = 7;
    made.cname = "00112233445566aa";
    made.wire_version = ellicast::protocol::kWireVersion;
    made.datagram_bytes = 1200;
    return made;
}

SessionDescription group_v6() {
    SessionDescription made = group();
    made.address = "ff35::77";
    made.ttl.reset();
    made.sender = made.source = "fd77::1";
    made.sealed = true;
    made.public_key = std::string(64, '7');
    return made;
}

SessionDescription host() {
    SessionDescription made;
    made.address = "192.0.2.7";
    made.port = 6000;
    return made;
}

const std::string kOthers =
    "v=0\no=- 1 1 IN IP6 ::1\ns= \nc=IN IP4 a.example\nt=0 0\nr=7d 1h 0 25h\nz=0 -1h\n"
    "m=video 5000 RTP/AVP 96\na=rtpmap:96 H264/90000\nm=application 5006/1 RTP/AVP 0 98\n"
    "c=IN IP6 ff15::1.2.3.4/1\nk=clear:x\na=rtpmap:98 Ellicast/90000\na=fmtp:98 x; sealed=0 ;\n"
    "a=source-filter:incl IN * * fd00::1\na=ssrc:1 cname:a\n";

}  // namespace

int main(int argc, char** argv) {
    std::string bad_port = session_description_text(host());
    bad_port.replace(bad_port.find("6000"), 4, "70000");
    return ellicast::tests::write_corpus(
        argc, argv,
        {{"group", bytes_of(session_description_text(group()))},
         {"group-v6", bytes_of(session_description_text(group_v6()))},
         {"host", bytes_of(session_description_text(host()))},
         {"others", bytes_of(kOthers)},
         {"bad-port", bytes_of(bad_port)},
         {"zero-byte", bytes_of(std::string("v=0\no=\0\n", 8))},
         {"binary", bytes_of("\x80\x60\xff")}});
}
