// receiver/mesh_regions.hpp
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/parallel.hpp"
#include "receiver/surface_mesh.hpp"

namespace ellicast::receiver {

/// Parts of a mesh on which surgery may go on at one time: slabs across its longest extent, each
/// with about the same number of faces. A face is inner when all faces at its three corners are of
/// one region. Surgery of a region starts from inner faces of its own, changes inner faces only,
/// and walks around none but their corners; then it never meets that of another region, and borders
/// stay as they are. New faces are inner. The partition depends on the mesh alone, so that what is
/// done in it does not depend on the number of threads.
class MeshRegions {
  public:
    /// As many regions as are worth their borders; a single one in a small mesh. `shifted` puts the
    /// borders into the middles of the other partition's regions, so that surgery in one after the
    /// other reaches nearly everything. `work`, per face slot, is what regions share evenly beside
    /// their faces; empty: nothing. Linear, on `threads` threads.
    MeshRegions(const SurfaceMesh& mesh, bool shifted, unsigned threads,
                std::span<const std::uint32_t> work = {});

    /// Finds the borders anew, where surgery went on across them; faces keep their region, and new
    /// ones have none. Linear.
    void find_borders(const SurfaceMesh& mesh, unsigned threads);

    [[nodiscard]] std::size_t count() const { return first_.size() - 1; }
    /// Live faces at construction, ascending.
    [[nodiscard]] std::span<const FaceId> faces(std::size_t region) const {
        return std::span(faces_).subspan(first_[region], first_[region + 1] - first_[region]);
    }
    /// Of a face that was there at construction.
    [[nodiscard]] std::size_t region_of(FaceId f) const { return number_[f]; }
    /// Which of `count` things are each region's, ascending; face_of(i) says where one lies.
    template <class FaceOf>
    [[nodiscard]] std::vector<std::vector<std::uint32_t>> share_out(std::size_t count,
                                                                    const FaceOf& face_of) const {
        std::vector<std::vector<std::uint32_t>> shares(this->count());
        for (std::uint32_t i = 0; i < count; ++i) shares[region_of(face_of(i))].push_back(i);
        return shares;
    }
    /// All corners of the face are inner vertices.
    [[nodiscard]] bool inner(FaceId f) const { return f >= border_.size() || border_[f] == 0; }

    /// Calls body(region) for each, on up to `threads` threads (0: one per core).
    template <class Body>
    void for_each(unsigned threads, const Body& body) const {
        common::parallel_for(count(), threads, [&](std::size_t begin, std::size_t end) {
            for (std::size_t region = begin; region < end; ++region) body(region);
        });
    }

  private:
    using Number = std::uint8_t;

    void number_faces(const SurfaceMesh& mesh, std::size_t count, bool shifted, unsigned threads,
                      std::span<const std::uint32_t> work);
    void list_faces(const SurfaceMesh& mesh, std::size_t count);

    std::vector<Number> number_;      // region by face slot
    std::vector<FaceId> faces_;       // by region
    std::vector<std::size_t> first_;  // of a region among them, and the end
    std::vector<char> border_;        // by face slot
};

}  // namespace ellicast::receiver
