#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "common/mesh_topology.hpp"
#include "receiver/received_object.hpp"
#include "receiver/reconstruction.hpp"

namespace ellicast::receiver {

/// What became of one page; the records that it was made of, the mesh, and where that is.
struct PageResult {
    std::string name;
    std::uint32_t version = 1;
    protocol::ObjectId object{};
    std::size_t ellipsoids = 0;
    std::size_t vertices = 0;
    std::size_t conflicting = 0;
    protocol::Hint hint;
    bool complete = false;
    bool id_verified = false;
    bool has_mesh = false;  // of the rest nothing holds without
    std::filesystem::path output;
    common::MeshTopology topology;
    bool topology_as_promised = false;
    bool judged = true;
    std::string error;  // why it could not be written; "" when it was, or there was nothing to

    /// Whether a group of so much would make the same mesh again.
    [[nodiscard]] bool is_of(const protocol::ObjectId& id, std::size_t its_ellipsoids,
                             std::size_t its_vertices, std::size_t its_conflicting) const {
        return object == id && ellipsoids == its_ellipsoids && vertices == its_vertices &&
               conflicting == its_conflicting;
    }
};

/// What a page is to be called and put.
struct PageTask {
    std::string name;
    std::uint32_t version = 1;
    std::size_t conflicting = 0;
    std::filesystem::path output;
};

/// The result without a mesh.
PageResult result_of(const PageTask& task, const ReceivedObject& object);

/// With one, as written to task.output.
PageResult result_of(const PageTask& task, const ReceivedObject& object,
                     const Reconstruction& reconstruction);

/// Rebuilds and writes a page. What goes wrong with the file is in the result. Throws what
/// options.on_stage throws.
PageResult make_page(const PageTask& task, const ReceivedObject& object,
                     const ReconstructionOptions& options);

/// One entry of `pages` in the report:
///   name, object_id, version
///   output      path, or null without a mesh
///   complete, id_verified
///   ellipsoids, vertices   {received, expected}
///   mesh        {vertices, faces, components, genus, closed, manifold, topology_as_promised,
///               judged}, or null
nlohmann::ordered_json page_json(const PageResult& result);

/// A line for people, with its end.
std::string page_text(const PageResult& result);

}  // namespace ellicast::receiver
