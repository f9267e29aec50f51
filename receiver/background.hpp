// receiver/background.hpp
#pragma once

#include <atomic>
#include <exception>

#include "receiver/reconstruction.hpp"

namespace ellicast::receiver {

/// Leaves a reconstruction between two stages.
struct Stopped : std::exception {};

/// For a reconstruction beside reception: on one thread, the other cores are for reception; throws
/// Stopped out of reconstruct() at the next stage once `stop` is set, which must outlive it.
inline ReconstructionOptions background_options(int grid, bool conceal,
                                                const std::atomic<bool>& stop) {
    ReconstructionOptions options;
    options.grid = grid;
    options.conceal = conceal;
    options.threads = 1;
    options.on_stage = [&stop](const char*) {
        if (stop) throw Stopped();
    };
    return options;
}

}  // namespace ellicast::receiver
