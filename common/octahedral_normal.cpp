// common/octahedral_normal.cpp
#include "common/octahedral_normal.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace ellicast::common {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

[[maybe_unused]] bool is_size(int bits) {
    return bits == 8 || bits == 12 || bits == 16;
}

double sign(double x) {
    return x < 0.0 ? -1.0 : 1.0;
}

/// Folds between the lower half of the octahedron and the corners of the square; its own inverse.
Vector2d fold(const Vector2d& p) {
    return {(1.0 - std::abs(p.y())) * sign(p.x()), (1.0 - std::abs(p.x())) * sign(p.y())};
}

/// Requires a direction.
Vector2d square_of(const Vector3d& n) {
    const Vector2d p = n.head<2>() / n.lpNorm<1>();
    return n.z() < 0.0 ? fold(p) : p;
}

struct Cell {
    int column = 0;
    int row = 0;
};

/// The place of a cell beyond an edge of the square: each edge is glued to itself, turned about its
/// middle.
Cell wrapped(Cell cell, int cells) {
    if (cell.column < 0 || cell.column >= cells) {
        cell = {std::clamp(cell.column, 0, cells - 1), cells - 1 - cell.row};
    }
    if (cell.row < 0 || cell.row >= cells) {
        cell = {cells - 1 - cell.column, std::clamp(cell.row, 0, cells - 1)};
    }
    return cell;
}

}  // namespace

std::uint16_t encode_normal(const Vector3d& n, int bits) {
    assert(is_size(bits));
    const double largest = n.cwiseAbs().maxCoeff();
    if (!(largest > 0.0) || !n.allFinite()) return 0;
    const Vector3d direction = (n / largest).normalized();
    const int cells = 1 << (bits / 2);
    const Vector2d at = 0.5 * cells * (square_of(direction) + Vector2d::Ones());
    const Cell home{std::clamp(static_cast<int>(at.x()), 0, cells - 1),
                    std::clamp(static_cast<int>(at.y()), 0, cells - 1)};
    // The projection distorts: the nearest centre may be that of a neighbour.
    std::uint16_t best = 0;
    double best_cosine = -2.0;
    for (int row = home.row - 1; row <= home.row + 1; ++row) {
        for (int column = home.column - 1; column <= home.column + 1; ++column) {
            const Cell cell = wrapped({column, row}, cells);
            const auto code = static_cast<std::uint16_t>(cell.row * cells + cell.column);
            const double cosine = direction.dot(decode_normal(code, bits));
            if (cosine > best_cosine || (cosine == best_cosine && code < best)) {
                best = code;
                best_cosine = cosine;
            }
        }
    }
    return best;
}

Vector3d decode_normal(std::uint16_t code, int bits) {
    assert(is_size(bits));
    const int cells = 1 << (bits / 2);
    const int column = code % cells;
    const int row = code / cells % cells;
    Vector2d p = Vector2d(2 * column + 1, 2 * row + 1) / cells - Vector2d::Ones();
    const double z = 1.0 - p.lpNorm<1>();
    if (z < 0.0) p = fold(p);
    return Vector3d(p.x(), p.y(), z).normalized();
}

double normal_cell_angle(int bits) {
    assert(is_size(bits));
    // Found by climbing from the worst of two million random directions: 0.17400, 0.04412 and
    // 0.01103, all on a fold. The means over the sphere are 0.0872, 0.0218 and 0.00545.
    return bits == 8 ? 0.1745 : bits == 12 ? 0.0445 : 0.0111;
}

}  // namespace ellicast::common
