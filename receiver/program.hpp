// receiver/program.hpp
#pragma once

#include "receiver/options.hpp"

namespace ellicast::receiver {

/// Exit codes of ellicast-recv.
enum class ExitCode : int { done = 0, usage = 2, nothing_received = 3, wrong_topology = 4 };

/// Checks outputs and reference, receives, rebuilds, writes, reports. Throws common::ModelError and
/// ListenError, whose text is the line that the user needs (ExitCode::usage).
ExitCode run(const Options& options);

}  // namespace ellicast::receiver
