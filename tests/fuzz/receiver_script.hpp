// tests/fuzz/receiver_script.hpp: a sequence of datagrams and pauses as bytes, for fuzzing the
// receiver.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace ellicast::tests {

/// One datagram and what surrounds it.
struct ScriptStep {
    /// Bits 0-1: source. Bits 2-4: pause before it, from none to minutes. Bit 5: make its checksum
    /// right. Bit 6: let the session look at the time.
    std::uint8_t control = 0;
    std::vector<std::uint8_t> datagram;  // at most 65535 bytes
};

/// How the session is set up, then what happens. Any bytes are a script, and a script survives
/// encoding and decoding.
struct ReceiverScript {
    /// Bits 0-1: Until. Bit 2: simulated loss. Bit 3: tight limits. Bit 4: all pages.
    std::uint8_t set_up = 0;
    std::vector<ScriptStep> steps;
};

inline constexpr std::uint8_t kFixChecksum = 1 << 5;
inline constexpr std::uint8_t kPoll = 1 << 6;

ReceiverScript decode_script(std::span<const std::uint8_t> bytes);
std::vector<std::uint8_t> encode_script(const ReceiverScript& script);

}  // namespace ellicast::tests
