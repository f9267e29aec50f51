// sender/program.hpp
#pragma once

#include <cstdint>

#include "protocol/datagram.hpp"
#include "sender/options.hpp"

namespace ellicast::sender {

/// What identifies a stream; main draws it from the operating system, tests fix it.
struct Identity {
    protocol::SessionId session{};
    std::uint32_t ssrc = 0;
    std::uint16_t first_sequence = 0;
    std::uint32_t first_timestamp = 0;
};

/// All that ellicast-send does once its command line is understood: opens the socket, loads the
/// models, sends the rounds, writes the report; or writes a decomposition. Logs through spdlog;
/// shows progress when stderr is a terminal. Returns when all is sent or a signal ended the
/// sending. Throws SendError, common::ModelError: the user's fault, in one line that names the
/// address or path.
void run(const Options& options, const Identity& identity);

}  // namespace ellicast::sender
