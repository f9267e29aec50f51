// tests/support/comparison.cpp
#include "tests/support/comparison.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <map>
#include <stdexcept>
#include <utility>

#include "common/mesh_distance.hpp"
#include "common/mesh_topology.hpp"
#include "common/model_io.hpp"
#include "common/self_intersection.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/floor.hpp"
#ifdef ELLICAST_WITH_CGAL
#include "tests/support/rivals.hpp"
#endif
#ifdef ELLICAST_WITH_DRACO
#include "tests/support/draco_rival.hpp"
#endif

namespace ellicast::tests {
namespace {

using common::TriangleMesh;

// A progressive mesh: 12 bytes of position a vertex, as ours, and 4.5 bits for the place and the
// two sides of its split, which is less than published coders of them need; or all of it in
// 3.5 bytes, as if it were packed like the best single-rate coder.
constexpr double kProgressiveBytes = 12 + 4.5 / 8;
constexpr double kPackedProgressiveBytes = 3.5;

// What the loss acts on.
constexpr sender::TagOptions kPlain{.normal_bits = 0, .ring = false, .colour = false};

bool same_tags(const sender::TagOptions& a, const sender::TagOptions& b) {
    return a.normal_bits == b.normal_bits && a.ring == b.ring && a.colour == b.colour;
}

struct Work {
    const ComparedModel& model;
    const CellReception& reception;
    const ComparisonOptions& options;
    ComparisonRow row;  // with what all methods share
};

std::uint64_t bytes_of(const std::vector<TimedDatagram>& stream) {
    std::uint64_t bytes = 0;
    for (const TimedDatagram& datagram : stream) bytes += datagram.bytes.size();
    return bytes;
}

// What would have arrived of a stream of another size.
std::uint64_t scaled(std::uint64_t bytes, std::uint64_t stream, std::uint64_t plain_stream) {
    if (stream == plain_stream) return bytes;
    return static_cast<std::uint64_t>(static_cast<double>(bytes) * static_cast<double>(stream) /
                                      static_cast<double>(plain_stream));
}

const VariantObject* find_variant(const ComparedModel& model, std::string_view name) {
    for (const VariantObject& variant : model.variants) {
        if (variant.variant.name == name) return &variant;
    }
    return nullptr;
}

// The received records as the variant's stream would have had them.
receiver::ReceivedObject received_as(const VariantObject& variant, const ComparedModel& model,
                                     const receiver::ReceivedObject& plain) {
    receiver::ReceivedObject object = plain;
    object.id = variant.object.id;
    object.hint = variant.object.hint;
    for (std::size_t k = 0; k < object.vertices.size(); ++k) {
        object.vertices[k] = variant.object.vertices[object.vertex_index[k]];
    }
    // Whose places in the order of sending arrived.
    const std::vector<protocol::EdgeRecord>& sent = model.plain.loaded.object.edges;
    object.edges.clear();
    for (std::size_t k = 0; k < std::min(sent.size(), variant.object.edges.size()); ++k) {
        if (std::binary_search(plain.edges.begin(), plain.edges.end(), sent[k])) {
            object.edges.push_back(variant.object.edges[k]);
        }
    }
    std::sort(object.edges.begin(), object.edges.end());
    return object;
}

void run_ellicast(const VariantObject& variant, Work& work) {
    ComparisonRow& row = work.row;
    row.stream_bytes = variant.stream_bytes;
    row.bytes = scaled(row.bytes, variant.stream_bytes, work.model.stream_bytes);
    const receiver::ReceivedObject object = received_as(variant, work.model, work.reception.object);
    receiver::ReconstructionOptions how;
    how.threads = 1;
    variant.variant.configure(how);
    const double start = thread_seconds();
    const auto result = receiver::reconstruct(object, how);
    row.cpu_seconds = thread_seconds() - start;
    row.left_over = result ? result->not_inserted.size() : object.vertices.size();
    if (result) judge(result->mesh, work.model.plain, work.options, row);
}

void run_floor(Work& work) {
    work.row.ellipsoids = 0;  // it has no use for them
    const std::vector<bool> kept = kept_vertices(work.model, work.reception.object);
    const double start = thread_seconds();
    const Collapsed floor = collapse_lost(work.model.plain.original, kept);
    work.row.cpu_seconds = thread_seconds() - start;
    work.row.left_over = floor.remaining;
    judge(floor.mesh, work.model.plain, work.options, work.row);
}

#ifdef ELLICAST_WITH_CGAL
void run_advancing_front(Work& work) {
    work.row.ellipsoids = 0;
    const double start = thread_seconds();
    TriangleMesh mesh = advancing_front(received_positions(work.reception.object));
    work.row.cpu_seconds = thread_seconds() - start;
    // Which way it faces is left to chance; that is not held against it.
    if (common::signed_volume(mesh) < 0) {
        for (common::Triangle& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
    }
    work.row.left_over = mesh.positions.size() - common::analyse_topology(mesh).vertices;
    judge(mesh, work.model.plain, work.options, work.row);
}
#endif

#ifdef ELLICAST_WITH_DRACO
// At the bytes of a variant's stream.
void run_draco(std::uint64_t stream_bytes, Work& work) {
    const std::uint64_t bytes = scaled(work.row.bytes, stream_bytes, work.model.stream_bytes);
    const ComparisonRow shared = work.row;
    if (ideal_code_delivers(bytes, work.model.draco_bytes)) work.row = work.model.draco;
    std::tie(work.row.model, work.row.method, work.row.loss, work.row.sent, work.row.seed) =
        std::tie(shared.model, shared.method, shared.loss, shared.sent, shared.seed);
    if (!work.row.has_surface()) work.row.vertices = 0;
    work.row.ellipsoids = 0;
    work.row.bytes = bytes;
    work.row.stream_bytes = stream_bytes;
}
#endif

// As many vertices, the most important first, as came in order before the first gap.
void run_progressive(double bytes_a_vertex, Work& work) {
    const TriangleMesh& original = work.model.plain.original;
    ComparisonRow& row = work.row;
    const std::size_t all = work.model.plain.loaded.object.vertices.size();
    row.bytes = work.reception.bytes_in_order;
    row.ellipsoids = 0;
    const auto fit = static_cast<std::size_t>(static_cast<double>(row.bytes) / bytes_a_vertex);
    row.vertices = std::min(fit, all);
    if (row.vertices < 4) return;
    const double start = thread_seconds();
    const TriangleMesh mesh =
        row.vertices == all ? original : decimate(original, row.vertices).mesh;
    row.cpu_seconds = thread_seconds() - start;
    judge(mesh, work.model.plain, work.options, row);
}

void run_method(std::string_view name, Work& work) {
    if (const VariantObject* variant = find_variant(work.model, name)) {
        return run_ellicast(*variant, work);
    }
    if (name == "floor") return run_floor(work);
#ifdef ELLICAST_WITH_CGAL
    if (name == "advancing-front") return run_advancing_front(work);
#endif
#ifdef ELLICAST_WITH_DRACO
    if (name == "draco-mds") return run_draco(work.model.stream_bytes, work);
    if (name.starts_with("draco-mds-as-")) {
        name.remove_prefix(std::string_view("draco-mds-as-").size());
        if (const VariantObject* variant = find_variant(work.model, name)) {
            return run_draco(variant->stream_bytes, work);
        }
    }
#endif
    if (name == "progressive") return run_progressive(kProgressiveBytes, work);
    if (name == "progressive-packed") return run_progressive(kPackedProgressiveBytes, work);
    throw std::invalid_argument("no method is called " + std::string(name));
}

// Where a variant's records are not the plain ones, nothing could be compared.
void check_same_records(const sender::BroadcastObject& a, const sender::BroadcastObject& b) {
    bool same = a.ellipsoids == b.ellipsoids && a.vertices.size() == b.vertices.size();
    for (std::size_t v = 0; same && v < a.vertices.size(); ++v) {
        same = a.vertices[v].position == b.vertices[v].position;
    }
    if (!same) throw std::runtime_error("a variant's records are not those of the plain object");
}

}  // namespace

const std::vector<Variant>& variants() {
    const auto as_it_comes = [](receiver::ReconstructionOptions&) {};
    const auto without_concealment = [](receiver::ReconstructionOptions& options) {
        options.conceal = false;
    };
    static const std::vector<Variant> all{
        {"ellicast", kPlain, as_it_comes},
        {"ellicast-unconcealed", kPlain, without_concealment},
        {"ellicast-tags", {.normal_bits = 8, .ring = false, .colour = false}, as_it_comes},
        {"ellicast-ring", {.normal_bits = 8, .ring = true, .colour = false}, as_it_comes},
    };
    return all;
}

std::vector<std::string> all_methods() {
    std::vector<std::string> methods;
    for (const Variant& variant : variants()) methods.emplace_back(variant.name);
    methods.emplace_back("floor");
#ifdef ELLICAST_WITH_CGAL
    methods.emplace_back("advancing-front");
#endif
#ifdef ELLICAST_WITH_DRACO
    methods.emplace_back("draco-mds");
    std::vector<sender::TagOptions> seen{kPlain};
    for (const Variant& variant : variants()) {
        const auto same = [&](const auto& tags) { return same_tags(tags, variant.tags); };
        if (std::any_of(seen.begin(), seen.end(), same)) continue;
        seen.push_back(variant.tags);
        methods.push_back("draco-mds-as-" + std::string(variant.name));
    }
#endif
    methods.emplace_back("progressive");
    methods.emplace_back("progressive-packed");
    return methods;
}

ComparedModel load_compared(const std::filesystem::path& path, const ComparisonOptions& options) {
    ComparedModel model;
    model.name = path.stem().string();
    const TemporaryDirectory cache;  // one decomposition for all of them
    const auto load = [&](const sender::TagOptions& tags) {
        return sender::load_model(path, options.decomposition, cache.path(), tags);
    };
    model.plain = {common::read_model(path), load(kPlain)};
    model.stream = broadcast(model.plain.loaded.object);
    model.stream_bytes = bytes_of(model.stream);
    model.record_of = records_of_original(model.plain);
    for (const Variant& variant : variants()) {
        VariantObject& made = model.variants.emplace_back();
        made.variant = variant;
        made.object =
            same_tags(variant.tags, kPlain) ? model.plain.loaded.object : load(variant.tags).object;
        check_same_records(made.object, model.plain.loaded.object);
        made.stream_bytes = bytes_of(broadcast(made.object));
    }
#ifdef ELLICAST_WITH_DRACO
    const std::vector<char> packed = draco_encode(model.plain.original);
    model.draco_bytes = packed.size();
    const double start = thread_seconds();
    const TriangleMesh mesh = draco_decode(packed);
    model.draco.cpu_seconds = thread_seconds() - start;
    model.draco.vertices = mesh.positions.size();
    judge(mesh, model.plain, options, model.draco);
#endif
    return model;
}

CellReception receive_cell(const ComparedModel& model, const Cell& cell, double burst) {
    common::LossProcess process = common::BernoulliLoss{cell.loss};
    if (burst > 0) process = bursty_loss(cell.loss, burst);
    common::LossSequence lost(process, common::stream_seed(cell.seed, common::LossStream::drop));
    const auto sent = static_cast<std::size_t>(
        std::llround(cell.sent * static_cast<double>(model.stream.size())));
    CellReception reception;
    std::vector<TimedDatagram> arrived;
    bool in_order = true;
    for (std::size_t k = 0; k < sent; ++k) {
        if (lost.next_is_lost()) {
            in_order = false;
            continue;
        }
        arrived.push_back(model.stream[k]);
        reception.bytes += arrived.back().bytes.size();
        if (in_order) reception.bytes_in_order = reception.bytes;
    }
    reception.datagrams = arrived.size();
    if (auto received = receive(arrived).object) reception.object = std::move(*received);
    return reception;
}

std::vector<std::uint32_t> records_of_original(const SimulatedModel& model) {
    std::map<std::array<float, 3>, std::uint32_t> record_at;
    const auto& vertices = model.loaded.object.vertices;
    for (std::uint32_t r = 0; r < vertices.size(); ++r) record_at[vertices[r].position] = r;
    const Eigen::Vector3d origin(model.loaded.object.description.origin.data());
    std::vector<std::uint32_t> record_of;
    record_of.reserve(model.original.positions.size());
    for (const Eigen::Vector3d& p : model.original.positions) {
        const Eigen::Vector3f q = (p - origin).cast<float>();
        const auto it = record_at.find({q.x(), q.y(), q.z()});
        record_of.push_back(it == record_at.end() ? ComparedModel::kNoRecord : it->second);
    }
    return record_of;
}

std::vector<bool> kept_vertices(const ComparedModel& model,
                                const receiver::ReceivedObject& object) {
    std::vector<bool> received(model.plain.loaded.object.vertices.size(), false);
    for (const std::uint32_t record : object.vertex_index) received[record] = true;
    std::vector<bool> kept;
    kept.reserve(model.record_of.size());
    for (const std::uint32_t record : model.record_of) {
        kept.push_back(record != ComparedModel::kNoRecord && received[record]);
    }
    return kept;
}

void judge(const TriangleMesh& mesh, const SimulatedModel& model, const ComparisonOptions& options,
           ComparisonRow& row) {
    const common::MeshTopology topology = common::analyse_topology(mesh);
    row.components = topology.components;
    row.genus = topology.components > 0 ? topology.genus() : 0;
    row.closed = topology.closed;
    row.manifold = topology.manifold;
    row.topology_right = is_as_hinted(topology, model.loaded.object.hint);
    if (mesh.triangles.empty()) return;
    const common::MeshDistance d =
        common::measure_distance(mesh, model.original, {.samples = options.samples, .threads = 1});
    row.rms = d.rms();
    row.rms_to = d.rms_to_reference;
    row.rms_from = d.rms_from_reference;
    row.mean = d.mean();
    row.max = d.max;
    row.normal_deg = d.normal_deg;
    if (options.intersections) {
        row.self_intersecting_faces =
            static_cast<double>(common::count_self_intersections(mesh, 1).faces);
    }
}

ComparisonRow run_variant(const ComparedModel& model, const VariantObject& variant,
                          const CellReception& reception, const ComparisonOptions& options) {
    Work work{model, reception, options, {}};
    run_ellicast(variant, work);
    return work.row;
}

std::vector<ComparisonRow> run_cell(const ComparedModel& model, const Cell& cell,
                                    const ComparisonOptions& options) {
    const CellReception reception = receive_cell(model, cell, options.burst);
    std::vector<ComparisonRow> rows;
    for (const std::string& method : options.methods) {
        ComparisonRow row;
        row.model = model.name;
        row.method = method;
        row.loss = cell.loss;
        row.sent = cell.sent;
        row.seed = cell.seed;
        row.vertices = reception.object.vertices.size();
        row.ellipsoids = reception.object.ellipsoids.size();
        row.bytes = reception.bytes;
        row.stream_bytes = model.stream_bytes;
        Work work{model, reception, options, std::move(row)};
        run_method(method, work);
        rows.push_back(std::move(work.row));
    }
    return rows;
}

double thread_seconds() {
    std::timespec time{};
    ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

}  // namespace ellicast::tests
