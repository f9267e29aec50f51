// tests/tools/first_shape_tables.hpp: what the runs of first_shape_runs.hpp say together.
#pragma once

#include <ostream>
#include <span>

#include "tests/tools/first_shape_runs.hpp"

namespace ellicast::tests {

/// A line for each mesh that a receiver had.
void write_shape_csv(std::ostream& out, std::span<const ShapeRun> runs);

/// The median rms of the measured runs at each of some moments, "nan" while half of them have
/// nothing: curves to plot.
void write_shape_curves(std::ostream& out, std::span<const ShapeRun> runs);

/// Seconds and errors by loss, as Markdown.
void write_shape_tables(std::ostream& out, std::span<const ShapeRun> runs);

/// Shares lacking after each round, beside powers of the loss, as Markdown.
void write_rounds_table(std::ostream& out, std::span<const RoundsRun> runs);

}  // namespace ellicast::tests
