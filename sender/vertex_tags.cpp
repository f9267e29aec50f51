// sender/vertex_tags.cpp
#include "sender/vertex_tags.hpp"

#include <algorithm>
#include <cassert>
#include <numeric>
#include <utility>

#include "common/octahedral_normal.hpp"
#include "common/ring_tag.hpp"

namespace ellicast::sender {
namespace {

using common::Triangle;
using protocol::VertexRecord;

/// For each vertex of the model the index of its record.
std::vector<std::uint32_t> record_indices(const std::vector<VertexRecord>& of_vertex,
                                          const std::vector<VertexRecord>& records) {
    std::vector<std::uint32_t> by_position(records.size());
    std::iota(by_position.begin(), by_position.end(), 0u);
    std::sort(by_position.begin(), by_position.end(), [&](std::uint32_t a, std::uint32_t b) {
        return records[a].position < records[b].position;
    });
    std::vector<std::uint32_t> indices;
    indices.reserve(of_vertex.size());
    for (const VertexRecord& wanted : of_vertex) {
        const auto found = std::lower_bound(
            by_position.begin(), by_position.end(), wanted.position,
            [&](std::uint32_t a, const auto& position) { return records[a].position < position; });
        assert(found != by_position.end() && records[*found].position == wanted.position);
        indices.push_back(*found);
    }
    return indices;
}

void set_normals(int bits, const PreparedModel& model, const std::vector<std::uint32_t>& index,
                 std::vector<VertexRecord>& records) {
    std::vector<Eigen::Vector3d> sums(records.size(), Eigen::Vector3d::Zero());
    for (const Triangle& face : model.faces) {
        const Eigen::Vector3d& a = model.vertices[face[0]];
        const Eigen::Vector3d area_vector =
            (model.vertices[face[1]] - a).cross(model.vertices[face[2]] - a);
        for (const std::uint32_t v : face) sums[index[v]] += area_vector;
    }
    for (std::size_t k = 0; k < records.size(); ++k) {
        records[k].normal = common::encode_normal(sums[k], bits);
    }
}

void set_rings(const PreparedModel& model, const std::vector<std::uint32_t>& index,
               std::vector<VertexRecord>& records) {
    std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
    edges.reserve(6 * model.faces.size());
    for (const Triangle& face : model.faces) {
        for (std::size_t c = 0; c < 3; ++c) {
            const std::uint32_t a = index[face[c]];
            const std::uint32_t b = index[face[(c + 1) % 3]];
            if (a == b) continue;
            edges.emplace_back(a, b);
            edges.emplace_back(b, a);
        }
    }
    std::sort(edges.begin(), edges.end());
    edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
    for (std::size_t at = 0; at < edges.size();) {
        const std::uint32_t center = edges[at].first;
        std::size_t valence = 0;
        unsigned sum = 0;
        for (; at < edges.size() && edges[at].first == center; ++at, ++valence) {
            sum += common::ring_hash(edges[at].second);
        }
        records[center].ring = common::ring_tag(valence, sum);
    }
}

void set_colours(const PreparedModel& model, const std::vector<std::uint32_t>& index,
                 std::vector<VertexRecord>& records) {
    assert(model.colours.size() == model.vertices.size());
    for (std::size_t v = model.vertices.size(); v-- > 0;) {  // so that the first one stays
        records[index[v]].colour = model.colours[v];
    }
}

}  // namespace

protocol::RecordFormat record_format(const TagOptions& options, const PreparedModel& model) {
    return {.normal_bits = static_cast<std::uint8_t>(options.normal_bits),
            .ring = options.ring,
            .colour = options.colour && !model.colours.empty()};
}

void set_tags(const protocol::RecordFormat& format, const PreparedModel& model,
              const std::vector<VertexRecord>& of_vertex, std::vector<VertexRecord>& records) {
    if (format == protocol::RecordFormat{}) return;
    const std::vector<std::uint32_t> index = record_indices(of_vertex, records);
    if (format.normal_bits > 0) set_normals(format.normal_bits, model, index, records);
    if (format.ring) set_rings(model, index, records);
    if (format.colour) set_colours(model, index, records);
}

}  // namespace ellicast::sender
