// common/polygon_soup.cpp
#include "common/polygon_soup.hpp"

#include <algorithm>
#include <limits>
#include <utility>

namespace ellicast::common {
namespace {

using Eigen::Vector3d;

// Trying every corner of an n-gon costs n^2.
constexpr std::size_t kMaxTried = 64;

// Twice the vector area ([Newell]): along the mean normal, also of polygons that are not flat.
Vector3d vector_area(const PolygonSoup& soup, std::span<const std::uint32_t> face) {
    const Vector3d& origin = soup.positions[face[0]];
    Vector3d sum = Vector3d::Zero();
    for (std::size_t i = 1; i + 1 < face.size(); ++i) {
        sum += (soup.positions[face[i]] - origin).cross(soup.positions[face[i + 1]] - origin);
    }
    return sum;
}

double shape(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& normal) {
    const double edges = (b - a).squaredNorm() + (c - b).squaredNorm() + (a - c).squaredNorm();
    return edges > 0.0 ? (b - a).cross(c - a).dot(normal) / edges : 0.0;
}

double worst_of_fan(const PolygonSoup& soup, std::span<const std::uint32_t> face, std::size_t root,
                    const Vector3d& normal) {
    const std::size_t n = face.size();
    double worst = std::numeric_limits<double>::infinity();
    for (std::size_t i = 1; i + 1 < n; ++i) {
        worst =
            std::min(worst, shape(soup.positions[face[root]], soup.positions[face[(root + i) % n]],
                                  soup.positions[face[(root + i + 1) % n]], normal));
    }
    return worst;
}

std::size_t best_root(const PolygonSoup& soup, std::span<const std::uint32_t> face) {
    const std::size_t n = face.size();
    if (n == 3) return 0;
    const Vector3d normal = vector_area(soup, face).normalized();
    const std::size_t tried = std::min(n, kMaxTried);
    std::size_t best = 0;
    double best_worst = -std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < tried; ++k) {
        const std::size_t root = k * n / tried;
        const double worst = worst_of_fan(soup, face, root, normal);
        if (worst > best_worst) {
            best = root;
            best_worst = worst;
        }
    }
    return best;
}

}  // namespace

TriangleMesh triangulate(PolygonSoup soup) {
    TriangleMesh mesh;
    mesh.triangles.reserve(soup.corners.size() - std::min(soup.corners.size(), 2 * soup.faces()));
    for (std::size_t f = 0; f < soup.faces(); ++f) {
        const std::span<const std::uint32_t> face = soup.face(f);
        const std::size_t n = face.size();
        if (n < 3) continue;
        const std::size_t root = best_root(soup, face);
        for (std::size_t i = 1; i + 1 < n; ++i) {
            const Triangle triangle{face[root], face[(root + i) % n], face[(root + i + 1) % n]};
            if (triangle[0] == triangle[1] || triangle[1] == triangle[2] ||
                triangle[2] == triangle[0]) {
                continue;
            }
            mesh.triangles.push_back(triangle);
        }
    }
    mesh.positions = std::move(soup.positions);
    return mesh;
}

}  // namespace ellicast::common
