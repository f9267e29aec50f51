// protocol/acceptance.cpp
#include "protocol/acceptance.hpp"

#include <algorithm>
#include <cmath>

#include "protocol/byte_reader.hpp"

namespace ellicast::protocol {
namespace {

double diagonal_of(const Hint& hint) {
    double squares = 0.0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const double extent =
            static_cast<double>(hint.box_max[axis]) - static_cast<double>(hint.box_min[axis]);
        squares += extent * extent;
    }
    return std::sqrt(squares);
}

bool box_is_plausible(const Hint& hint) {
    bool ok = true;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        // Written so that a NaN fails.
        ok &= hint.box_min[axis] >= -kMaxCoordinate && hint.box_max[axis] <= kMaxCoordinate &&
              hint.box_min[axis] <= hint.box_max[axis];
    }
    return ok && diagonal_of(hint) >= kMinDiagonal;
}

/// Each component is a closed surface: Euler characteristic 2 - 2 genus, even and at most 2.
bool topology_is_possible(const Hint& hint) {
    if (hint.components < 1 || hint.components > kMaxComponents) return false;
    const std::int64_t all = hint.euler_all;
    const std::int64_t largest = hint.euler_largest;
    if (all % 2 != 0 || largest % 2 != 0 || largest > 2) return false;
    const std::int64_t others = hint.components - std::int64_t{1};
    return others == 0 ? all == largest : all - largest <= 2 * others;
}

/// A radius is a singular value of L, in units of the diagonal between kMinRadius and 1. Both ends
/// are checked through Frobenius norms, which lie between the largest singular value and sqrt(3)
/// times it:
///     |L|_F <= sqrt(3),   |L^-1|_F = |adj L|_F / det L <= sqrt(3) / kMinRadius.
/// So every allowed ellipsoid passes, and what passes has radii within [kMinRadius / sqrt 3, sqrt
/// 3].
bool radii_are_plausible(double l00, double l10, double l11, double l20, double l21, double l22) {
    const bool positive = l00 > 0.0 && l11 > 0.0 && l22 > 0.0;
    const double norm_L = l00 * l00 + l10 * l10 + l11 * l11 + l20 * l20 + l21 * l21 + l22 * l22;
    const double a00 = l11 * l22;
    const double a11 = l00 * l22;
    const double a22 = l00 * l11;
    const double a10 = l10 * l22;
    const double a21 = l00 * l21;
    const double a20 = l10 * l21 - l11 * l20;
    const double norm_adj = a00 * a00 + a10 * a10 + a11 * a11 + a20 * a20 + a21 * a21 + a22 * a22;
    const double det = a22 * l22;
    constexpr double kLimit = 3.0 * (1.0 + 1e-6) * (1.0 + 1e-6);
    constexpr double kInverseLimit = kLimit / (kMinRadius * kMinRadius);
    return positive && norm_L <= kLimit && norm_adj <= kInverseLimit * (det * det);
}

}  // namespace

bool acceptable(const Hint& hint) {
    if (!box_is_plausible(hint) || !topology_is_possible(hint)) return false;
    if (hint.vertices > kMaxVertices) return false;
    if (hint.ellipsoids == 0 && hint.vertices == 0) return false;
    return hint.format.is_known() && hint.diagonals < kDiagonalRules;
}

RecordBounds::RecordBounds(const Hint& hint) {
    const double diagonal = diagonal_of(hint);
    per_diagonal_ = 1.0 / diagonal;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        center_min_[axis] = static_cast<double>(hint.box_min[axis]) - kCenterSlack * diagonal;
        center_max_[axis] = static_cast<double>(hint.box_max[axis]) + kCenterSlack * diagonal;
    }
    for (std::size_t k = 0; k < kBoxBlock; k += 3) {
        std::copy(hint.box_min.begin(), hint.box_min.end(), vertex_min_.data() + k);
        std::copy(hint.box_max.begin(), hint.box_max.end(), vertex_max_.data() + k);
    }
}

bool RecordBounds::admits(const EllipsoidRecord& record) const {
    const auto& s = record.scalars;
    bool inside = true;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const double c = static_cast<double>(s[axis]);
        inside &= c >= center_min_[axis] && c <= center_max_[axis];
    }
    std::array<double, 6> l{};
    for (std::size_t k = 0; k < 6; ++k) l[k] = static_cast<double>(s[3 + k]) * per_diagonal_;
    return inside && radii_are_plausible(l[0], l[1], l[2], l[3], l[4], l[5]);
}

bool RecordBounds::admits(const VertexRecord& record) const {
    bool inside = true;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const float x = record.position[axis];
        inside &= x >= vertex_min_[axis] && x <= vertex_max_[axis];
    }
    return inside;
}

bool RecordBounds::admits_ellipsoids(const std::uint8_t* records, std::size_t count) const {
    bool ok = true;
    for (std::size_t k = 0; k < count; ++k) {
        ok &= admits(load_ellipsoid(records + k * kEllipsoidBytes));
    }
    return ok;
}

bool RecordBounds::admits_positions(const std::uint8_t* positions, std::size_t count) const {
    constexpr std::size_t kBlock = kBoxBlock / 3;
    const std::size_t blocks = count / kBlock;
    bool ok = all_inside(positions, blocks, vertex_min_, vertex_max_);
    for (std::size_t k = blocks * kBlock; k < count; ++k) {
        ok &= admits(load_position(positions + k * kVertexBytes));
    }
    return ok;
}

bool acceptable(const EllipsoidRecord& record, const Hint& hint) {
    return acceptable(hint) && RecordBounds(hint).admits(record);
}

bool acceptable(const VertexRecord& record, const Hint& hint) {
    return acceptable(hint) && RecordBounds(hint).admits(record);
}

EllipsoidRecord load_ellipsoid(const std::uint8_t* p) {
    EllipsoidRecord record;
    for (std::size_t k = 0; k < 9; ++k) record.scalars[k] = load_f32(p + 4 * k);
    return record;
}

VertexRecord load_position(const std::uint8_t* p) {
    return {.position = {load_f32(p), load_f32(p + 4), load_f32(p + 8)}};
}

}  // namespace ellicast::protocol
