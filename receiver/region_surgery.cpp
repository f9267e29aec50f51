// receiver/region_surgery.cpp
#include "receiver/region_surgery.hpp"

#include <utility>

#include "receiver/edge_flips.hpp"

namespace ellicast::receiver {

RegionSurgery::RegionSurgery(SurfaceMesh& mesh, const MeshRegions& regions,
                             SurfaceMesh::Slots slots)
    : mesh_(mesh), regions_(&regions), slots_(std::move(slots)) {}

std::optional<SurfacePlace> RegionSurgery::walk(FaceId start, const Eigen::Vector3d& x) const {
    if (regions_ == nullptr) return walk_to_closest(mesh_, start, x);
    return walk_to_closest(mesh_, start, x, *regions_);
}

VertexId RegionSurgery::split_face(FaceId f, const Eigen::Vector3d& p) {
    return regions_ == nullptr ? mesh_.split_face(f, p) : mesh_.split_face(f, p, slots_);
}

VertexId RegionSurgery::split_edge(HalfedgeId h, const Eigen::Vector3d& p) {
    return regions_ == nullptr ? mesh_.split_edge(h, p) : mesh_.split_edge(h, p, slots_);
}

void RegionSurgery::collapse(HalfedgeId h) {
    if (regions_ == nullptr) return mesh_.collapse(h);
    mesh_.collapse(h, slots_);
}

void RegionSurgery::flip_to_delaunay(std::vector<HalfedgeId>& queue) {
    if (regions_ == nullptr) {
        receiver::flip_to_delaunay(mesh_, queue);
    } else {
        receiver::flip_to_delaunay(mesh_, queue, *regions_, put_off_);
    }
}

void RegionSurgery::finish() {
    mesh_.give_back(std::exchange(slots_, {}));
    std::erase_if(put_off_, [&](HalfedgeId h) {  // gone with a vertex
        return !mesh_.face_alive(SurfaceMesh::face_of(h));
    });
    receiver::flip_to_delaunay(mesh_, put_off_);
}

}  // namespace ellicast::receiver
