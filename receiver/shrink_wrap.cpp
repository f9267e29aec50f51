// receiver/shrink_wrap.cpp
#include "receiver/shrink_wrap.hpp"

#include <algorithm>
#include <cassert>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "common/parallel.hpp"
#include "receiver/closest_triangles.hpp"
#include "receiver/surface_walk.hpp"

namespace ellicast::receiver {
namespace {

using Eigen::Vector3d;

// Jacobi sweeps by which pulled vertices carry along those that no point pulls.
constexpr int kDiffusionSweeps = 12;
// So many points a vertex tell it where to go; more would tell the same.
constexpr std::size_t kPointsPerVertex = 8;
// Share of the tangential way to the neighbours' centroid in a round.
constexpr double kTangentialStep = 0.5;

// Neighbours of each vertex in compressed rows; a closed mesh names each pair once per direction.
struct Neighbours {
    std::vector<std::uint32_t> first;  // vertices + 1
    std::vector<std::uint32_t> ids;
};

Neighbours neighbours_of(const common::TriangleMesh& mesh) {
    Neighbours result;
    result.first.assign(mesh.positions.size() + 1, 0);
    for (const auto& t : mesh.triangles) {
        for (const std::uint32_t v : t) ++result.first[v + 1];
    }
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) result.first[v + 1] += result.first[v];
    result.ids.resize(result.first.back());
    std::vector<std::uint32_t> fill(result.first.begin(), result.first.end() - 1);
    for (const auto& t : mesh.triangles) {
        for (std::size_t i = 0; i < 3; ++i) result.ids[fill[t[i]]++] = t[(i + 1) % 3];
    }
    return result;
}

struct Pull {
    std::uint32_t triangle = 0;
    Vector3d weights = Vector3d::Zero();
    Vector3d offset = Vector3d::Zero();
};

// The place of every point on the surface: by a search first, later by a walk from where it was,
// for a round moves neither far.
void find_places(const SurfaceMesh& surface, const common::TriangleMesh& mesh,
                 const std::vector<Vector3d>& points, bool first, unsigned threads,
                 std::vector<Pull>& pulls) {
    if (first) {
        visit_closest_triangles(
            mesh, points, threads,
            [&](std::uint32_t face, const Vector3d& x) {
                return walk_to_closest(surface, face, x).squared_distance;
            },
            [&](std::size_t, std::size_t i, const common::TriangleTree::Hit& hit) {
                pulls[i] = {hit.triangle, hit.barycentric, points[i] - hit.point};
            });
        return;
    }
    common::parallel_for(points.size(), threads, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const SurfacePlace place = walk_to_closest(surface, pulls[i].triangle, points[i]);
            pulls[i] = {place.face, place.barycentric, points[i] - place.point};
        }
    });
}

// Weighted mean offset per vertex, and how much weight stands behind it.
void gather_pulls(const common::TriangleMesh& mesh, const std::vector<Pull>& pulls,
                  std::vector<Vector3d>& offset, std::vector<double>& weight) {
    offset.assign(mesh.positions.size(), Vector3d::Zero());
    weight.assign(mesh.positions.size(), 0.0);
    for (const Pull& pull : pulls) {
        for (int corner = 0; corner < 3; ++corner) {
            const std::uint32_t v = mesh.triangles[pull.triangle][static_cast<std::size_t>(corner)];
            offset[v] += pull.weights[corner] * pull.offset;
            weight[v] += pull.weights[corner];
        }
    }
    for (std::size_t v = 0; v < offset.size(); ++v) {
        if (weight[v] > 0.0) offset[v] /= weight[v];
    }
}

// Lets offsets flow from pulled vertices to the others.
void diffuse(const Neighbours& neighbours, const std::vector<double>& weight,
             std::vector<Vector3d>& offset) {
    std::vector<Vector3d> next = offset;
    for (int sweep = 0; sweep < kDiffusionSweeps; ++sweep) {
        for (std::size_t v = 0; v < offset.size(); ++v) {
            if (weight[v] > 0.0) continue;
            Vector3d sum = Vector3d::Zero();
            const std::uint32_t begin = neighbours.first[v];
            const std::uint32_t end = neighbours.first[v + 1];
            for (std::uint32_t i = begin; i < end; ++i) sum += offset[neighbours.ids[i]];
            next[v] = sum / static_cast<double>(end - begin);
        }
        std::swap(offset, next);
        for (std::size_t v = 0; v < offset.size(); ++v) {
            if (weight[v] > 0.0) next[v] = offset[v];
        }
    }
}

std::vector<Vector3d> vertex_normals(const common::TriangleMesh& mesh) {
    std::vector<Vector3d> normals(mesh.positions.size(), Vector3d::Zero());
    for (const auto& [a, b, c] : mesh.triangles) {
        const Vector3d n =
            (mesh.positions[b] - mesh.positions[a]).cross(mesh.positions[c] - mesh.positions[a]);
        normals[a] += n;
        normals[b] += n;
        normals[c] += n;
    }
    for (Vector3d& n : normals) n.normalize();
    return normals;
}

void smooth_tangentially(const Neighbours& neighbours, common::TriangleMesh& mesh) {
    const std::vector<Vector3d> normals = vertex_normals(mesh);
    std::vector<Vector3d> moved = mesh.positions;
    for (std::size_t v = 0; v < moved.size(); ++v) {
        Vector3d sum = Vector3d::Zero();
        const std::uint32_t begin = neighbours.first[v];
        const std::uint32_t end = neighbours.first[v + 1];
        for (std::uint32_t i = begin; i < end; ++i) sum += mesh.positions[neighbours.ids[i]];
        const Vector3d step = sum / static_cast<double>(end - begin) - mesh.positions[v];
        moved[v] += kTangentialStep * (step - normals[v] * normals[v].dot(step));
    }
    mesh.positions = std::move(moved);
}

}  // namespace

void shrink_wrap(common::TriangleMesh& mesh, std::span<const Vector3d> all_points, int rounds,
                 unsigned threads) {
    const std::size_t asked = std::min(all_points.size(), kPointsPerVertex * mesh.positions.size());
    const std::vector<Vector3d> points(all_points.begin(),
                                       all_points.begin() + static_cast<std::ptrdiff_t>(asked));
    if (points.empty() || mesh.triangles.empty()) return;
    std::optional<SurfaceMesh> surface = SurfaceMesh::from(mesh);
    assert(surface);
    const Neighbours neighbours = neighbours_of(mesh);
    std::vector<Pull> pulls(points.size());
    std::vector<Vector3d> offset;
    std::vector<double> weight;
    for (int round = 0; round < rounds; ++round) {
        find_places(*surface, mesh, points, round == 0, threads, pulls);
        gather_pulls(mesh, pulls, offset, weight);
        diffuse(neighbours, weight, offset);
        for (std::size_t v = 0; v < offset.size(); ++v) mesh.positions[v] += offset[v];
        smooth_tangentially(neighbours, mesh);
        for (VertexId v = 0; v < mesh.positions.size(); ++v) {
            surface->set_position(v, mesh.positions[v]);
        }
    }
}

}  // namespace ellicast::receiver
