// tests/fuzz/receiver_script.cpp
#include "tests/fuzz/receiver_script.hpp"

#include <algorithm>

namespace ellicast::tests {

ReceiverScript decode_script(std::span<const std::uint8_t> bytes) {
    ReceiverScript script;
    if (bytes.empty()) return script;
    script.set_up = bytes[0];
    bytes = bytes.subspan(1);
    while (bytes.size() >= 3) {
        ScriptStep step;
        step.control = bytes[0];
        const std::size_t wanted = std::size_t{bytes[1]} << 8 | bytes[2];
        bytes = bytes.subspan(3);
        const auto datagram = bytes.first(std::min(wanted, bytes.size()));
        step.datagram.assign(datagram.begin(), datagram.end());
        bytes = bytes.subspan(datagram.size());
        script.steps.push_back(std::move(step));
    }
    return script;
}

std::vector<std::uint8_t> encode_script(const ReceiverScript& script) {
    std::vector<std::uint8_t> bytes{script.set_up};
    for (const ScriptStep& step : script.steps) {
        const std::size_t size = std::min<std::size_t>(step.datagram.size(), 0xffff);
        bytes.push_back(step.control);
        bytes.push_back(static_cast<std::uint8_t>(size >> 8));
        bytes.push_back(static_cast<std::uint8_t>(size));
        bytes.insert(bytes.end(), step.datagram.begin(),
                     step.datagram.begin() + static_cast<std::ptrdiff_t>(size));
    }
    return bytes;
}

}  // namespace ellicast::tests
