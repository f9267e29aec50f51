// sender/model_preparation.cpp
#include "sender/model_preparation.hpp"

#include <stdexcept>
#include <string>
#include <utility>

#include "common/mesh_topology.hpp"
#include "sender/shell_nesting.hpp"
#include "sender/surface_repair.hpp"
#include "sender/triangle_cleaning.hpp"

namespace ellicast::sender {
namespace {

// The least share of the cubed diagonal that a model encloses; less is a sheet.
constexpr double kLeastVolume = 1e-9;

class Warnings {
  public:
    /// `text` with its '#' replaced by the count, unless that is zero; `one` when it is one.
    void add(std::size_t count, const std::string& one, const std::string& text) {
        if (count == 0) return;
        std::string line = count == 1 ? one : text;
        const std::size_t at = line.find('#');
        if (at != line.npos) line.replace(at, 1, std::to_string(count));
        lines_.push_back(std::move(line));
    }
    std::vector<std::string> take() { return std::move(lines_); }

  private:
    std::vector<std::string> lines_;
};

void warn_of_cleaning(const CleanTriangles& clean, Warnings& warnings) {
    warnings.add(clean.unreferenced, "ignored 1 vertex that no face uses",
                 "ignored # vertices that no face uses");
    warnings.add(clean.merged, "merged 1 vertex with another at the same position",
                 "merged # vertices with others at the same positions");
    warnings.add(clean.degenerate, "dropped 1 degenerate face", "dropped # degenerate faces");
    warnings.add(clean.duplicate, "dropped 1 duplicate face", "dropped # duplicate faces");
}

void warn_of_repair(const SurfaceRepair& repair, Warnings& warnings) {
    warnings.add(repair.turned_triangles, "turned 1 face to agree with its neighbours",
                 "turned # faces to agree with their neighbours");
    warnings.add(repair.cut_edges, "cut a one-sided surface open at 1 edge",
                 "cut a one-sided surface open at # edges");
    warnings.add(repair.non_manifold_edges, "split 1 edge shared by more than two faces",
                 "split # edges shared by more than two faces");
    warnings.add(repair.split_vertices, "split 1 vertex where surfaces met",
                 "split # vertices where surfaces met");
    warnings.add(repair.holes, "filled 1 hole", "filled # holes");
}

void warn_of_parts(const OrientedParts& parts, Warnings& warnings) {
    warnings.add(parts.turned, "turned 1 part inside out", "turned # parts inside out");
    if (parts.parts > 1) warnings.add(parts.parts, "", "the model has # separate parts");
    warnings.add(parts.flat, "1 part encloses no volume", "# parts enclose no volume");
}

Eigen::Vector3d area_vector(const std::vector<Eigen::Vector3d>& positions,
                            const common::Triangle& t) {
    return (positions[t[1]] - positions[t[0]]).cross(positions[t[2]] - positions[t[0]]);
}

/// Repair keeps a triangle's place, or puts a part of it there, but may turn it and give it copies
/// of its corners.
void turn_like(const common::TriangleMesh& solid, const std::vector<Eigen::Vector3d>& vertices,
               std::vector<common::Triangle>& faces) {
    for (std::size_t t = 0; t < faces.size(); ++t) {
        const Eigen::Vector3d turned = area_vector(solid.positions, solid.triangles[t]);
        if (turned.dot(area_vector(vertices, faces[t])) < 0.0) std::swap(faces[t][1], faces[t][2]);
    }
}

}  // namespace

PreparedModel prepare_model(common::TriangleMesh input) {
    if (input.triangles.empty()) throw std::invalid_argument("the model has no faces");
    CleanTriangles clean = clean_triangles(std::move(input));
    if (clean.mesh.triangles.empty()) {
        throw std::invalid_argument("the model has no faces (all are degenerate)");
    }
    Warnings warnings;
    warn_of_cleaning(clean, warnings);

    PreparedModel model;
    model.vertices = clean.mesh.positions;
    model.faces = clean.mesh.triangles;
    model.colours = std::exchange(clean.mesh.colours, {});
    model.solid = std::move(clean.mesh);
    warn_of_repair(make_closed_manifold(model.solid), warnings);
    const OrientedParts parts = orient_parts(model.solid, common::triangle_components(model.solid));
    warn_of_parts(parts, warnings);
    turn_like(model.solid, model.vertices, model.faces);

    const double diagonal = common::bounding_box(model.vertices).diagonal().norm();
    if (!(parts.volume > kLeastVolume * diagonal * diagonal * diagonal)) {
        throw std::invalid_argument("the model encloses no volume");
    }
    model.warnings = warnings.take();
    return model;
}

}  // namespace ellicast::sender
