// sender/datagram_security.cpp
#include "sender/datagram_security.hpp"

#include <cassert>
#include <utility>

namespace ellicast::sender {

DatagramSecurity::DatagramSecurity(StreamKeys keys, const protocol::SessionId& session,
                                   std::uint64_t start_us)
    : keys_(std::move(keys)), start_us_(start_us) {
    assert(keys_.protection().any());
    if (keys_.psk) seal_.emplace(*keys_.psk, session);
    if (keys_.sign) key_id_ = common::key_id(keys_.sign->public_key());
}

std::vector<std::uint8_t> DatagramSecurity::secure(std::span<const std::uint8_t> clear,
                                                   std::uint64_t since_start_us) {
    const protocol::SecurityHeader header{.session_start_us = start_us_,
                                          .sent_us = start_us_ + since_start_us,
                                          .counter = counter_++,
                                          .key = key_id_};
    std::vector<std::uint8_t> bytes = protocol::make_secured(clear, keys_.protection(), header);
    const auto parts = protocol::parts_of(bytes);
    if (seal_) {
        seal_->seal(header.counter, parts.associated, parts.sections,
                    parts.tag.first<protocol::kTagBytes>());
    }
    if (keys_.sign) {
        const std::span<const std::uint8_t> covered(bytes.data(),
                                                    bytes.size() - parts.signature.size());
        keys_.sign->sign(covered, parts.signature.first<protocol::kSignatureBytes>());
    }
    return bytes;
}

}  // namespace ellicast::sender
