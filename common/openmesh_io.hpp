// common/openmesh_io.hpp: the only door to OpenMesh's readers and writers; private to
// common/model_io.
#pragma once

#include <string>

#include "common/model_file_check.hpp"
#include "common/polygon_soup.hpp"
#include "common/triangle_mesh.hpp"

namespace ellicast::common {

/// Reads a checked file through OpenMesh's IOManager. Positions are PlainModelFile::exact where
/// there are any. Throws BadModelFile when OpenMesh refuses it or reads other than the check did.
PolygonSoup read_through_openmesh(PlainModelFile file, ModelFormat format);

/// The bytes of an OBJ, OFF or binary STL file as OpenMesh writes it, float32. Throws BadModelFile.
std::string write_through_openmesh(const TriangleMesh& mesh, ModelFormat format);

}  // namespace ellicast::common
