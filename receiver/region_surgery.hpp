// receiver/region_surgery.hpp: private to receiver/vertex_insertion and receiver/vertex_removal.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "receiver/mesh_regions.hpp"
#include "receiver/surface_mesh.hpp"
#include "receiver/surface_walk.hpp"

namespace ellicast::receiver {

/// Edits of a mesh by one who has all of it, or by one of several threads, each of which has a
/// region, slots of its own, and puts off what comes too near to another region.
class RegionSurgery {
  public:
    /// Of all of the mesh.
    explicit RegionSurgery(SurfaceMesh& mesh) : mesh_(mesh) {}
    /// Of a region; splits need `slots`. Mesh and regions must outlive this.
    RegionSurgery(SurfaceMesh& mesh, const MeshRegions& regions, SurfaceMesh::Slots slots);

    /// Whether the face, which a corner that may be changed is at, may be changed as well.
    [[nodiscard]] bool may_change(FaceId f) const {
        return regions_ == nullptr || regions_->inner(f);
    }
    /// As walk_to_closest; empty where the walk comes too near to another region.
    [[nodiscard]] std::optional<SurfacePlace> walk(FaceId start, const Eigen::Vector3d& x) const;

    /// As those of SurfaceMesh; all faces that they change must be such as may be changed.
    VertexId split_face(FaceId f, const Eigen::Vector3d& p);
    VertexId split_edge(HalfedgeId h, const Eigen::Vector3d& p);
    void collapse(HalfedgeId h);
    /// As receiver/edge_flips; `queue` is used up. Edges too near to another region are put off.
    void flip_to_delaunay(std::vector<HalfedgeId>& queue);

    /// When all threads are done, one after the other: gives the slots back and flips what was put
    /// off.
    void finish();

  private:
    SurfaceMesh& mesh_;
    const MeshRegions* regions_ = nullptr;
    SurfaceMesh::Slots slots_;
    std::vector<HalfedgeId> put_off_;
};

}  // namespace ellicast::receiver
