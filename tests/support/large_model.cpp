// tests/support/large_model.cpp
#include "tests/support/large_model.hpp"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <utility>
#include <vector>

#include "common/random.hpp"
#include "common/vertex_normals.hpp"

namespace ellicast::tests {
namespace {

using common::Triangle;
using common::TriangleMesh;
using Eigen::Vector3d;

// Slope of an octave, about.
constexpr double kAmplitude = 0.03;  // shares of the wavelength

// An edge, and what lies across from it in its two triangles.
struct Edge {
    std::uint32_t low, high;
    std::array<std::uint32_t, 2> across;
};

struct EdgeList {
    std::vector<Edge> edges;               // by lower end
    std::vector<std::uint32_t> of_corner;  // 3 t + c: the edge from corner c of triangle t on
};

std::pair<std::uint32_t, std::uint32_t> ends(const Triangle& t, std::size_t c) {
    return std::minmax(t[c], t[(c + 1) % 3]);
}

// Corners sorted by the lower end of their edges, stable and linear.
std::vector<std::uint32_t> corners_by_lower_end(const TriangleMesh& mesh) {
    std::vector<std::uint32_t> next(mesh.positions.size() + 1, 0);
    for (const Triangle& t : mesh.triangles) {
        for (std::size_t c = 0; c < 3; ++c) ++next[ends(t, c).first + 1];
    }
    std::partial_sum(next.begin(), next.end(), next.begin());
    std::vector<std::uint32_t> corners(3 * mesh.triangles.size());
    for (std::uint32_t h = 0; h < corners.size(); ++h) {
        corners[next[ends(mesh.triangles[h / 3], h % 3).first]++] = h;
    }
    return corners;
}

[[noreturn]] void refuse() {
    throw std::invalid_argument("only a closed, manifold and oriented mesh can be enlarged");
}

EdgeList edges_of(const TriangleMesh& mesh) {
    constexpr std::uint32_t kOpen = 0xffffffffu;
    EdgeList list;
    list.edges.reserve(3 * mesh.triangles.size() / 2);
    list.of_corner.resize(3 * mesh.triangles.size());
    std::size_t first = 0;  // of the edges with the same lower end
    for (const std::uint32_t h : corners_by_lower_end(mesh)) {
        const Triangle& t = mesh.triangles[h / 3];
        const auto [low, high] = ends(t, h % 3);
        if (low == high) refuse();
        if (first < list.edges.size() && list.edges[first].low != low) first = list.edges.size();
        std::size_t e = first;
        while (e < list.edges.size() && list.edges[e].high != high) ++e;
        if (e == list.edges.size()) list.edges.push_back({low, high, {kOpen, kOpen}});
        std::uint32_t& across = list.edges[e].across[t[h % 3] == low ? 0 : 1];
        if (across != kOpen) refuse();
        across = t[(h % 3 + 2) % 3];
        list.of_corner[h] = static_cast<std::uint32_t>(e);
    }
    for (const Edge& e : list.edges) {
        if (e.across[0] == kOpen || e.across[1] == kOpen) refuse();
    }
    return list;
}

// The vertex that splits each edge, `first` and up in the order of the edges; 0 for those that
// stay. The `count` longest edges are split, the first of equals.
std::vector<std::uint32_t> split_longest(const TriangleMesh& mesh, const EdgeList& list,
                                         std::size_t count) {
    std::vector<double> lengths;
    lengths.reserve(list.edges.size());
    for (const Edge& e : list.edges) {
        lengths.push_back((mesh.positions[e.high] - mesh.positions[e.low]).squaredNorm());
    }
    std::vector<std::uint32_t> order(list.edges.size());
    std::iota(order.begin(), order.end(), 0u);
    if (count < order.size()) {
        std::nth_element(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(count),
                         order.end(), [&](std::uint32_t a, std::uint32_t b) {
                             return lengths[a] != lengths[b] ? lengths[a] > lengths[b] : a < b;
                         });
        order.resize(count);
    }
    std::vector<std::uint32_t> vertex(list.edges.size(), 0);
    for (const std::uint32_t e : order) vertex[e] = 1;
    auto next = static_cast<std::uint32_t>(mesh.positions.size());
    for (std::uint32_t& v : vertex) {
        if (v != 0) v = next++;
    }
    return vertex;
}

// Old vertices all of whose edges are split, and the new ones, where Loop's rules put them.
std::vector<Vector3d> loop_positions(const TriangleMesh& mesh, const EdgeList& list,
                                     const std::vector<std::uint32_t>& split) {
    const std::vector<Vector3d>& old = mesh.positions;
    std::vector<Vector3d> sum(old.size(), Vector3d::Zero());
    std::vector<std::uint32_t> valence(old.size(), 0);
    std::vector<bool> moves(old.size(), true);
    std::vector<Vector3d> positions = old;
    for (std::size_t e = 0; e < list.edges.size(); ++e) {
        const auto& [a, b, across] = list.edges[e];
        sum[a] += old[b];
        sum[b] += old[a];
        ++valence[a];
        ++valence[b];
        if (split[e] == 0) {
            moves[a] = moves[b] = false;
        } else {
            positions.emplace_back(0.375 * (old[a] + old[b]) +
                                   0.125 * (old[across[0]] + old[across[1]]));
        }
    }
    for (std::size_t v = 0; v < old.size(); ++v) {
        if (!moves[v] || valence[v] == 0) continue;
        const double share = valence[v] == 3 ? 9.0 / 16 : 3.0 / 8;  // of the neighbours' mean
        positions[v] = (1 - share) * old[v] + share / valence[v] * sum[v];
    }
    return positions;
}

// Appends what triangle `t` becomes when its edges are split by `m` (0: not), m[c] lying between
// corners c and c + 1.
void add_parts(std::vector<Triangle>& triangles, const Triangle& t, const Triangle& m) {
    const auto count = std::count_if(m.begin(), m.end(), [](std::uint32_t v) { return v != 0; });
    std::size_t k = 0;  // turns the triangle to one of the cases below
    if (count == 1) {
        while (m[k] == 0) ++k;
    } else if (count == 2) {
        while (m[(k + 2) % 3] != 0) ++k;
    }
    const auto [a, b, c] = Triangle{t[k], t[(k + 1) % 3], t[(k + 2) % 3]};
    const auto [ab, bc, ca] = Triangle{m[k], m[(k + 1) % 3], m[(k + 2) % 3]};
    if (count == 0) {
        triangles.push_back(t);
    } else if (count == 1) {
        triangles.insert(triangles.end(), {{a, ab, c}, {ab, b, c}});
    } else if (count == 2) {
        triangles.insert(triangles.end(), {{ab, b, bc}, {a, ab, bc}, {a, bc, c}});
    } else {
        triangles.insert(triangles.end(), {{a, ab, ca}, {ab, b, bc}, {bc, c, ca}, {ab, bc, ca}});
    }
}

TriangleMesh split_round(const TriangleMesh& mesh, std::size_t vertices) {
    const EdgeList list = edges_of(mesh);
    const std::vector<std::uint32_t> split =
        split_longest(mesh, list, vertices - mesh.positions.size());
    TriangleMesh finer;
    finer.positions = loop_positions(mesh, list, split);
    finer.triangles.reserve(mesh.triangles.size() +
                            2 * (finer.positions.size() - mesh.positions.size()));
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        Triangle middle{};
        for (std::size_t c = 0; c < 3; ++c) middle[c] = split[list.of_corner[3 * t + c]];
        add_parts(finer.triangles, mesh.triangles[t], middle);
    }
    return finer;
}

// Random values at the points of the integer lattice, between -1 and 1, joined twice smoothly.
double lattice_noise(const Vector3d& p, std::uint64_t seed) {
    const Vector3d cell = p.array().floor();
    const Vector3d f = p - cell;
    const Vector3d s =
        f.unaryExpr([](double t) { return t * t * t * (t * (6.0 * t - 15.0) + 10.0); });
    double sum = 0.0;
    for (int corner = 0; corner < 8; ++corner) {
        std::uint64_t hash = seed;
        double weight = 1.0;
        for (int i = 0; i < 3; ++i) {
            const int up = corner >> i & 1;
            weight *= up != 0 ? s[i] : 1.0 - s[i];
            const auto at = static_cast<std::int64_t>(cell[i]) + up;
            hash = common::Random::finalised(hash + static_cast<std::uint64_t>(at));
        }
        sum += weight * (static_cast<double>(hash >> 11) * 0x1.0p-52 - 1.0);
    }
    return sum;
}

void displace(TriangleMesh& mesh, std::uint64_t seed) {
    const Eigen::AlignedBox3d box = common::bounding_box(mesh.positions);
    const double shortest = 4 * common::mean_edge_length(mesh);
    const std::vector<Vector3d> normals = common::vertex_normals(mesh);
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
        const Vector3d p = mesh.positions[v] - box.min();
        double height = 0.0;
        std::uint64_t octave = seed;
        for (double length = box.diagonal().norm() / 32; length >= shortest; length /= 2) {
            octave = common::Random::finalised(octave + 1);
            height += kAmplitude * length * lattice_noise(p / length, octave);
        }
        mesh.positions[v] += height * normals[v];
    }
}

}  // namespace

TriangleMesh large_model(TriangleMesh model, std::size_t vertices, std::uint64_t seed) {
    if (vertices < model.positions.size() || model.triangles.empty()) {
        throw std::invalid_argument("the model has more vertices already, or no triangles");
    }
    model.colours.clear();
    while (model.positions.size() < vertices) model = split_round(model, vertices);
    displace(model, seed);
    return model;
}

}  // namespace ellicast::tests
