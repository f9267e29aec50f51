// sender/surface_decimation.hpp
#pragma once

#include <cstdint>
#include <vector>

#include "common/triangle_mesh.hpp"

namespace ellicast::sender {

/// All positions of a surface, in the order in which a decimation removes them: half-edge
/// collapses, so that what remains keeps its place, the cheapest first. A collapse costs what the
/// removed vertex is then off its planes, squared and integrated over their area (quadrics of
/// [GH97]), plus a little for its length. It may neither fold the surface nor change its topology;
/// when no such collapse is left, folds are allowed, and at last anything. Positions that no
/// triangle uses are the last, in spread order, those that stand for more area behind those for
/// less. Works on any set of triangles, whatever its quality; repeated corners are ignored. Ties go
/// by place and index: same surface, same order. Requires finite positions, indices in range. Cost:
/// n log n; memory: about 250 bytes a position.
std::vector<std::uint32_t> removal_order(const common::TriangleMesh& surface);

/// The same decimation, of those vertices only that are not to be kept: what is left of the surface
/// when only `keep`, one value a position, survives. Positions stay as they are, used or not; few
/// others remain, where no collapse was possible. For comparisons.
common::TriangleMesh collapsed_onto(const common::TriangleMesh& surface,
                                    const std::vector<bool>& keep);

}  // namespace ellicast::sender
