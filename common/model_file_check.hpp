// common/model_file_check.hpp: private to common/model_io.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/triangle_mesh.hpp"

namespace ellicast::common {

enum class ModelFormat { ply, obj, off, stl };

/// Why a file is refused; one line, without the path.
class BadModelFile : public std::runtime_error {
  public:
    using std::runtime_error::runtime_error;
};

/// A file that OpenMesh's reader of the same format may be trusted with. OpenMesh 9 believes what
/// it reads: a header without an end or a count of four billion keep it busy for ever, a list
/// column or an integer coordinate in a binary PLY shifts all that follows, `mtllib` opens any file
/// of the machine, a comment breaks an OFF, the word "outer" in a name breaks an STL. So it sees
/// only files in the plainest dialect of their format: coordinates and faces.
struct PlainModelFile {
    std::string bytes;         // the file itself where it is plain already
    bool binary = false;       // STL only: which of its two encodings
    std::size_t vertices = 0;  // as listed; for STL three a facet
    std::size_t faces = 0;
    /// OpenMesh's readers hand out float32. Where the file holds more than that (OBJ, OFF, PLY
    /// columns that are not float32), these are the positions as doubles, one per vertex. Empty
    /// otherwise.
    std::vector<Eigen::Vector3d> exact;
    /// One per vertex where the file has such (not in STL), in `bytes` there are none. Else empty.
    std::vector<Colour> colours;
};

/// A face of more corners is refused: OpenMesh's OBJ reader takes the square of it in time.
inline constexpr std::size_t kMaxFaceCorners = 2048;

/// Parses the whole file, holds every count against the bytes that are there, every index against
/// the number of vertices and every coordinate against the finite range of float32 (that is what a
/// vertex becomes on the wire). Throws BadModelFile. Linear; allocates no more than a small
/// multiple of the bytes.
PlainModelFile check_model_file(std::string bytes, ModelFormat format);

// One per format, called by the above.
PlainModelFile check_ply_file(std::string bytes);
PlainModelFile check_obj_file(const std::string& bytes);
PlainModelFile check_off_file(const std::string& bytes);
PlainModelFile check_stl_file(std::string bytes);

}  // namespace ellicast::common
