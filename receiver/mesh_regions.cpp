// receiver/mesh_regions.cpp
#include "receiver/mesh_regions.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <atomic>

namespace ellicast::receiver {
namespace {

// A border of a slab of so many faces takes some hundreds of them.
constexpr std::size_t kFacesARegion = 12'000;
constexpr std::size_t kMostRegions = 16;
// Fine enough that the slabs of a long model differ little.
constexpr std::size_t kBins = 4096;

// The box's longest extent, cut into bins.
class Axis {
  public:
    explicit Axis(const SurfaceMesh& mesh) {
        Eigen::AlignedBox3d box;
        for (VertexId v = 0; v < mesh.vertex_slots(); ++v) {
            if (mesh.vertex_alive(v)) box.extend(mesh.position(v));
        }
        const double length = box.sizes().maxCoeff(&axis_);
        low_ = box.min()[axis_];
        scale_ = length > 0.0 ? static_cast<double>(kBins) / length : 0.0;
    }
    // Of a face, by its centre.
    [[nodiscard]] std::uint16_t bin(const SurfaceMesh& mesh, FaceId f) const {
        const auto [a, b, c] = mesh.face(f);
        const double sum =
            mesh.position(a)[axis_] + mesh.position(b)[axis_] + mesh.position(c)[axis_];
        const double place = scale_ * (sum / 3.0 - low_);
        return static_cast<std::uint16_t>(std::clamp(place, 0.0, kBins - 1.0));
    }

  private:
    int axis_ = 0;
    double low_ = 0.0;
    double scale_ = 0.0;
};

}  // namespace

MeshRegions::MeshRegions(const SurfaceMesh& mesh, bool shifted, unsigned threads,
                         std::span<const std::uint32_t> work) {
    const std::size_t whole =
        std::clamp<std::size_t>(mesh.face_slots() / kFacesARegion, 1, kMostRegions);
    // Half a region at each end where they are shifted.
    const std::size_t count = shifted && whole > 1 ? whole + 1 : whole;
    number_.assign(mesh.face_slots(), 0);
    if (count > 1) number_faces(mesh, count, shifted, threads, work);
    list_faces(mesh, count);
    find_borders(mesh, threads);
}

void MeshRegions::number_faces(const SurfaceMesh& mesh, std::size_t count, bool shifted,
                               unsigned threads, std::span<const std::uint32_t> work) {
    const Axis axis(mesh);
    std::vector<std::uint16_t> bins(mesh.face_slots(), 0);
    common::parallel_for(bins.size(), threads, [&](std::size_t begin, std::size_t end) {
        for (auto f = static_cast<FaceId>(begin); f < end; ++f) {
            if (mesh.face_alive(f)) bins[f] = axis.bin(mesh, f);
        }
    });
    std::vector<double> weight(kBins, 0.0);
    double total = 0.0;
    for (FaceId f = 0; f < bins.size(); ++f) {
        if (!mesh.face_alive(f)) continue;
        const double w = 1.0 + (work.empty() ? 0.0 : work[f]);
        weight[bins[f]] += w;
        total += w;
    }
    const double share = total / static_cast<double>(shifted ? count - 1 : count);
    std::vector<Number> of_bin(kBins);
    double sum = shifted ? 0.5 * share : 0.0;
    for (std::size_t bin = 0; bin < kBins; ++bin) {
        const auto place = static_cast<std::size_t>((sum + 0.5 * weight[bin]) / share);
        of_bin[bin] = static_cast<Number>(std::min(place, count - 1));
        sum += weight[bin];
    }
    std::transform(bins.begin(), bins.end(), number_.begin(),
                   [&](std::uint16_t bin) { return of_bin[bin]; });
}

void MeshRegions::list_faces(const SurfaceMesh& mesh, std::size_t count) {
    first_.assign(count + 1, 0);
    for (FaceId f = 0; f < number_.size(); ++f) {
        if (mesh.face_alive(f)) ++first_[number_[f] + 1U];
    }
    for (std::size_t region = 0; region < count; ++region) first_[region + 1] += first_[region];
    faces_.resize(first_.back());
    std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
    for (FaceId f = 0; f < number_.size(); ++f) {
        if (mesh.face_alive(f)) faces_[next[number_[f]]++] = f;
    }
}

void MeshRegions::find_borders(const SurfaceMesh& mesh, unsigned threads) {
    if (count() == 1) return;
    std::vector<char> at_border(mesh.vertex_slots(), 0);
    const auto set = [&](VertexId v) {  // by whichever thread
        std::atomic_ref(at_border[v]).store(1, std::memory_order_relaxed);
    };
    const auto for_each_face = [&](const auto& body) {
        common::parallel_for(number_.size(), threads, [&](std::size_t begin, std::size_t end) {
            for (auto f = static_cast<FaceId>(begin); f < end; ++f) {
                if (mesh.face_alive(f)) body(f);
            }
        });
    };
    for_each_face([&](FaceId f) {
        for (unsigned corner = 0; corner < 3; ++corner) {
            const HalfedgeId h = SurfaceMesh::halfedge(f, corner);
            if (number_[SurfaceMesh::face_of(mesh.twin(h))] == number_[f]) continue;
            set(mesh.from_vertex(h));
            set(mesh.to_vertex(h));
        }
    });
    border_.assign(number_.size(), 0);
    for_each_face([&](FaceId f) {
        const auto [a, b, c] = mesh.face(f);
        border_[f] = at_border[a] != 0 || at_border[b] != 0 || at_border[c] != 0 ? 1 : 0;
    });
}

}  // namespace ellicast::receiver
