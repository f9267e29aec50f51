// tests/support/draco_rival.cpp
#include "tests/support/draco_rival.hpp"

// Draco's headers do not keep to our warnings.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wshadow"
#pragma GCC diagnostic ignored "-Wpedantic"
#include <draco/compression/decode.h>
#include <draco/compression/encode.h>
#include <draco/mesh/triangle_soup_mesh_builder.h>
#pragma GCC diagnostic pop

#include <array>
#include <memory>
#include <stdexcept>

namespace ellicast::tests {
namespace {

constexpr int kPositionBits = 14;
constexpr int kSpeed = 0;  // level 10

}  // namespace

std::vector<char> draco_encode(const common::TriangleMesh& mesh) {
    draco::TriangleSoupMeshBuilder builder;
    builder.Start(static_cast<int>(mesh.triangles.size()));
    const int positions =
        builder.AddAttribute(draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        std::array<Eigen::Vector3f, 3> corners;
        for (std::size_t k = 0; k < 3; ++k) {
            corners[k] = mesh.positions[mesh.triangles[t][k]].cast<float>();
        }
        builder.SetAttributeValuesForFace(positions,
                                          draco::FaceIndex(static_cast<std::uint32_t>(t)),
                                          corners[0].data(), corners[1].data(), corners[2].data());
    }
    const std::unique_ptr<draco::Mesh> packed = builder.Finalize();
    if (!packed) throw std::runtime_error("Draco takes no such mesh");
    draco::Encoder encoder;
    encoder.SetSpeedOptions(kSpeed, kSpeed);
    encoder.SetEncodingMethod(draco::MESH_EDGEBREAKER_ENCODING);
    encoder.SetAttributeQuantization(draco::GeometryAttribute::POSITION, kPositionBits);
    draco::EncoderBuffer buffer;
    const draco::Status status = encoder.EncodeMeshToBuffer(*packed, &buffer);
    if (!status.ok()) throw std::runtime_error(status.error_msg_string());
    return {buffer.data(), buffer.data() + buffer.size()};
}

common::TriangleMesh draco_decode(const std::vector<char>& bytes) {
    draco::DecoderBuffer buffer;
    buffer.Init(bytes.data(), bytes.size());
    draco::Decoder decoder;
    auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
    if (!decoded.ok()) throw std::runtime_error(decoded.status().error_msg_string());
    const std::unique_ptr<draco::Mesh> packed = std::move(decoded).value();
    const draco::PointAttribute* positions =
        packed->GetNamedAttribute(draco::GeometryAttribute::POSITION);
    if (positions == nullptr) throw std::runtime_error("a Draco mesh without positions");
    common::TriangleMesh mesh;
    // Values, not points: what was one vertex is one again.
    for (std::uint32_t v = 0; v < positions->size(); ++v) {
        std::array<float, 3> p{};
        positions->ConvertValue<float, 3>(draco::AttributeValueIndex(v), p.data());
        mesh.positions.emplace_back(p[0], p[1], p[2]);
    }
    for (std::uint32_t f = 0; f < packed->num_faces(); ++f) {
        const draco::Mesh::Face& face = packed->face(draco::FaceIndex(f));
        mesh.triangles.push_back({positions->mapped_index(face[0]).value(),
                                  positions->mapped_index(face[1]).value(),
                                  positions->mapped_index(face[2]).value()});
    }
    return mesh;
}

}  // namespace ellicast::tests
