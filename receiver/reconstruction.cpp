// receiver/reconstruction.cpp
#include "receiver/reconstruction.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <iterator>
#include <numeric>
#include <span>
#include <utility>

#include "common/coarse_surface.hpp"
#include "common/ellipsoid.hpp"
#include "common/octahedral_normal.hpp"
#include "common/parallel.hpp"
#include "common/ring_tag.hpp"
#include "common/triangle_tree.hpp"
#include "common/vertex_normals.hpp"
#include "receiver/concealment.hpp"
#include "receiver/edge_flips.hpp"
#include "receiver/ellipsoid_mesh.hpp"
#include "receiver/missed_shape.hpp"
#include "receiver/object_frame.hpp"
#include "receiver/ring_repair.hpp"
#include "receiver/shrink_wrap.hpp"
#include "receiver/surface_distance.hpp"
#include "receiver/surface_mesh.hpp"
#include "receiver/surface_smoothing.hpp"
#include "receiver/vertex_insertion.hpp"
#include "receiver/vertex_removal.hpp"

namespace ellicast::receiver {
namespace {

using Eigen::Vector3d;

Vector3d position_of(const protocol::VertexRecord& record) {
    return {record.position[0], record.position[1], record.position[2]};
}

// One pass of the pipeline over one object; members are what the stages hand on.
class Pipeline {
  public:
    Pipeline(const ReceivedObject& object, const ReconstructionOptions& options)
        : object_(object), options_(options), frame_(object.hint) {
        points_.reserve(object.vertices.size());
        for (const auto& v : object.vertices) points_.push_back(frame_.to_unit(position_of(v)));
    }

    std::optional<Reconstruction> run() {
        if (!extract_coarse_surface()) return std::nullopt;
        if (received() > 0) {
            stage("wrap");
            unwrapped_ = coarse_->mesh;
            shrink_wrap(coarse_->mesh, points_, kWrapRounds, options_.threads);
            insert();
            mend_rings();
        }
        return finish();
    }

  private:
    static constexpr int kWrapRounds = 3;
    // The first chunk, as a multiple of the marching-cubes vertices that it is to replace.
    static constexpr std::size_t kEnoughVertices = 2;
    // Under loss, a marching-cubes vertex further from every received one than so many cells stays.
    // 400 ellipsoids wrapped to the received vertices follow a curved surface better than a
    // triangle over such a gap: 70 % loss, rms all removed and kept beyond 2.5 cells, in 1e-4: spot
    // 40 and 8, fertility 19 and 10, homer 16 and 9; horse 3.3 and 3.6. The sparser the vertices,
    // the nearer.
    static constexpr double kLeastReach = 1.75;
    static constexpr double kMostReach = 2.5;
    // With concealment only where vertices are really sparse. 70 % loss, rms with the reach above
    // and with this one, in 1e-4: rocker-arm 32 and 5.4, bunny 6.4 and 4.6; 90 %: spot 134 without
    // any marching-cubes vertex, 30 with those beyond 4 cells.
    static constexpr double kConcealedReach = 4.0;
    static constexpr double kReachSlope = 8.0;
    static constexpr double kSparse = 6.0;
    // Vertices further apart than this may miss what the coarse surface has.
    static constexpr double kSparseEnough = 2.5;

    void stage(const char* name) const {
        if (options_.on_stage) options_.on_stage(name);
    }

    bool extract_coarse_surface() {
        stage("coarse");
        const std::vector<common::Ellipsoid> ellipsoids = unit_ellipsoids(object_, frame_);
        if (ellipsoids.empty()) return false;
        const protocol::Hint& hint = object_.hint;
        const common::PromisedTopology promise{hint.components, hint.euler_all, hint.euler_largest};
        const std::vector<Vector3d> normals = tagged_normals();
        coarse_ = common::make_coarse_surface({ellipsoids, points_, normals, frame_.unit_box(hint)},
                                              promise, options_.grid, options_.threads);
        if (coarse_ && options_.keep_stages) {
            stages_.ellipsoids = to_model_frame(mesh_of(ellipsoids));
            stages_.marching_cubes = to_model_frame(coarse_->mesh);
            stages_.halfway = stages_.marching_cubes;
        }
        return coarse_.has_value();
    }

    void insert() {
        stage("insert");
        std::optional<SurfaceMesh> mesh = SurfaceMesh::from(coarse_->mesh);
        assert(mesh);
        surface_.mesh = std::move(*mesh);
        surface_.point_of_vertex.assign(surface_.mesh.vertex_slots(), kNone);
        // Indices are a spatially spread order, so that a prefix is an even sample.
        const std::size_t enough = kEnoughVertices * surface_.mesh.vertex_slots();
        const std::size_t first = std::min(points_.size(), enough);
        std::vector<std::uint32_t> order(points_.size());
        std::iota(order.begin(), order.end(), 0U);
        left_out_ =
            insert_points(surface_, points_, std::span(order).first(first), options_.threads);
        if (options_.keep_stages) stages_.halfway = to_model_frame(surface_.mesh.extract());
        const bool whole = received() == object_.hint.vertices;
        const bool all_in = first == points_.size() && left_out_.empty();
        settle(whole && all_in, all_in);
        if (all_in) return;
        std::vector<std::uint32_t> rest;
        std::merge(order.begin() + static_cast<std::ptrdiff_t>(first), order.end(),
                   left_out_.begin(), left_out_.end(), std::back_inserter(rest));
        stage("insert");
        left_out_ = insert_points(surface_, points_, rest, options_.threads);
        settle(whole, true);
    }

    // Removes marching-cubes vertices, puts the received ones where they belong, mends the
    // triangulation. Where every vertex arrived, `whole`, no marching-cubes vertex has a place in
    // the result. Points are not asked for after the `last` time.
    void settle(bool whole, bool last) {
        std::vector<bool> needed(surface_.mesh.vertex_slots(), false);
        if (!whole) {
            const double spacing = spacing_cells();
            needed = needed_coarse_vertices(spacing);
            if (conceals() && spacing > kSparseEnough) keep_what_is_missed(needed);
        }
        settle_with(needed, last);
    }

    void settle_with(const std::vector<bool>& needed, bool last) {
        stage("remove");
        const auto removable = [&](VertexId v) {
            return surface_.point_of_vertex[v] == kNone && !needed[v];
        };
        remove_vertices(surface_.mesh, removable, options_.threads);
        stage("shift");
        shift_to_points(surface_, points_);
        if (last) points_ = std::vector<Vector3d>();  // flips need the room
        stage("flip");
        flip_all_to_delaunay(surface_.mesh, options_.threads);
        fix_edges();
        smooth({});
    }

    // Tries what received vertices alone would give. Coarse vertices that this misses stay, too.
    void keep_what_is_missed(std::vector<bool>& needed) {
        const PointSurface before = surface_;
        settle_with(needed, false);
        Extracted trial = extract();
        const common::TriangleMesh mesh = trial.mesh;
        std::vector<double> doubts = doubts_at(mesh.positions);
        conceal_missing(trial, doubts);
        surface_ = before;
        for (std::size_t v = 0; v < doubts.size(); ++v) {
            if (trial.point[v] == kNone) doubts[v] = -1.0;
        }
        const MissedShape missed(mesh, doubts, trial.mesh);
        std::vector<char> misses(needed.size(), 0);
        common::parallel_for(
            misses.size(), options_.threads, [&](std::size_t begin, std::size_t end) {
                for (auto v = static_cast<VertexId>(begin); v < end; ++v) {
                    if (!surface_.mesh.vertex_alive(v) || surface_.point_of_vertex[v] != kNone) {
                        continue;
                    }
                    misses[v] = static_cast<char>(missed.at(surface_.mesh.position(v)));
                }
            });
        for (VertexId v = 0; v < needed.size(); ++v) {
            if (misses[v] != 0) needed[v] = true;
        }
    }

    // Edges that the sender names, between vertices that are there.
    void fix_edges() {
        fixed_ = FixedEdges(surface_.mesh.vertex_slots());
        if (object_.edges.empty() || received() == 0) return;
        std::vector<VertexId> slot_of(received(), kNone);
        for (VertexId v = 0; v < surface_.mesh.vertex_slots(); ++v) {
            const std::uint32_t point = surface_.point_of_vertex[v];
            if (point != kNone && surface_.mesh.vertex_alive(v)) slot_of[point] = v;
        }
        const std::uint32_t span = 1 + object_.vertex_index.back();
        const auto slot = [&](std::uint32_t index) {
            const auto place =
                std::lower_bound(object_.vertex_index.begin(), object_.vertex_index.end(), index);
            if (place == object_.vertex_index.end() || *place != index) return kNone;
            return slot_of[static_cast<std::size_t>(place - object_.vertex_index.begin())];
        };
        for (const protocol::EdgeRecord& edge : object_.edges) {
            if (span > edge.among) continue;
            const VertexId a = slot(edge.a);
            const VertexId b = slot(edge.b);
            if (a == kNone || b == kNone) continue;
            if (insert_edge(surface_.mesh, a, b, fixed_)) fixed_.add(a, b);
        }
    }

    // Rings that are `settled` stay.
    void smooth(std::span<const char> settled) {
        const common::DiagonalWeights weights =
            common::diagonal_weights(object_.hint.diagonals, has_normals(), loss());
        SurfaceSmoother smoother(surface_.mesh, options_.threads);
        smoother.smooth({.weights = {.angle = weights.angle},
                         .settled = settled,
                         .fixed = &fixed_,
                         .pairs = false});
        const std::vector<Vector3d> normals = guiding_normals();
        FlipCriterion criterion{
            .normals = normals, .weights = weights, .settled = settled, .fixed = &fixed_};
        smoother.smooth(criterion);
        if (!(weights.mark > common::kLeastDiagonalGain)) return;
        // Marks tell what the rule gets wrong of a mesh that is right otherwise; before it is
        // nearly so, they lead astray.
        const std::vector<char> marks = marked_vertices();
        criterion.marks = marks;
        smoother.smooth_marked(criterion);
    }

    // Per vertex slot. Requires tags.
    [[nodiscard]] std::vector<char> marked_vertices() const {
        std::vector<char> marks(surface_.mesh.vertex_slots(), 0);
        for (VertexId v = 0; v < marks.size(); ++v) {
            const std::uint32_t point = surface_.point_of_vertex[v];
            if (point == kNone) continue;
            marks[v] = static_cast<char>(
                common::is_marked(object_.vertices[point].normal, object_.hint.format.normal_bits));
        }
        return marks;
    }

    [[nodiscard]] std::size_t received() const { return object_.vertices.size(); }

    // Of vertices; the one loss that geometry knows of (DESIGN section 1).
    [[nodiscard]] double loss() const {
        return 1.0 - static_cast<double>(received()) / static_cast<double>(object_.hint.vertices);
    }

    // Ring tags know better than any shape criterion which edges there were.
    void mend_rings() {
        if (!object_.hint.format.ring) return;
        stage("rings");
        std::vector<RingWitness> witnesses(surface_.mesh.vertex_slots());
        for (VertexId v = 0; v < witnesses.size(); ++v) {
            const std::uint32_t point = surface_.point_of_vertex[v];
            if (point == kNone) continue;
            witnesses[v] = {common::ring_hash(object_.vertex_index[point]),
                            static_cast<std::uint8_t>(object_.vertices[point].ring), true};
        }
        if (received() < object_.hint.vertices) return mend_lossy(witnesses);
        SurfaceMesh other = surface_.mesh;
        flip_all_to_delaunay(other, options_.threads);
        if (ring_agreement(other, witnesses).agree > ring_agreement(surface_.mesh, witnesses).agree)
            std::swap(other, surface_.mesh);
        rings_ = repair_rings(surface_.mesh, witnesses);
        if (rings_->disagree == 0) return;
        const RingAgreement others = repair_rings(other, witnesses);
        if (others.disagree < rings_->disagree) {
            rings_ = others;
            surface_.mesh = std::move(other);
        }
    }

    // Rings that agree stay; the rest is mended anew around them.
    void mend_lossy(const std::vector<RingWitness>& witnesses) {
        flip_all_to_delaunay(surface_.mesh, options_.threads);
        repair_rings(surface_.mesh, witnesses, true);
        smooth(settled_rings(surface_.mesh, witnesses));
        rings_ = ring_agreement(surface_.mesh, witnesses);
    }

    [[nodiscard]] bool has_normals() const { return object_.hint.format.normal_bits != 0; }

    // One a point; none without tags.
    [[nodiscard]] std::vector<Vector3d> tagged_normals() const {
        std::vector<Vector3d> normals;
        if (!has_normals()) return normals;
        normals.reserve(object_.vertices.size());
        for (const auto& v : object_.vertices) {
            normals.push_back(common::decode_normal(v.normal, object_.hint.format.normal_bits));
        }
        return normals;
    }

    // Requires tags.
    [[nodiscard]] Vector3d tag_of(std::uint32_t point) const {
        return common::decode_normal(object_.vertices[point].normal,
                                     object_.hint.format.normal_bits);
    }

    // Of the vertex that stands for `point`: its tag, turned towards the surface's own `estimate`
    // by at most `doubt` radians; the estimate itself where there is no tag.
    [[nodiscard]] Vector3d normal_at(std::uint32_t point, const Vector3d& estimate,
                                     double doubt) const {
        if (point == kNone || !has_normals()) return estimate;
        const Vector3d tag = tag_of(point);
        const double angle = std::atan2(tag.cross(estimate).norm(), tag.dot(estimate));
        if (angle <= doubt) return estimate;
        const double f = doubt / angle;
        return (std::sin((1 - f) * angle) * tag + std::sin(f * angle) * estimate).normalized();
    }

    // Per vertex slot: tags, and the surface's own estimates where there are none.
    [[nodiscard]] std::vector<Vector3d> guiding_normals() const {
        std::vector<Vector3d> normals(surface_.mesh.vertex_slots(), Vector3d::Zero());
        common::parallel_for(
            normals.size(), options_.threads, [&](std::size_t begin, std::size_t end) {
                for (auto v = static_cast<VertexId>(begin); v < end; ++v) {
                    if (!surface_.mesh.vertex_alive(v)) continue;
                    const std::uint32_t point = surface_.point_of_vertex[v];
                    normals[v] = point != kNone && has_normals() ? tag_of(point)
                                                                 : vertex_normal(surface_.mesh, v);
                }
            });
        return normals;
    }

    // Between received vertices, were they even.
    [[nodiscard]] double spacing_cells() const {
        double area = 0.0;
        for (FaceId f = 0; f < surface_.mesh.face_slots(); ++f) {
            if (surface_.mesh.face_alive(f)) area += 0.5 * surface_.mesh.area_normal(f).norm();
        }
        return std::sqrt(area / static_cast<double>(received())) / coarse_->cell;
    }

    // Where vertices lie closer than kSparse cells, concealment knows better than marching-cubes
    // vertices do; they go out to a distance that falls to kLeastReach beyond.
    [[nodiscard]] double reach_cells(double spacing) const {
        if (!options_.conceal) {
            return std::clamp(kMostReach + 1.0 - spacing, kLeastReach, kMostReach);
        }
        return kConcealedReach + kReachSlope * std::max(0.0, kSparse - spacing);
    }

    // Marching-cubes vertices with no received vertex within reach along the surface: there they
    // are all that tells the shape, and they tell it better than triangles across the gap would.
    [[nodiscard]] std::vector<bool> needed_coarse_vertices(double spacing) const {
        std::vector<VertexId> received;
        for (VertexId v = 0; v < surface_.mesh.vertex_slots(); ++v) {
            if (surface_.mesh.vertex_alive(v) && surface_.point_of_vertex[v] != kNone) {
                received.push_back(v);
            }
        }
        const double reach = reach_cells(spacing) * coarse_->cell;
        const std::vector<double> distance = distance_along_edges(surface_.mesh, received, reach);
        std::vector<bool> needed(distance.size());
        for (VertexId v = 0; v < needed.size(); ++v) needed[v] = distance[v] > reach;
        return needed;
    }

    // The point that result vertex i stands for; kNone for marching-cubes vertices.
    struct Extracted {
        common::TriangleMesh mesh;  // unit frame
        std::vector<std::uint32_t> point;
    };
    Extracted extract() {
        Extracted result;
        if (received() == 0) {
            result.mesh = std::move(coarse_->mesh);
            result.point.assign(result.mesh.positions.size(), kNone);
            return result;
        }
        std::vector<VertexId> slots;
        result.mesh = surface_.mesh.extract(&slots);
        result.point.reserve(slots.size());
        for (const VertexId v : slots) result.point.push_back(surface_.point_of_vertex[v]);
        surface_ = {};  // as large as all that follows
        return result;
    }

    // Vertices that only the end of an order by importance would bring are missed everywhere, and
    // less. Prefix of half the vertices, rms with this strength and with that of as many lost at
    // random, in 1e-4: spot 3.4 4.9, rocker-arm 1.8 2.2, bunny 1.7 2.0.
    [[nodiscard]] Gaps gaps() const {
        if (!object_.hint.by_importance) return {loss(), 0.0};
        const double span = 1.0 + object_.vertex_index.back();
        const double lost = 1.0 - static_cast<double>(received()) / span;
        const double to_come = 1.0 - span / static_cast<double>(object_.hint.vertices);
        return {lost, to_come * to_come};
    }

    // What wrapping had to move the coarse surface by, or would have had to.
    [[nodiscard]] std::vector<double> doubts_at(const std::vector<Vector3d>& positions) const {
        const common::TriangleTree unwrapped(unwrapped_);
        std::vector<double> doubts(positions.size());
        common::parallel_for(
            doubts.size(), options_.threads, [&](std::size_t begin, std::size_t end) {
                for (std::size_t v = begin; v < end; ++v) {
                    doubts[v] = std::sqrt(unwrapped.closest(positions[v]).squared_distance);
                }
            });
        return doubts;
    }

    [[nodiscard]] bool conceals() const {
        return options_.conceal && received() > 0 && loss() > 0.0;
    }

    // DESIGN section 7. `doubts` are those at the positions of the mesh.
    void conceal_missing(Extracted& extracted, const std::vector<double>& doubts) const {
        stage("conceal");
        const std::vector<Vector3d> estimates = common::vertex_normals(extracted.mesh);
        const common::TriangleTree wrapped(coarse_->mesh);
        const double doubt =
            has_normals() ? 0.5 * common::normal_cell_angle(object_.hint.format.normal_bits) : 0.0;
        std::vector<KnownVertex> known(extracted.mesh.positions.size());
        common::parallel_for(
            known.size(), options_.threads, [&](std::size_t begin, std::size_t end) {
                for (std::size_t v = begin; v < end; ++v) {
                    known[v] = {normal_at(extracted.point[v], estimates[v], doubt), doubts[v]};
                }
            });
        Concealed concealed = conceal(extracted.mesh, std::move(known), {&wrapped, coarse_->cell},
                                      gaps(), options_.threads);
        flatten_intersections(concealed, options_.threads);
        extracted.mesh = std::move(concealed.mesh);
        extracted.point.resize(extracted.mesh.positions.size(), kNone);
    }

    // Received vertices get their record's bits, not what the way to the unit frame and back left
    // of them.
    Reconstruction finish() {
        stage("finish");
        Reconstruction result;
        Extracted extracted = extract();
        const std::size_t unguessed = extracted.point.size();
        if (conceals()) conceal_missing(extracted, doubts_at(extracted.mesh.positions));
        result.mesh = to_model_frame(std::move(extracted.mesh));
        result.provenance.reserve(extracted.point.size());
        result.vertex_index.reserve(extracted.point.size());
        for (std::size_t i = 0; i < extracted.point.size(); ++i) {
            const std::uint32_t point = extracted.point[i];
            result.provenance.push_back(point != kNone  ? Provenance::received
                                        : i < unguessed ? Provenance::coarse
                                                        : Provenance::concealed);
            result.vertex_index.push_back(point == kNone ? kNotReceived
                                                         : object_.vertex_index[point]);
            if (point != kNone) {
                result.mesh.positions[i] = origin() + position_of(object_.vertices[point]);
            }
        }
        for (const std::uint32_t point : left_out_) {
            result.not_inserted.push_back(object_.vertex_index[point]);
        }
        result.rings = rings_;
        result.topology = common::analyse_topology(result.mesh);
        result.topology_as_promised = as_promised(result.topology);
        result.judged = !object_.hint.approximate;
        result.isolevel = static_cast<float>(coarse_->isolevel * frame_.diagonal);
        if (options_.keep_stages) result.stages = std::move(stages_);
        judge_confidence(result);
        return result;
    }

    void judge_confidence(Reconstruction& result) const {
        stage("confidence");
        std::vector<std::uint32_t> received;
        for (std::uint32_t v = 0; v < result.vertex_index.size(); ++v) {
            if (result.vertex_index[v] != kNotReceived) received.push_back(v);
        }
        const std::size_t expected = object_.hint.vertices;
        const std::size_t missing = expected - std::min(expected, object_.vertices.size());
        result.confidence = measure_confidence(result.mesh, received, missing, options_.threads);
        const auto& lo = object_.hint.box_min;
        const auto& hi = object_.hint.box_max;
        const Eigen::AlignedBox3d box(origin() + Vector3d(lo[0], lo[1], lo[2]),
                                      origin() + Vector3d(hi[0], hi[1], hi[2]));
        result.summary = summarise(result.confidence, result.mesh, received, missing, box);
    }

    [[nodiscard]] bool as_promised(const common::MeshTopology& topology) const {
        const protocol::Hint& hint = object_.hint;
        return topology.closed && topology.manifold && topology.components == hint.components &&
               topology.euler == hint.euler_all && topology.euler_largest == hint.euler_largest;
    }

    [[nodiscard]] Vector3d origin() const { return origin_of(object_); }

    [[nodiscard]] common::TriangleMesh to_model_frame(common::TriangleMesh mesh) const {
        for (Vector3d& p : mesh.positions) p = origin() + frame_.from_unit(p);
        return mesh;
    }

    const ReceivedObject& object_;
    const ReconstructionOptions& options_;
    ObjectFrame frame_;
    std::vector<Vector3d> points_;  // as received, unit frame; none after the last settling
    std::optional<common::CoarseSurface> coarse_;
    common::TriangleMesh unwrapped_;
    PointSurface surface_;
    std::vector<std::uint32_t> left_out_;
    FixedEdges fixed_;
    std::optional<RingAgreement> rings_;
    Stages stages_;
};

}  // namespace

std::optional<Reconstruction> reconstruct(const ReceivedObject& object,
                                          const ReconstructionOptions& options) {
    return Pipeline(object, options).run();
}

}  // namespace ellicast::receiver
