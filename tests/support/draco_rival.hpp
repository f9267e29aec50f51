// tests/support/draco_rival.hpp: a compressed mesh behind an ideal erasure code. Needs Draco.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/triangle_mesh.hpp"

namespace ellicast::tests {

/// The mesh with its connectivity as Draco packs it best: edgebreaker, 14 bits a coordinate,
/// compression level 10. Throws std::runtime_error when the library refuses.
std::vector<char> draco_encode(const common::TriangleMesh& mesh);

/// What a receiver of all these bytes has. Throws std::runtime_error for what is no such mesh.
common::TriangleMesh draco_decode(const std::vector<char>& bytes);

/// Whether a message of `message` bytes, spread by an ideal (MDS) code over packets of which
/// `received` bytes arrived, can be had: any packets will do, and not one byte is wasted.
constexpr bool ideal_code_delivers(std::uint64_t received, std::uint64_t message) {
    return received >= message;
}

}  // namespace ellicast::tests
