// common/mesh_distance.cpp
#include "common/mesh_distance.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "common/mesh_topology.hpp"
#include "common/parallel.hpp"
#include "common/random.hpp"
#include "common/triangle_tree.hpp"

namespace ellicast::common {
namespace {

using Eigen::Vector3d;

// Normal with the length of twice the area.
Vector3d scaled_normal(const TriangleMesh& mesh, const Triangle& t) {
    const Vector3d& a = mesh.positions[t[0]];
    const Vector3d ab = mesh.positions[t[1]] - a;
    const Vector3d ac = mesh.positions[t[2]] - a;
    return ab.cross(ac);
}

// Area of triangles 0..i at entry i. Throws std::invalid_argument when the whole is not positive.
std::vector<double> accumulated_areas(const TriangleMesh& mesh) {
    std::vector<double> areas;
    areas.reserve(mesh.triangles.size());
    double sum = 0.0;
    for (const Triangle& t : mesh.triangles) {
        sum += 0.5 * scaled_normal(mesh, t).norm();
        areas.push_back(sum);
    }
    if (!(sum > 0.0) || !std::isfinite(sum)) {
        throw std::invalid_argument("a surface to be sampled needs a finite, positive area");
    }
    return areas;
}

std::vector<Vector3d> referenced_vertices(const TriangleMesh& mesh) {
    std::vector<std::uint8_t> used(mesh.positions.size(), 0);
    for (const Triangle& t : mesh.triangles) {
        for (const std::uint32_t corner : t) used[corner] = 1;
    }
    std::vector<Vector3d> vertices;
    for (std::size_t v = 0; v < used.size(); ++v) {
        if (used[v] != 0) vertices.push_back(mesh.positions[v]);
    }
    return vertices;
}

struct Measured {
    double distance = 0;
    double angle = -1;  // radians; negative where a normal is missing
};

double angle_between(const Vector3d& m, const Vector3d& n) {
    const double cross = m.cross(n).norm();
    const double dot = m.dot(n);
    if (cross == 0.0 && dot == 0.0) return -1.0;
    return std::atan2(cross, dot);
}

struct OneWay {
    double mean_square = 0;
    double mean = 0;
    double max = 0;    // over samples and vertices
    double angle = 0;  // mean, radians
};

// From samples and vertices of `from` to the surface `to`. Threads fill arrays; sums are taken in
// index order afterwards.
OneWay measure_one_way(const TriangleMesh& from, const std::vector<SurfaceSample>& samples,
                       const TriangleMesh& to, unsigned threads) {
    const TriangleTree to_tree(to);
    std::vector<Measured> measured(samples.size());
    parallel_for(samples.size(), threads, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const TriangleTree::Hit hit = to_tree.closest(samples[i].point);
            const Vector3d m = scaled_normal(from, from.triangles[samples[i].triangle]);
            const Vector3d n = scaled_normal(to, to.triangles[hit.triangle]);
            measured[i] = {std::sqrt(hit.squared_distance), angle_between(m, n)};
        }
    });
    const std::vector<Vector3d> vertices = referenced_vertices(from);
    std::vector<double> of_vertex(vertices.size());
    parallel_for(vertices.size(), threads, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            of_vertex[i] = std::sqrt(to_tree.closest(vertices[i]).squared_distance);
        }
    });

    OneWay result;
    std::size_t angles = 0;
    for (const Measured& m : measured) {
        result.mean_square += m.distance * m.distance;
        result.mean += m.distance;
        result.max = std::max(result.max, m.distance);
        if (m.angle < 0.0) continue;
        result.angle += m.angle;
        ++angles;
    }
    const auto n = static_cast<double>(measured.size());
    result.mean_square /= n;
    result.mean /= n;
    if (angles > 0) result.angle /= static_cast<double>(angles);
    for (const double d : of_vertex) result.max = std::max(result.max, d);
    return result;
}

}  // namespace

std::vector<SurfaceSample> sample_surface(const TriangleMesh& mesh, std::size_t count,
                                          std::uint64_t seed) {
    const std::vector<double> areas = accumulated_areas(mesh);
    Random random(seed);
    std::vector<SurfaceSample> samples;
    samples.reserve(count);
    // The last triangle that adds area: rounding must not push a sample past it.
    const auto last = static_cast<std::size_t>(
        std::lower_bound(areas.begin(), areas.end(), areas.back()) - areas.begin());
    std::size_t triangle = 0;
    for (std::size_t k = 0; k < count; ++k) {
        const double share =
            (static_cast<double>(k) + random.uniform()) / static_cast<double>(count);
        const double area = share * areas.back();
        while (triangle < last && areas[triangle] <= area) ++triangle;
        // Uniform in the parallelogram; its far half is folded back.
        double u = random.uniform();
        double v = random.uniform();
        if (u + v > 1.0) {
            u = 1.0 - u;
            v = 1.0 - v;
        }
        const Triangle& t = mesh.triangles[triangle];
        const Vector3d& a = mesh.positions[t[0]];
        const Vector3d ab = mesh.positions[t[1]] - a;
        const Vector3d ac = mesh.positions[t[2]] - a;
        samples.push_back({a + u * ab + v * ac, static_cast<std::uint32_t>(triangle)});
    }
    return samples;
}

MeshDistance measure_distance(const TriangleMesh& mesh, const TriangleMesh& reference,
                              const MeshDistanceOptions& options) {
    if (options.samples == 0) throw std::invalid_argument("a distance needs at least one sample");
    // Both surfaces are checked, by sampling them, before either is searched.
    const auto of_mesh = sample_surface(mesh, options.samples, options.seed);
    const auto of_reference = sample_surface(reference, options.samples, options.seed);
    const OneWay to = measure_one_way(mesh, of_mesh, reference, options.threads);
    const OneWay from = measure_one_way(reference, of_reference, mesh, options.threads);
    const double diagonal = surface_box(reference).diagonal().norm();

    MeshDistance result;
    result.rms_to_reference = std::sqrt(to.mean_square) / diagonal;
    result.rms_from_reference = std::sqrt(from.mean_square) / diagonal;
    result.mean_to_reference = to.mean / diagonal;
    result.mean_from_reference = from.mean / diagonal;
    result.max = std::max(to.max, from.max) / diagonal;
    result.normal_deg = std::max(to.angle, from.angle) * 180.0 / std::numbers::pi;
    return result;
}

}  // namespace ellicast::common
