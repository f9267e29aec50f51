// sender/stream_security.cpp
#include "sender/stream_security.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <utility>
#include <vector>

#include "common/hex_text.hpp"
#include "common/key_file.hpp"

namespace ellicast::sender {
namespace {

double measured_signing_rate(const StreamKeys& keys, const Options& options,
                             std::size_t ip_udp_bytes) {
    using Clock = std::chrono::steady_clock;
    constexpr int kDatagrams = 200;  // some milliseconds: enough to see through one interrupt
    DatagramSecurity security(keys, {}, 0);
    const std::vector<std::uint8_t> clear(options.datagram_bytes -
                                          security_bytes(keys.protection()));
    const Clock::time_point start = Clock::now();
    for (int k = 0; k < kDatagrams; ++k) (void)security.secure(clear, 0);
    const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
    return 8.0 * kDatagrams * static_cast<double>(options.datagram_bytes + ip_udp_bytes) / seconds;
}

}  // namespace

StreamKeys read_stream_keys(const Options& options) {
    StreamKeys keys;
    if (options.sign) keys.sign = common::read_signing_key(*options.sign);
    if (options.psk) keys.psk = common::read_shared_key(*options.psk);
    return keys;
}

SecuritySummary summarise(const StreamKeys& keys, const Options& options,
                          std::size_t ip_udp_bytes) {
    SecuritySummary summary;
    summary.protection = keys.protection();
    if (!keys.sign) return summary;
    summary.public_key = common::hex_text(keys.sign->public_key());
    spdlog::info("signing as {}", summary.public_key);
    const auto asked = static_cast<double>(options.bits_per_second);
    if (options.bits_per_second != 0 && asked <= kPromisedSignedRate) return summary;
    summary.signing_rate = measured_signing_rate(keys, options, ip_udp_bytes);
    if (options.bits_per_second != 0 && asked > *summary.signing_rate) {
        spdlog::warn(
            "this host signs {:.3g} Mbit/s on one core; the {:.3g} asked for will not be "
            "reached",
            *summary.signing_rate / 1e6, asked / 1e6);
    } else {
        spdlog::info(
            "this host signs {:.3g} Mbit/s on one core; receivers with two cores are "
            "promised to verify {:.0f}",
            *summary.signing_rate / 1e6, kPromisedSignedRate / 1e6);
    }
    return summary;
}

std::optional<DatagramSecurity> begin_security(StreamKeys keys,
                                               const protocol::SessionId& session) {
    if (!keys.protection().any()) return std::nullopt;
    const auto since_1970 = std::chrono::system_clock::now().time_since_epoch();
    const auto start = std::chrono::duration_cast<std::chrono::microseconds>(since_1970).count();
    return DatagramSecurity(std::move(keys), session,
                            static_cast<std::uint64_t>(std::max<decltype(start)>(start, 0)));
}

}  // namespace ellicast::sender
