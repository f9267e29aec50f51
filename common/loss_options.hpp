// common/loss_options.hpp
#pragma once

#include <CLI/App.hpp>

#include "common/loss_model.hpp"

namespace ellicast::common {

/// Registers --drop, --drop-ellipsoids, --drop-vertices, --loss, --reorder, --duplicate, --corrupt
/// and
/// --loss-seed in the help group "Simulated loss"; parsing fills `options`, which must outlive the
/// app's parse. Values out of range, unknown processes and unreadable trace files end in a
/// CLI::ParseError whose line names the flag.
void add_loss_options(CLI::App& app, ImpairmentOptions& options);

}  // namespace ellicast::common
