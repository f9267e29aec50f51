// sender/decomposition.hpp
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/ellipsoid.hpp"
#include "common/triangle_mesh.hpp"

namespace ellicast::sender {

enum class Criterion {
    volume,  // [BK02] section 3.3: covered volume, ties by the smaller minimum radius
    robust   // expected coverage under loss, weighted by thinness (DESIGN section 3)
};

struct DecompositionOptions {
    std::size_t ellipsoids = 400;     // how many to select
    std::size_t candidates = 10'000;  // how many seeds to grow
    Criterion criterion = Criterion::robust;
    double expected_loss = 0.3;  // probability that a selected ellipsoid is lost; robust only
    int refine = 20;             // rounds of local optimisation of the selected; 0: none
    int grid = 128;              // selection voxels along the longest axis
    int presmooth = -1;          // Laplacian steps; -1: by the mesh's density (0 to 3)
    double epsilon = 0.0004;     // offset of the touching points, share of the diagonal
    double facet_edge = 0.02;  // triangles with a longer edge, share of the diagonal, bound growth
                               // with their whole face, the others with their corners
    double max_aspect = 8;     // longest over shortest axis while growing
    std::uint64_t seed = 1;
    unsigned threads = 0;  // does not change the result
};

/// CPU seconds are the caller's business; counts are the decomposition's.
struct Decomposition {
    std::vector<common::Ellipsoid>
        ellipsoids;              // in order of selection: any prefix is a good choice
    std::size_t seeds = 0;       // tried
    std::size_t candidates = 0;  // grown to an ellipsoid
    double covered = 0;          // share of the solid's voxels covered by the selection
    double outside = 0;          // covered voxels outside the solid, share of the solid's voxels
};

/// [BK02] section 3, whole: presmoothing, surface seeds, growth sphere -> alpha -> beta with
/// epsilon, and selection; then the selected are refined (ellipsoid_refinement.hpp) and ordered
/// anew by the same rule. A solid of more than 2^20 triangles is clustered to a 512th of the
/// diagonal for growth and refinement. `solid` is closed and outward oriented
/// (PreparedModel::solid). Results are in its frame and unit; inside, everything is scaled to a
/// bounding-box diagonal of 1. Fewer than options.ellipsoids come back only when no candidate adds
/// anything. Same solid, options: same bits, on any number of threads. Throws std::invalid_argument
/// when not a single ellipsoid grows.
Decomposition decompose(const common::TriangleMesh& solid, const DecompositionOptions& options);

/// The two halves of decompose, for measuring and for the cache's tests.
std::vector<common::Ellipsoid> grow_candidates(const common::TriangleMesh& solid,
                                               const DecompositionOptions& options);
Decomposition select_ellipsoids(const std::vector<common::Ellipsoid>& candidates,
                                const common::TriangleMesh& solid,
                                const DecompositionOptions& options);

/// Key of a cached decomposition: 16 bytes of BLAKE2b over solid and every option that changes the
/// result, as hex, with a format version.
std::string decomposition_key(const common::TriangleMesh& solid,
                              const DecompositionOptions& options);

/// Writes and reads a decomposition file (binary, versioned, checksummed; atomic). Reading gives
/// nothing when the file is missing, damaged, or of another key; never throws for those. Writing
/// throws common::ModelError.
void write_decomposition(const std::filesystem::path& path, const std::string& key,
                         const Decomposition& decomposition);
std::optional<Decomposition> read_decomposition(const std::filesystem::path& path,
                                                const std::string& key);

}  // namespace ellicast::sender
