// common/mesh_distance.hpp
#pragma once

#include <cstddef>
#include <cstdint>

#include "common/triangle_mesh.hpp"

namespace ellicast::common {

struct MeshDistanceOptions {
    std::size_t samples = 100'000;  // each way, stratified by area
    std::uint64_t seed = 1;
    unsigned threads = 0;  // 0: one per core; does not change the result
};

/// Distances between two surfaces, all as shares of the reference's bounding-box diagonal.
struct MeshDistance {
    double rms_to_reference = 0;    // samples of the mesh to the reference
    double rms_from_reference = 0;  // samples of the reference to the mesh
    double mean_to_reference = 0;
    double mean_from_reference = 0;
    double max = 0;  // over samples and vertices of both, both ways
    double normal_deg =
        0;  // mean angle, area-weighted, between a sample's and its closest triangle's normal

    [[nodiscard]] double rms() const {
        return rms_to_reference > rms_from_reference ? rms_to_reference : rms_from_reference;
    }
    [[nodiscard]] double mean() const {
        return mean_to_reference > mean_from_reference ? mean_to_reference : mean_from_reference;
    }
};

/// Area-stratified samples: triangle areas are accumulated in index order, sample k lies at area
/// (k + jitter_k) / n, uniform inside its triangle. Closest points are exact (TriangleTree).
/// Requires both to have a triangle of positive area; throws std::invalid_argument otherwise.
MeshDistance measure_distance(const TriangleMesh& mesh, const TriangleMesh& reference,
                              const MeshDistanceOptions& options = {});

}  // namespace ellicast::common
