// common/mesh_distance.hpp
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

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
    // Mean angle between a sample's and its closest triangle's normal; samples are even in area.
    // The larger of the two directions. Zero-area triangles have no normal and are left out.
    double normal_deg = 0;

    [[nodiscard]] double rms() const {
        return rms_to_reference > rms_from_reference ? rms_to_reference : rms_from_reference;
    }
    [[nodiscard]] double mean() const {
        return mean_to_reference > mean_from_reference ? mean_to_reference : mean_from_reference;
    }
};

/// A point of a surface and the triangle it was taken from.
struct SurfaceSample {
    Eigen::Vector3d point = Eigen::Vector3d::Zero();
    std::uint32_t triangle = 0;
};

/// `count` area-stratified samples: triangle areas are accumulated in index order, sample k lies at
/// area (k + jitter_k) / count, uniform inside its triangle. Zero-area triangles get none. Same
/// input, same bits. Throws std::invalid_argument when the area is zero or not finite. Linear.
std::vector<SurfaceSample> sample_surface(const TriangleMesh& mesh, std::size_t count,
                                          std::uint64_t seed);

/// Distances of samples and of referenced vertices of either surface to the other. Samples as
/// sample_surface() takes them, with the same seed on both, so that swapping the two surfaces swaps
/// the two directions. Closest points are exact (TriangleTree). Requires both to have a triangle of
/// positive area, finite positions and at least one sample; throws std::invalid_argument otherwise.
/// Cost: samples and vertices times the logarithm of the other mesh.
MeshDistance measure_distance(const TriangleMesh& mesh, const TriangleMesh& reference,
                              const MeshDistanceOptions& options = {});

}  // namespace ellicast::common
