// receiver/surface_walk.hpp
#pragma once

#include <Eigen/Core>
#include <limits>
#include <optional>

#include "receiver/mesh_regions.hpp"
#include "receiver/surface_mesh.hpp"

namespace ellicast::receiver {

/// The point of a face that is closest to some point in space.
struct SurfacePlace {
    FaceId face = kNone;
    Eigen::Vector3d point = Eigen::Vector3d::Zero();
    Eigen::Vector3d barycentric = Eigen::Vector3d::Zero();
    double squared_distance = std::numeric_limits<double>::infinity();
};

/// The place of x on one face.
SurfacePlace place_on_face(const SurfaceMesh& mesh, FaceId face, const Eigen::Vector3d& x);

/// Walks from face to face, from `start`, as long as that comes closer to x, and at most 64 steps:
/// over the edge on which the closest point lies, or round the vertex. What it finds is closest
/// among its neighbours, and of all when the start is near it. Cost: about three faces a step; 150
/// ns where the start is the goal.
SurfacePlace walk_to_closest(const SurfaceMesh& mesh, FaceId start, const Eigen::Vector3d& x);

/// The same within a region of `regions`, while others are at work; empty where the walk comes to a
/// face at a border.
std::optional<SurfacePlace> walk_to_closest(const SurfaceMesh& mesh, FaceId start,
                                            const Eigen::Vector3d& x, const MeshRegions& regions);

}  // namespace ellicast::receiver
