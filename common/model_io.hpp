// common/model_io.hpp
#pragma once

#include <cstddef>
#include <cstdint>
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

/// Reads a model file: PLY (ascii, both binary orders), OBJ, OFF (text), STL (both), by extension
/// (any case), through OpenMesh with an importer of our own that keeps polygons as they are,
/// non-manifold ones too. Polygons are triangulated (fans from the corner that gives the best
/// shapes; degenerate ones are dropped); STL's repeated corners are welded where equal. Positions
/// as in the file, in double where it holds more than float32 (OBJ, OFF, PLY columns of double or
/// integers). Colours of vertices are kept where all have one: in a PLY red, green, blue (also with
/// diffuse_ before it) as uchar or as shares of one, in a COFF, in an OBJ behind x y z; those that
/// make no sense are left out, and no file is refused for them. Files of one program at a time go
/// through OpenMesh, whose readers have state: safe from any thread. Throws ModelError: missing,
/// empty, truncated (counts in the header are checked against the bytes before anything is
/// allocated) or non-mesh file, no faces, a coordinate that is not finite (or beyond float32), a
/// face index out of range, a face of more than 2048 corners. Cost: linear; memory a small multiple
/// of the file.
TriangleMesh read_model(const std::filesystem::path& path);

/// The same for the bytes of a file, `extension` as in ".ply". ModelError gives only the reason.
TriangleMesh parse_model(std::string bytes, const std::string& extension);

/// A named per-vertex column of a written PLY.
struct PlyVertexProperty {
    std::string name;
    std::vector<float> values;  // one per vertex
};

/// The same as uchar.
struct PlyByteProperty {
    std::string name;
    std::vector<std::uint8_t> values;  // one per vertex
};

struct PlyOptions {
    bool double_positions = false;  // else float32
    std::string comment;            // one line; "" for none
    std::vector<PlyVertexProperty> properties{};
    std::vector<PlyByteProperty> byte_properties{};
};

/// Writes a binary little-endian PLY, with uchar red, green, blue where the mesh has colours,
/// through a temporary beside it and a rename, so that a reader never sees half a file. Same input,
/// same bytes. Throws ModelError (path and reason); a position that is not finite in the written
/// type is a reason. Requires one value per vertex in each property and one colour, or none
/// (asserted).
void write_ply(const std::filesystem::path& path, const TriangleMesh& mesh,
               const PlyOptions& options = {});

/// Writes by extension (any case): .ply as above; .obj, .off (both with the digits that bring
/// float32 back) and binary .stl through OpenMesh, float32, as atomically. Throws ModelError.
void write_model(const std::filesystem::path& path, const TriangleMesh& mesh);

}  // namespace ellicast::common
