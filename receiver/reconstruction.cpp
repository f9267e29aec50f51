// receiver/reconstruction.cpp
#include "receiver/reconstruction.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "common/ellipsoid.hpp"
#include "receiver/coarse_surface.hpp"
#include "receiver/edge_flips.hpp"
#include "receiver/shrink_wrap.hpp"
#include "receiver/surface_mesh.hpp"
#include "receiver/vertex_insertion.hpp"
#include "receiver/vertex_removal.hpp"

namespace ellicast::receiver {
namespace {

using Eigen::Vector3d;

// The object's frame <-> one in which the hinted box has its centre at 0 and a diagonal of 1, where
// all tolerances live.
struct Frame {
    Vector3d center;
    double diagonal;

    explicit Frame(const protocol::Hint& hint) {
        const Vector3d lo(hint.box_min[0], hint.box_min[1], hint.box_min[2]);
        const Vector3d hi(hint.box_max[0], hint.box_max[1], hint.box_max[2]);
        center = 0.5 * (lo + hi);
        diagonal = (hi - lo).norm();
    }
    [[nodiscard]] Vector3d to_unit(const Vector3d& x) const { return (x - center) / diagonal; }
    [[nodiscard]] Vector3d from_unit(const Vector3d& x) const { return center + diagonal * x; }
};

Vector3d position_of(const protocol::VertexRecord& record) {
    return {record.position[0], record.position[1], record.position[2]};
}

std::vector<common::Ellipsoid> unit_ellipsoids(const ReceivedObject& object, const Frame& frame) {
    std::vector<common::Ellipsoid> result;
    result.reserve(object.ellipsoids.size());
    for (const protocol::EllipsoidRecord& record : object.ellipsoids) {
        const auto& s = record.scalars;
        common::Ellipsoid e;
        e.center = frame.to_unit({s[0], s[1], s[2]});
        e.L << s[3], 0, 0, s[4], s[5], 0, s[6], s[7], s[8];
        e.L /= frame.diagonal;
        result.push_back(e);
    }
    return result;
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
        if (!points_.empty()) {
            stage("wrap");
            shrink_wrap(coarse_->mesh, points_, kWrapRounds, options_.threads);
            insert();
        }
        return finish();
    }

  private:
    static constexpr int kWrapRounds = 3;

    void stage(const char* name) const {
        if (options_.on_stage) options_.on_stage(name);
    }

    bool extract_coarse_surface() {
        stage("coarse");
        const std::vector<common::Ellipsoid> ellipsoids = unit_ellipsoids(object_, frame_);
        if (ellipsoids.empty()) return false;
        const protocol::Hint& hint = object_.hint;
        const Vector3d lo(hint.box_min[0], hint.box_min[1], hint.box_min[2]);
        const Vector3d hi(hint.box_max[0], hint.box_max[1], hint.box_max[2]);
        const PromisedTopology promise{hint.components, hint.euler_all, hint.euler_largest};
        coarse_ = make_coarse_surface(ellipsoids, points_,
                                      Eigen::AlignedBox3d(frame_.to_unit(lo), frame_.to_unit(hi)),
                                      promise, options_.grid, options_.threads);
        return coarse_.has_value();
    }

    [[nodiscard]] double loss() const {
        return 1.0 - static_cast<double>(object_.vertices.size()) /
                         static_cast<double>(std::max<std::uint32_t>(1, object_.hint.vertices));
    }

    void insert() {
        stage("insert");
        std::optional<SurfaceMesh> mesh = SurfaceMesh::from(coarse_->mesh);
        assert(mesh);
        surface_.mesh = std::move(*mesh);
        surface_.point_of_vertex.assign(surface_.mesh.vertex_slots(), kNone);
        std::vector<std::uint32_t> all(points_.size());
        for (std::uint32_t i = 0; i < all.size(); ++i) all[i] = i;
        left_out_ = insert_points(surface_, points_, all, options_.threads);
        stage("remove");
        remove_vertices(surface_.mesh,
                        [&](VertexId v) { return surface_.point_of_vertex[v] == kNone; });
        stage("shift");
        shift_to_points(surface_, points_);
        stage("flip");
        flip_all_to_delaunay(surface_.mesh);
        flip_to_smooth(surface_.mesh);
    }

    Reconstruction finish() {
        stage("finish");
        Reconstruction result;
        std::vector<VertexId> slots;
        if (points_.empty()) {
            result.mesh = std::move(coarse_->mesh);
            result.vertex_index.assign(result.mesh.positions.size(), kNotReceived);
        } else {
            result.mesh = surface_.mesh.extract(&slots);
            for (const VertexId v : slots) {
                const std::uint32_t point = surface_.point_of_vertex[v];
                result.vertex_index.push_back(point == kNone ? kNotReceived
                                                             : object_.vertex_index[point]);
            }
        }
        Vector3d origin = Vector3d::Zero();
        if (object_.description)
            origin = Eigen::Map<const Vector3d>(object_.description->origin.data());
        for (std::size_t i = 0; i < result.mesh.positions.size(); ++i) {
            const std::uint32_t point = slots.empty() ? kNone : surface_.point_of_vertex[slots[i]];
            Vector3d& p = result.mesh.positions[i];
            p = origin +
                (point == kNone ? frame_.from_unit(p) : position_of(object_.vertices[point]));
        }
        for (const std::uint32_t point : left_out_) {
            result.not_inserted.push_back(object_.vertex_index[point]);
        }
        result.topology = common::analyse_topology(result.mesh);
        result.isolevel = static_cast<float>(coarse_->isolevel);
        return result;
    }

    const ReceivedObject& object_;
    const ReconstructionOptions& options_;
    Frame frame_;
    std::vector<Vector3d> points_;
    std::optional<CoarseSurface> coarse_;
    PointSurface surface_;
    std::vector<std::uint32_t> left_out_;
};

}  // namespace

std::optional<Reconstruction> reconstruct(const ReceivedObject& object,
                                          const ReconstructionOptions& options) {
    return Pipeline(object, options).run();
}

}  // namespace ellicast::receiver
