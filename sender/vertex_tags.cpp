// sender/vertex_tags.cpp
#include "sender/vertex_tags.hpp"

#include <algorithm>
#include <cassert>
#include <utility>

#include "common/octahedral_normal.hpp"
#include "common/ring_tag.hpp"

namespace ellicast::sender {
namespace {

using common::Triangle;
using protocol::VertexRecord;

void set_normals(int bits, const PreparedModel& model, const std::vector<std::uint32_t>& record_of,
                 const std::vector<char>& marks, std::vector<VertexRecord>& records) {
    std::vector<Eigen::Vector3d> sums(records.size(), Eigen::Vector3d::Zero());
    for (const Triangle& face : model.faces) {
        const Eigen::Vector3d& a = model.vertices[face[0]];
        const Eigen::Vector3d area_vector =
            (model.vertices[face[1]] - a).cross(model.vertices[face[2]] - a);
        for (const std::uint32_t v : face) sums[record_of[v]] += area_vector;
    }
    std::vector<bool> marked(records.size(), false);
    for (std::size_t v = 0; v < model.vertices.size(); ++v) {
        if (marks[v] != 0) marked[record_of[v]] = true;
    }
    for (std::size_t k = 0; k < records.size(); ++k) {
        records[k].normal = common::encode_marked_normal(sums[k], bits, marked[k]);
    }
}

void set_colours(const PreparedModel& model, const std::vector<std::uint32_t>& record_of,
                 std::vector<VertexRecord>& records) {
    assert(model.colours.size() == model.vertices.size());
    for (std::size_t v = model.vertices.size(); v-- > 0;) {  // so that the first one stays
        records[record_of[v]].colour = model.colours[v];
    }
}

}  // namespace

protocol::RecordFormat record_format(const TagOptions& options, const PreparedModel& model) {
    return {.normal_bits = static_cast<std::uint8_t>(options.normal_bits),
            .ring = options.ring,
            .colour = options.colour && !model.colours.empty()};
}

void set_tags(const protocol::RecordFormat& format, const PreparedModel& model,
              const std::vector<std::uint32_t>& record_of, const std::vector<char>& marks,
              std::vector<VertexRecord>& records) {
    if (format.normal_bits > 0) set_normals(format.normal_bits, model, record_of, marks, records);
    if (format.colour) set_colours(model, record_of, records);
}

void set_rings(const std::vector<Triangle>& faces, const std::vector<std::uint32_t>& record_of,
               std::vector<VertexRecord>& records) {
    std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
    edges.reserve(6 * faces.size());
    for (const Triangle& face : faces) {
        for (std::size_t c = 0; c < 3; ++c) {
            const std::uint32_t a = record_of[face[c]];
            const std::uint32_t b = record_of[face[(c + 1) % 3]];
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

}  // namespace ellicast::sender
