// protocol/acceptance.hpp
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "protocol/box_check.hpp"
#include "protocol/datagram.hpp"

namespace ellicast::protocol {

/// What a hint allows its records to be (WIRE_FORMAT.md section 6), worked out once per datagram.
/// Requires acceptable(hint).
class RecordBounds {
  public:
    explicit RecordBounds(const Hint& hint);

    [[nodiscard]] bool admits(const EllipsoidRecord& record) const;
    [[nodiscard]] bool admits(const VertexRecord& record) const;

    /// The same for `count` raw records, in one pass; of vertices the positions decide, for any
    /// tags will do.
    [[nodiscard]] bool admits_ellipsoids(const std::uint8_t* records, std::size_t count) const;
    [[nodiscard]] bool admits_positions(const std::uint8_t* positions, std::size_t count) const;

  private:
    BoxBlock vertex_min_;  // x y z, repeated
    BoxBlock vertex_max_;
    std::array<double, 3> center_min_;
    std::array<double, 3> center_max_;
    double per_diagonal_ = 1.0;  // 1 / diagonal of the box
};

/// Decode one raw record, of a vertex what all formats have. Requires kEllipsoidBytes or
/// kVertexBytes readable bytes.
EllipsoidRecord load_ellipsoid(const std::uint8_t* p);
VertexRecord load_position(const std::uint8_t* p);

}  // namespace ellicast::protocol
