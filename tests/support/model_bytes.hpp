// tests/support/model_bytes.hpp: model files written by hand, independent of the library's writers.
#pragma once

#include <string>

#include "common/triangle_mesh.hpp"

namespace ellicast::tests {

enum class PlyEncoding { ascii, little_endian, big_endian };

/// Coordinates as float32 (nearest) or double columns.
std::string ply_bytes(const common::TriangleMesh& mesh, PlyEncoding encoding,
                      bool double_columns = false);
/// Coordinates with all digits of the double.
std::string obj_text(const common::TriangleMesh& mesh);
std::string off_text(const common::TriangleMesh& mesh);
/// Coordinates as float32.
std::string stl_text(const common::TriangleMesh& mesh);
std::string stl_binary(const common::TriangleMesh& mesh);

}  // namespace ellicast::tests
