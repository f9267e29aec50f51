// receiver/closest_triangles.cpp
#include "receiver/closest_triangles.hpp"

#include <cassert>

#include "common/morton_order.hpp"
#include "common/parallel.hpp"
#include "common/triangle_point.hpp"

namespace ellicast::receiver {
namespace {

using common::TriangleTree;
using Eigen::Vector3d;

// More than what a squared distance loses by rounding.
constexpr double kRounding = 1.0 + 1e-12;

double squared_distance_to(const common::TriangleMesh& mesh, std::uint32_t triangle,
                           const Vector3d& x) {
    const auto& [a, b, c] = mesh.triangles[triangle];
    const common::TrianglePoint hit = common::closest_point_on_triangle(
        x, mesh.positions[a], mesh.positions[b], mesh.positions[c]);
    return (x - hit.point).squaredNorm();
}

}  // namespace

void visit_closest_triangles(
    const common::TriangleMesh& mesh, const std::vector<Vector3d>& points, unsigned threads,
    const std::function<void(std::size_t i, const TriangleTree::Hit& hit)>& visit) {
    assert(!mesh.triangles.empty());
    const TriangleTree tree(mesh);
    const std::vector<std::uint32_t> order = common::morton_order(points);
    common::parallel_for(order.size(), threads, [&](std::size_t begin, std::size_t end) {
        std::uint32_t last = 0;
        for (std::size_t k = begin; k < end; ++k) {
            const Vector3d& x = points[order[k]];
            const double bound = kRounding * squared_distance_to(mesh, last, x);
            const TriangleTree::Hit hit = tree.closest(x, bound);
            last = hit.triangle;
            visit(order[k], hit);
        }
    });
}

}  // namespace ellicast::receiver
