// receiver/surface_distance.cpp
#include "receiver/surface_distance.hpp"

#include <functional>
#include <limits>
#include <queue>
#include <utility>

namespace ellicast::receiver {

std::vector<double> distance_along_edges(const SurfaceMesh& mesh, std::span<const VertexId> sources,
                                         double reach) {
    std::vector<double> distance(mesh.vertex_slots(), std::numeric_limits<double>::infinity());
    using Entry = std::pair<double, VertexId>;
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> front;
    for (const VertexId v : sources) {
        distance[v] = 0.0;
        front.emplace(0.0, v);
    }
    while (!front.empty()) {
        const double d = front.top().first;
        const VertexId v = front.top().second;
        front.pop();
        if (d > distance[v]) continue;  // a shorter way was found meanwhile
        mesh.for_each_outgoing(v, [&](HalfedgeId h) {
            const VertexId u = mesh.to_vertex(h);
            const double through_v = d + (mesh.position(u) - mesh.position(v)).norm();
            if (through_v <= reach && through_v < distance[u]) {
                distance[u] = through_v;
                front.emplace(through_v, u);
            }
        });
    }
    return distance;
}

}  // namespace ellicast::receiver
