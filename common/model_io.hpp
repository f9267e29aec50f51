// common/model_io.hpp
#pragma once

#include <cstddef>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/triangle_mesh.hpp"

namespace ellicast::common {

/// A user's file that cannot be read or written; what() is one line that names the path and the
/// reason.
class ModelError : public std::runtime_error {
  public:
    using std::runtime_error::runtime_error;
};

/// Reads a model file: PLY (ascii, both binary orders), OBJ, OFF, STL, by extension (any case),
/// through OpenMesh with an importer of our own that keeps polygons as they are, non-manifold ones
/// too. Polygons are triangulated (fans from the corner that gives the best shapes; degenerate ones
/// are dropped); STL's repeated corners are welded by equal bits. Positions as in the file. Throws
/// ModelError: missing, empty, truncated (counts in the header are checked against the bytes before
/// anything is allocated) or non-mesh file, no faces, a coordinate that is not finite, a face index
/// out of range. Cost: linear; memory a small multiple of the mesh.
TriangleMesh read_model(const std::filesystem::path& path);

/// A named per-vertex column of a written PLY.
struct PlyVertexProperty {
    std::string name;
    std::vector<float> values;  // one per vertex
};

struct PlyOptions {
    bool double_positions = false;  // else float32
    std::string comment;            // one line; "" for none
    std::vector<PlyVertexProperty> properties;
};

/// Writes a binary little-endian PLY through a temporary beside it and a rename, so that a reader
/// never sees half a file. Same input, same bytes. Throws ModelError (path and reason).
void write_ply(const std::filesystem::path& path, const TriangleMesh& mesh,
               const PlyOptions& options = {});

/// Writes by extension: .ply as above, .obj, .off and .stl through OpenMesh. Throws ModelError.
void write_model(const std::filesystem::path& path, const TriangleMesh& mesh);

}  // namespace ellicast::common
