// tests/fuzz/session_description_fuzz.cpp: session descriptions as files that anyone may have made.
#include <arpa/inet.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>

#include "protocol/description.hpp"
#include "protocol/ip_address.hpp"
#include "protocol/session_description.hpp"

namespace {

using namespace ellicast::protocol;

[[noreturn]] void fail(const char* promise) {
    std::fprintf(stderr, "broken promise: %s\n", promise);
    std::abort();
}

bool system_reads(const std::string& text) {
    std::array<std::uint8_t, 16> bytes{};
    return ::inet_pton(AF_INET, text.c_str(), bytes.data()) == 1 ||
           ::inet_pton(AF_INET6, text.c_str(), bytes.data()) == 1;
}

void check_accepted(const SessionDescription& read) {
    if (read.port == 0) fail("a port is above 0");
    if (read.payload_type < 96 || read.payload_type > 127) fail("a payload type is dynamic");
    if (!is_presentable(read.name) || !is_presentable(read.cname)) fail("texts can be shown");
    if (!read.source.empty() && (!read.to_group() || !system_reads(read.source))) {
        fail("a source is a host's address, of a group");
    }
    if (!parse_ip_address(read.address)) return;  // a host's name; the writer takes addresses
    if (!system_reads(read.address)) fail("an address is one to the system");
    SessionDescription again = read;
    const bool v6 = again.address.find(':') != std::string::npos;
    if (again.to_group() && !v6 && !again.ttl) again.ttl = 1;
    if (parse_session_description(session_description_text(again)) != again) {
        fail("what was read can be written and read again");
    }
}

}  // namespace

// libFuzzer's name for it.
// NOLINTNEXTLINE(readability-identifier-naming)
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    std::string text(size, '\0');
    if (size > 0) std::memcpy(text.data(), data, size);
    try {
        check_accepted(parse_session_description(text));
    } catch (const SessionDescriptionError& error) {
        if (!is_presentable(error.what())) fail("a reason is one line that can be shown");
    }
    return 0;
}
