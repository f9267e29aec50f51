// tests/support/model_bytes.cpp
#include "tests/support/model_bytes.hpp"

#include <array>
#include <bit>
#include <charconv>
#include <cstdint>

namespace ellicast::tests {
namespace {

// The shortest digits that bring the number back.
template <class Float>
std::string digits(Float value) {
    std::array<char, 64> text{};
    const auto result = std::to_chars(text.data(), text.data() + text.size(), value);
    return {text.data(), result.ptr};
}

template <class Float>
std::string joined(const Eigen::Vector3d& p) {
    return digits(static_cast<Float>(p[0])) + " " + digits(static_cast<Float>(p[1])) + " " +
           digits(static_cast<Float>(p[2]));
}

std::string raw(std::uint64_t value, std::size_t size, bool big_endian) {
    std::string bytes;
    for (std::size_t i = 0; i < size; ++i) {
        const std::size_t shift = 8 * (big_endian ? size - 1 - i : i);
        bytes += static_cast<char>(value >> shift & 0xff);
    }
    return bytes;
}

std::string raw_float(double value, bool big_endian = false) {
    return raw(std::bit_cast<std::uint32_t>(static_cast<float>(value)), 4, big_endian);
}

std::string ply_body(const common::TriangleMesh& mesh, bool big_endian, bool double_columns) {
    std::string bytes;
    for (const Eigen::Vector3d& p : mesh.positions) {
        for (const double x : p) {
            bytes += double_columns ? raw(std::bit_cast<std::uint64_t>(x), 8, big_endian)
                                    : raw_float(x, big_endian);
        }
    }
    for (const common::Triangle& triangle : mesh.triangles) {
        bytes += '\3';
        for (const std::uint32_t corner : triangle) bytes += raw(corner, 4, big_endian);
    }
    return bytes;
}

}  // namespace

std::string ply_bytes(const common::TriangleMesh& mesh, PlyEncoding encoding, bool double_columns) {
    const std::string type = double_columns ? "double " : "float ";
    std::string bytes = "ply\nformat ";
    bytes += encoding == PlyEncoding::ascii           ? "ascii"
             : encoding == PlyEncoding::little_endian ? "binary_little_endian"
                                                      : "binary_big_endian";
    bytes += " 1.0\nelement vertex " + std::to_string(mesh.positions.size());
    for (const char* axis : {"x", "y", "z"}) bytes += "\nproperty " + type + axis;
    bytes += "\nelement face " + std::to_string(mesh.triangles.size()) +
             "\nproperty list uchar int vertex_indices\nend_header\n";
    if (encoding != PlyEncoding::ascii) {
        return bytes + ply_body(mesh, encoding == PlyEncoding::big_endian, double_columns);
    }
    for (const Eigen::Vector3d& p : mesh.positions) {
        bytes += (double_columns ? joined<double>(p) : joined<float>(p)) + "\n";
    }
    for (const auto& [a, b, c] : mesh.triangles) {
        bytes +=
            "3 " + std::to_string(a) + " " + std::to_string(b) + " " + std::to_string(c) + "\n";
    }
    return bytes;
}

std::string obj_text(const common::TriangleMesh& mesh) {
    std::string text = "# by hand\no thing\n";
    for (const Eigen::Vector3d& p : mesh.positions) text += "v " + joined<double>(p) + "\n";
    for (const auto& [a, b, c] : mesh.triangles) {
        text += "f " + std::to_string(a + 1) + " " + std::to_string(b + 1) + " " +
                std::to_string(c + 1) + "\n";
    }
    return text;
}

std::string off_text(const common::TriangleMesh& mesh) {
    std::string text = "OFF\n" + std::to_string(mesh.positions.size()) + " " +
                       std::to_string(mesh.triangles.size()) + " 0\n";
    for (const Eigen::Vector3d& p : mesh.positions) text += joined<double>(p) + "\n";
    for (const auto& [a, b, c] : mesh.triangles) {
        text += "3 " + std::to_string(a) + " " + std::to_string(b) + " " + std::to_string(c) + "\n";
    }
    return text;
}

std::string stl_text(const common::TriangleMesh& mesh) {
    std::string text = "solid thing\n";
    for (const common::Triangle& triangle : mesh.triangles) {
        text += "  facet normal 0 0 1\n    outer loop\n";
        for (const std::uint32_t corner : triangle) {
            text += "      vertex " + joined<float>(mesh.positions[corner]) + "\n";
        }
        text += "    endloop\n  endfacet\n";
    }
    return text + "endsolid thing\n";
}

std::string stl_binary(const common::TriangleMesh& mesh) {
    std::string bytes(80, ' ');
    bytes += raw(mesh.triangles.size(), 4, false);
    for (const common::Triangle& triangle : mesh.triangles) {
        bytes += raw_float(0) + raw_float(0) + raw_float(1);
        for (const std::uint32_t corner : triangle) {
            for (const double x : mesh.positions[corner]) bytes += raw_float(x);
        }
        bytes += raw(0, 2, false);
    }
    return bytes;
}

}  // namespace ellicast::tests
