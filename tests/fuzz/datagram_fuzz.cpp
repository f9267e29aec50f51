// tests/fuzz/datagram_fuzz.cpp: the datagram decoder, and everything that trusts what it accepts.
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "protocol/datagram.hpp"
#include "tests/protocol/promises.hpp"
#include "tests/protocol/wire_samples.hpp"

namespace {

void check(const ellicast::tests::Bytes& bytes) {
    if (ellicast::tests::refusal_of(bytes)) return;
    const std::string broken = ellicast::tests::broken_promise(bytes);
    if (broken.empty()) return;
    std::fprintf(stderr, "broken promise: %s\n", broken.c_str());
    std::abort();
}

}  // namespace

/// The input as it is, and with its last four bytes made the right checksum, so that the code
/// behind the checksum is reached.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    ellicast::tests::Bytes bytes(data, data + size);
    check(bytes);
    ellicast::tests::fix_checksum(bytes);
    check(bytes);
    return 0;
}
