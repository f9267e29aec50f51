// receiver/reconstruction.hpp
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/mesh_topology.hpp"
#include "common/triangle_mesh.hpp"
#include "receiver/confidence.hpp"
#include "receiver/received_object.hpp"
#include "receiver/ring_repair.hpp"

namespace ellicast::receiver {

struct ReconstructionOptions {
    int grid = 96;         // cells of the distance grid along the longest axis of the hinted box
    unsigned threads = 0;  // does not change the result
    bool conceal = true;   // guess the missing vertices; changes nothing when none is missing
    bool keep_stages = false;
    /// Called with the name of the stage that begins; for progress and timing. May be empty.
    std::function<void(const char* stage)> on_stage = {};
};

/// Figure 7 of [BK02], as meshes in the object's frame plus origin.
struct Stages {
    common::TriangleMesh ellipsoids;      // a small mesh for each received ellipsoid
    common::TriangleMesh marching_cubes;  // after isolevel choice, before anything else
    common::TriangleMesh halfway;  // the first chunk inserted, marching-cubes vertices still in
};

/// Where a vertex of the result comes from. The values are those of the written PLY.
enum class Provenance : std::uint8_t {
    received = 0,   // measured: a record, in its place
    concealed = 1,  // guessed on an edge between other vertices (receiver/concealment.hpp)
    coarse = 2,  // of the marching-cubes mesh, from ellipsoids; stayed where nothing else is near
};

struct Reconstruction {
    common::TriangleMesh mesh;                // positions = float32 record + origin
    std::vector<std::uint32_t> vertex_index;  // per position: record index, or kNotReceived
    std::vector<Provenance> provenance;       // per position
    Confidence confidence;                    // per position; model units
    ConfidenceSummary summary;
    std::vector<std::uint32_t> not_inserted;  // record indices that are no vertex of the mesh
    common::MeshTopology topology;
    bool topology_as_promised =
        false;           // components, Euler characteristic in all and of the largest
    bool judged = true;  // false when the sender promised only approximately
    float isolevel = 0;  // model units; with vertices, what was added to the local one
    std::optional<RingAgreement> rings;  // of received vertices in the mesh; with ring tags
    std::optional<Stages> stages;
};

inline constexpr std::uint32_t kNotReceived = 0xffffffffu;

/// The receiver's half of [BK02]: distance grid, marching cubes, vertex insertion, removal of the
/// marching-cubes vertices (sections 2 and 4.2). Empty when not a single ellipsoid arrived. The
/// mesh is a closed, oriented 2-manifold whatever subset arrived. Same object, options: same bits,
/// on any number of threads.
std::optional<Reconstruction> reconstruct(const ReceivedObject& object,
                                          const ReconstructionOptions& options = {});

}  // namespace ellicast::receiver
