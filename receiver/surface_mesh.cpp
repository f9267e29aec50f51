// receiver/surface_mesh.cpp
#include "receiver/surface_mesh.hpp"

#include <algorithm>
#include <cassert>
#include <numeric>
#include <span>
#include <tuple>
#include <utility>

#include "common/parallel.hpp"
#include "common/vertex_normals.hpp"

namespace ellicast::receiver {

std::optional<SurfaceMesh> SurfaceMesh::from(const common::TriangleMesh& mesh) {
    SurfaceMesh result;
    result.positions_ = mesh.positions;
    result.outgoing_.assign(mesh.positions.size(), kNone);
    result.corners_.reserve(3 * mesh.triangles.size());
    for (const common::Triangle& t : mesh.triangles) {
        for (const std::uint32_t v : t) {
            if (v >= mesh.positions.size()) return std::nullopt;
            result.outgoing_[v] = static_cast<HalfedgeId>(result.corners_.size());
            result.corners_.push_back(v);
        }
        if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) return std::nullopt;
    }
    if (!result.pair_halfedges()) return std::nullopt;
    for (const HalfedgeId h : result.outgoing_) {
        if (h == kNone) return std::nullopt;
    }
    result.live_vertices_ = mesh.positions.size();
    // One fan per vertex: the fans together must use every corner once.
    std::size_t corners = 0;
    for (VertexId v = 0; v < mesh.positions.size(); ++v) corners += result.valence(v);
    if (corners != result.corners_.size()) return std::nullopt;
    return result;
}

bool SurfaceMesh::pair_halfedges() {
    // In buckets by the lower vertex, each sorted by the higher one: linear, as buckets are small.
    struct Side {
        VertexId high;
        HalfedgeId h;
    };
    const auto low = [&](HalfedgeId h) { return std::min(from_vertex(h), to_vertex(h)); };
    const auto count = static_cast<HalfedgeId>(corners_.size());
    std::vector<HalfedgeId> first(positions_.size() + 2, 0);
    for (HalfedgeId h = 0; h < count; ++h) ++first[low(h) + 2];
    for (std::size_t v = 2; v < first.size(); ++v) first[v] += first[v - 1];
    std::vector<Side> sides(count);
    for (HalfedgeId h = 0; h < count; ++h) {
        sides[first[low(h) + 1]++] = {std::max(from_vertex(h), to_vertex(h)), h};
    }
    twins_.assign(count, kNone);
    for (std::size_t v = 0; v < positions_.size(); ++v) {
        const std::span bucket(&sides[0] + first[v], first[v + 1] - first[v]);
        if (bucket.size() % 2 != 0) return false;
        std::sort(bucket.begin(), bucket.end(), [](const Side& a, const Side& b) {
            return std::tie(a.high, a.h) < std::tie(b.high, b.h);
        });
        for (std::size_t i = 0; i < bucket.size(); i += 2) {
            const Side& a = bucket[i];
            const Side& b = bucket[i + 1];
            const bool triple = i + 2 < bucket.size() && bucket[i + 2].high == a.high;
            if (a.high != b.high || triple || from_vertex(a.h) == from_vertex(b.h)) return false;
            link(a.h, b.h);
        }
    }
    return true;
}

void SurfaceMesh::reserve(std::size_t more_vertices) {
    positions_.reserve(positions_.size() + more_vertices);
    outgoing_.reserve(outgoing_.size() + more_vertices);
    const std::size_t more_faces =
        2 * more_vertices - std::min(2 * more_vertices, slots_.faces.size());
    corners_.reserve(corners_.size() + 3 * more_faces);
    twins_.reserve(twins_.size() + 3 * more_faces);
}

std::size_t SurfaceMesh::valence(VertexId v) const {
    std::size_t n = 0;
    for_each_outgoing(v, [&](HalfedgeId) { ++n; });
    return n;
}

bool SurfaceMesh::adjacent(VertexId a, VertexId b) const {
    const HalfedgeId start = outgoing_[a];
    HalfedgeId h = start;
    do {
        if (to_vertex(h) == b) return true;
        h = rotate(h);
    } while (h != start);
    return false;
}

SurfaceMesh::Slots SurfaceMesh::take_slots(std::size_t vertices) {
    Slots slots;
    const auto take = [](std::vector<std::uint32_t>& from, std::size_t count,
                         std::vector<std::uint32_t>& to) {
        const std::size_t taken = std::min(count, from.size());
        to.assign(from.end() - static_cast<std::ptrdiff_t>(taken), from.end());
        from.resize(from.size() - taken);
        return count - taken;
    };
    // New ones before those that were there, so that they come last.
    const auto add = [](std::size_t first, std::size_t count, std::vector<std::uint32_t>& to) {
        to.insert(to.begin(), count, 0);
        std::iota(to.rend() - static_cast<std::ptrdiff_t>(count), to.rend(),
                  static_cast<std::uint32_t>(first));
    };
    const std::size_t new_vertices = take(slots_.vertices, vertices, slots.vertices);
    add(positions_.size(), new_vertices, slots.vertices);
    const std::size_t new_faces = take(slots_.faces, 2 * vertices, slots.faces);
    add(face_slots(), new_faces, slots.faces);
    positions_.resize(positions_.size() + new_vertices, Eigen::Vector3d::Zero());
    outgoing_.resize(positions_.size(), kNone);
    corners_.resize(corners_.size() + 3 * new_faces, kNone);
    twins_.resize(corners_.size(), kNone);
    return slots;
}

void SurfaceMesh::give_back(Slots slots) {
    live_vertices_ += static_cast<std::size_t>(slots.vertices_gained);
    slots_.vertices.insert(slots_.vertices.end(), slots.vertices.begin(), slots.vertices.end());
    slots_.faces.insert(slots_.faces.end(), slots.faces.begin(), slots.faces.end());
}

const Eigen::Vector3d& SurfaceMesh::grow(const Eigen::Vector3d& p) {
    if (slots_.vertices.empty()) {
        slots_.vertices.push_back(static_cast<VertexId>(positions_.size()));
        positions_.push_back(p);
        outgoing_.push_back(kNone);
    } else {
        positions_[slots_.vertices.back()] = p;
    }
    while (slots_.faces.size() < 2) {
        slots_.faces.insert(slots_.faces.begin(), static_cast<FaceId>(face_slots()));
        corners_.insert(corners_.end(), 3, kNone);
        twins_.insert(twins_.end(), 3, kNone);
    }
    return positions_[slots_.vertices.back()];
}

VertexId SurfaceMesh::new_vertex(const Eigen::Vector3d& p, Slots& slots) {
    assert(!slots.vertices.empty());
    const VertexId v = slots.vertices.back();
    slots.vertices.pop_back();
    positions_[v] = p;
    ++slots.vertices_gained;
    return v;
}

FaceId SurfaceMesh::new_face(Slots& slots) {
    assert(!slots.faces.empty());
    const FaceId f = slots.faces.back();
    slots.faces.pop_back();
    return f;
}

void SurfaceMesh::set_face(FaceId f, VertexId a, VertexId b, VertexId c) {
    const HalfedgeId h = halfedge(f, 0);
    corners_[h] = a;
    corners_[h + 1] = b;
    corners_[h + 2] = c;
    outgoing_[a] = h;
    outgoing_[b] = h + 1;
    outgoing_[c] = h + 2;
}

VertexId SurfaceMesh::split_face(FaceId f, const Eigen::Vector3d& p, Slots& slots) {
    assert(face_alive(f));
    const VertexId v = new_vertex(p, slots);
    const auto [a, b, c] = face(f);
    const HalfedgeId twin_bc = twins_[halfedge(f, 1)];
    const HalfedgeId twin_ca = twins_[halfedge(f, 2)];
    const FaceId g = new_face(slots);
    const FaceId k = new_face(slots);
    // f = (a, b, v), g = (b, c, v), k = (c, a, v); the half-edge (a, b) of f keeps its twin.
    set_face(f, a, b, v);
    set_face(g, b, c, v);
    set_face(k, c, a, v);
    link(halfedge(g, 0), twin_bc);
    link(halfedge(k, 0), twin_ca);
    link(halfedge(f, 1), halfedge(g, 2));
    link(halfedge(g, 1), halfedge(k, 2));
    link(halfedge(k, 1), halfedge(f, 2));
    return v;
}

VertexId SurfaceMesh::split_edge(HalfedgeId h, const Eigen::Vector3d& p, Slots& slots) {
    const HalfedgeId t = twins_[h];
    const FaceId f = face_of(h);
    const FaceId g = face_of(t);
    const VertexId a = from_vertex(h);
    const VertexId b = to_vertex(h);
    const VertexId c = opposite(h);
    const VertexId d = opposite(t);
    const HalfedgeId twin_bc = twins_[next(h)];
    const HalfedgeId twin_ca = twins_[prev(h)];
    const HalfedgeId twin_ad = twins_[next(t)];
    const HalfedgeId twin_db = twins_[prev(t)];
    const VertexId v = new_vertex(p, slots);
    const FaceId m = new_face(slots);
    const FaceId n = new_face(slots);
    // f = (v, c, a), m = (v, b, c), g = (v, d, b), n = (v, a, d)
    set_face(f, v, c, a);
    set_face(m, v, b, c);
    set_face(g, v, d, b);
    set_face(n, v, a, d);
    link(halfedge(f, 1), twin_ca);
    link(halfedge(m, 1), twin_bc);
    link(halfedge(g, 1), twin_db);
    link(halfedge(n, 1), twin_ad);
    link(halfedge(f, 0), halfedge(m, 2));
    link(halfedge(m, 0), halfedge(g, 2));
    link(halfedge(g, 0), halfedge(n, 2));
    link(halfedge(n, 0), halfedge(f, 2));
    return v;
}

bool SurfaceMesh::can_flip(HalfedgeId h) const {
    const HalfedgeId t = twins_[h];
    const VertexId c = opposite(h);
    const VertexId d = opposite(t);
    if (c == d || adjacent(c, d)) return false;
    return valence(from_vertex(h)) > 3 && valence(to_vertex(h)) > 3;
}

void SurfaceMesh::flip(HalfedgeId h) {
    const HalfedgeId t = twins_[h];
    const VertexId a = from_vertex(h);
    const VertexId b = to_vertex(h);
    const VertexId c = opposite(h);
    const VertexId d = opposite(t);
    const HalfedgeId twin_bc = twins_[next(h)];
    const HalfedgeId twin_ca = twins_[prev(h)];
    const HalfedgeId twin_ad = twins_[next(t)];
    const HalfedgeId twin_db = twins_[prev(t)];
    // (a, b, c) and (b, a, d) become (c, d, b) in f and (d, c, a) in g, the new edge on slots h and
    // t.
    const auto place = [&](HalfedgeId base, VertexId x, VertexId y, VertexId z) {
        corners_[base] = x;
        corners_[next(base)] = y;
        corners_[prev(base)] = z;
        outgoing_[x] = base;
        outgoing_[y] = next(base);
        outgoing_[z] = prev(base);
    };
    assert(face_of(h) != face_of(t));
    place(h, c, d, b);
    place(t, d, c, a);
    link(next(h), twin_db);
    link(prev(h), twin_bc);
    link(next(t), twin_ca);
    link(prev(t), twin_ad);
    link(h, t);
}

bool SurfaceMesh::can_collapse(HalfedgeId h) const {
    if (live_vertices() <= 4) return false;
    const VertexId a = from_vertex(h);
    const VertexId b = to_vertex(h);
    const VertexId c = opposite(h);
    const VertexId d = opposite(twins_[h]);
    // Common neighbours of a and b must be exactly c and d.
    std::size_t common = 0;
    bool ok = true;
    for_each_outgoing(a, [&](HalfedgeId x) {
        const VertexId n = to_vertex(x);
        if (n == b) return;
        if (n == c || n == d) {
            ++common;
        } else if (ok && adjacent(n, b)) {
            ok = false;
        }
    });
    return ok && common == 2 && valence(c) > 3 && valence(d) > 3;
}

void SurfaceMesh::collapse(HalfedgeId h, Slots& slots) {
    const HalfedgeId t = twins_[h];
    const VertexId a = from_vertex(h);
    const VertexId b = to_vertex(h);
    const FaceId f = face_of(h);
    const FaceId g = face_of(t);
    const HalfedgeId bc = twins_[next(h)];  // runs c -> b
    const HalfedgeId ca = twins_[prev(h)];  // runs a -> c
    const HalfedgeId ad = twins_[next(t)];  // runs d -> a
    const HalfedgeId db = twins_[prev(t)];  // runs b -> d
    const VertexId c = opposite(h);
    const VertexId d = opposite(t);
    // Rename a to b in a's fan.
    const HalfedgeId start = outgoing_[a];
    HalfedgeId x = start;
    do {
        const HalfedgeId following = rotate(x);
        corners_[x] = b;
        x = following;
    } while (x != start);
    link(ca, bc);  // b -> c with c -> b
    link(ad, db);  // d -> b with b -> d
    outgoing_[b] = db;
    outgoing_[c] = bc;
    outgoing_[d] = ad;
    outgoing_[a] = kNone;
    for (const FaceId dead : {f, g}) {
        for (unsigned corner = 0; corner < 3; ++corner) corners_[halfedge(dead, corner)] = kNone;
        slots.faces.push_back(dead);
    }
    --slots.vertices_gained;
}

Eigen::Vector3d SurfaceMesh::area_normal(FaceId f) const {
    const auto [a, b, c] = face(f);
    return (positions_[b] - positions_[a]).cross(positions_[c] - positions_[a]);
}

common::TriangleMesh SurfaceMesh::extract(std::vector<VertexId>* vertex_of) const {
    common::TriangleMesh mesh;
    std::vector<std::uint32_t> number(positions_.size(), kNone);
    mesh.positions.reserve(live_vertices());
    mesh.triangles.reserve(face_slots() - slots_.faces.size());
    if (vertex_of) {
        vertex_of->clear();
        vertex_of->reserve(live_vertices());
    }
    for (VertexId v = 0; v < positions_.size(); ++v) {
        if (!vertex_alive(v)) continue;
        number[v] = static_cast<std::uint32_t>(mesh.positions.size());
        mesh.positions.push_back(positions_[v]);
        if (vertex_of) vertex_of->push_back(v);
    }
    for (FaceId f = 0; f < face_slots(); ++f) {
        if (!face_alive(f)) continue;
        const auto [a, b, c] = face(f);
        mesh.triangles.push_back({number[a], number[b], number[c]});
    }
    return mesh;
}

std::string SurfaceMesh::validate() const {
    std::size_t corners = 0;
    for (FaceId f = 0; f < face_slots(); ++f) {
        if (!face_alive(f)) continue;
        corners += 3;
        const auto [a, b, c] = face(f);
        if (a == b || b == c || c == a) return "face with repeated corner";
        for (unsigned i = 0; i < 3; ++i) {
            const HalfedgeId h = halfedge(f, i);
            const HalfedgeId t = twins_[h];
            if (t == kNone || !face_alive(face_of(t)) || twins_[t] != h) return "twins disagree";
            if (from_vertex(t) != to_vertex(h) || to_vertex(t) != from_vertex(h)) {
                return "twins run alike";
            }
        }
    }
    std::size_t in_fans = 0;
    for (VertexId v = 0; v < positions_.size(); ++v) {
        if (!vertex_alive(v)) continue;
        if (from_vertex(outgoing_[v]) != v) return "outgoing half-edge starts elsewhere";
        std::vector<VertexId> ring;
        for_each_outgoing(v, [&](HalfedgeId h) { ring.push_back(to_vertex(h)); });
        in_fans += ring.size();
        if (ring.size() < 3) return "valence below 3";
        std::sort(ring.begin(), ring.end());
        if (std::adjacent_find(ring.begin(), ring.end()) != ring.end()) return "double edge";
    }
    if (in_fans != corners) return "a vertex has more than one fan";
    return "";
}

Eigen::Vector3d vertex_normal(const SurfaceMesh& mesh, VertexId v) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    const Eigen::Vector3d& p = mesh.position(v);
    mesh.for_each_outgoing(v, [&](HalfedgeId h) {
        sum += common::corner_normal(mesh.position(mesh.to_vertex(h)) - p,
                                     mesh.position(mesh.opposite(h)) - p);
    });
    return sum.normalized();
}

double mean_edge_length(const SurfaceMesh& mesh, unsigned threads) {
    constexpr std::size_t kPart = 1 << 16;  // of which a sum is made, whoever makes it
    struct Part {
        double sum = 0.0;
        std::size_t edges = 0;
    };
    const auto measure = [&](std::size_t begin, std::size_t end) {
        Part part;
        for (auto f = static_cast<FaceId>(begin); f < end; ++f) {
            if (!mesh.face_alive(f)) continue;
            const auto [a, b, c] = mesh.face(f);
            const Eigen::Vector3d& p = mesh.position(a);
            const Eigen::Vector3d& q = mesh.position(b);
            const Eigen::Vector3d& r = mesh.position(c);
            part.sum += (p - q).norm() + (q - r).norm() + (r - p).norm();
            part.edges += 3;
        }
        return part;
    };
    Part all;
    for (const Part& part : common::in_parts(mesh.face_slots(), kPart, threads, measure)) {
        all.sum += part.sum;
        all.edges += part.edges;
    }
    return all.edges == 0 ? 0.0 : all.sum / static_cast<double>(all.edges);
}

}  // namespace ellicast::receiver
