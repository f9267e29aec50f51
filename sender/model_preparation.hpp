// sender/model_preparation.hpp
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "common/triangle_mesh.hpp"

namespace ellicast::sender {

/// A model made ready for decomposition. Frame: the file's.
struct PreparedModel {
    /// The user's vertices that a triangle uses, in file order; exact duplicates of a position kept
    /// once. These are what is sent.
    std::vector<Eigen::Vector3d> vertices;
    /// Red green blue, one for each of `vertices`; empty when the input has none. Of duplicates the
    /// first's.
    std::vector<common::Colour> colours;
    /// Closed and consistently oriented (outward): the input with boundary loops capped and
    /// non-manifold places split. The first vertices.size() positions are `vertices`, copies and
    /// cap centres follow; all are used.
    common::TriangleMesh solid;
    /// The user's triangles as far as they say something of the shape (no caps), corners in
    /// `vertices`, turned as `solid` has them.
    std::vector<common::Triangle> faces;
    /// What was done to get there, one line each, for the user ("filled 5 holes", ...).
    std::vector<std::string> warnings;
};

/// Strips unreferenced vertices, drops degenerate and duplicate triangles, splits non-manifold
/// edges and vertices, orients each component consistently and outward, caps boundary loops (fan
/// from the loop's centroid; a plain triangle for loops of three). Components nested as inner
/// shells (cavities) keep their inward orientation; what lies in the void faces outward, however
/// the file has it. One-sided surfaces (Moebius) are cut open. Two faces with the same corners that
/// look opposite ways cancel, unless a whole part is doubled so: then one side stays. Throws
/// std::invalid_argument with a one-line reason when nothing with a volume remains: no faces, all
/// degenerate, |volume| below 1e-9 of the cubed diagonal. Cost: linear up to a sort. The input is
/// used up on the way, so that a large one is not there twice.
PreparedModel prepare_model(common::TriangleMesh input);

/// What the hint says of the shape.
struct ShapePromise {
    std::uint32_t components = 1;
    std::int32_t euler_all = 2;
    std::int32_t euler_largest = 2;
    bool approximate = false;
    std::string reason;  // why approximate; "" otherwise
};

/// The topology of the boundary of the union of the solid, as marching cubes on its voxels sees it
/// at 96, 128, 192 and 256 cells, checked against the model's own (analyse_topology of solid).
/// Where some grid agrees (and holds between half and twice the volume, so that it has not just
/// caught a corner), that is promised; where none does, the finest grid's is, and approximate is
/// set with the reason. A cavity (winding number 0 behind an inner shell) is part of the solid's
/// boundary, a body inside a body is not. Threads do not change the result.
ShapePromise promise_topology(const PreparedModel& model, unsigned threads = 0);

}  // namespace ellicast::sender
