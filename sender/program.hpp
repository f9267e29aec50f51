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

/// Exit codes of ellicast-send.
enum class ExitCode : int { done = 0, usage = 2, rate_not_kept = 5 };

/// All that ellicast-send does once its command line is understood: opens the socket, loads the
/// models, sends the rounds, writes the report; or writes a decomposition. Logs through spdlog;
/// shows progress when stderr is a terminal. Returns when all is sent, a signal ended the sending,
/// or the rate could not be kept, which is logged. Throws SendError, common::ModelError: the user's
/// fault, in one line that names the address or path.
ExitCode run(const Options& options, const Identity& identity);

}  // namespace ellicast::sender
