// common/octahedral_normal.cpp
#include "common/octahedral_normal.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <optional>

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

/// decode_normal() of every code of 8 bits: the encoder asks for nine a normal, and there are
/// millions of those.
const std::array<Vector3d, 256>& small_codes() {
    static const std::array<Vector3d, 256> kNormals = [] {
        std::array<Vector3d, 256> normals;
        for (std::uint16_t code = 0; code < 256; ++code) normals[code] = decode_normal(code, 8);
        return normals;
    }();
    return kNormals;
}

/// Of the codes that `fits` takes, one at least of any 2 x 2, the one nearest to `n`; none for a
/// vector without a direction.
template <class Fits>
std::optional<std::uint16_t> nearest_code(const Vector3d& n, int bits, const Fits& fits) {
    assert(is_size(bits));
    const double largest = n.cwiseAbs().maxCoeff();
    if (!(largest > 0.0) || !n.allFinite()) return std::nullopt;
    const Vector3d direction = (n / largest).normalized();
    const int cells = 1 << (bits / 2);
    const Vector2d at = 0.5 * cells * (square_of(direction) + Vector2d::Ones());
    const auto home = [&](double x) { return std::clamp(static_cast<int>(x), 0, cells - 1); };
    // The projection distorts: the nearest centre may be that of a neighbour. None beyond the
    // square's edge, though, for those are mirror images of cells on this side.
    std::optional<std::uint16_t> best;
    double best_cosine = -2.0;
    const auto first = [](int cell) { return std::max(cell - 1, 0); };
    const auto last = [&](int cell) { return std::min(cell + 1, cells - 1); };
    const int home_row = home(at.y());
    const int home_column = home(at.x());
    for (int row = first(home_row); row <= last(home_row); ++row) {
        for (int column = first(home_column); column <= last(home_column); ++column) {
            const auto code = static_cast<std::uint16_t>(row * cells + column);
            if (!fits(code)) continue;
            const double cosine =
                direction.dot(bits == 8 ? small_codes()[code] : decode_normal(code, bits));
            if (cosine > best_cosine) {
                best = code;
                best_cosine = cosine;
            }
        }
    }
    return best;
}

}  // namespace

bool is_marked(std::uint16_t code, int bits) {
    assert(is_size(bits));
    return (code & code >> (bits / 2) & 1) != 0;
}

std::uint16_t encode_normal(const Vector3d& n, int bits) {
    return nearest_code(n, bits, [](std::uint16_t) { return true; }).value_or(0);
}

std::uint16_t encode_marked_normal(const Vector3d& n, int bits, bool marked) {
    const auto first = static_cast<std::uint16_t>(marked ? (1 << (bits / 2)) + 1 : 0);
    return nearest_code(n, bits,
                        [&](std::uint16_t code) { return is_marked(code, bits) == marked; })
        .value_or(first);
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
