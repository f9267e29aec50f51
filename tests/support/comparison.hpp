// tests/support/comparison.hpp: ours and its rivals on the same lost datagrams.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "tests/support/comparison_table.hpp"
#include "tests/support/simulation.hpp"

namespace ellicast::tests {

/// One way of being us. All of them are given the same vertices and ellipsoids, those that the
/// plain stream's loss left, with what the variant's tags would have said of them; what its own
/// stream would have cost stands beside.
struct Variant {
    std::string_view name;
    sender::TagOptions tags;
    void (*configure)(receiver::ReconstructionOptions&);
};
const std::vector<Variant>& variants();

/// Every method that there is: the variants, then "floor", "advancing-front" (with CGAL),
/// "draco-mds" and one for the bytes of each kind of tags (with Draco), "progressive" and
/// "progressive-packed".
std::vector<std::string> all_methods();

struct ComparisonOptions {
    std::vector<std::string> methods = all_methods();  // in this order
    sender::DecompositionOptions decomposition;
    double burst = 0;               // mean length; 0: independent losses
    std::size_t samples = 100'000;  // of a distance, each way
    bool intersections = true;      // count self-intersecting faces
};

/// A variant's records, index by index those of the plain object.
struct VariantObject {
    Variant variant;
    sender::BroadcastObject object;
    std::uint64_t stream_bytes = 0;
};

/// A model with all that does not depend on the loss.
struct ComparedModel {
    std::string name;
    SimulatedModel plain;
    std::vector<TimedDatagram> stream;  // one round of the plain object
    std::uint64_t stream_bytes = 0;
    std::vector<VariantObject> variants;
    std::vector<std::uint32_t> record_of;  // vertex of the original -> record, or kNoRecord
    std::size_t draco_bytes = 0;
    ComparisonRow draco;  // judged when whole
    static constexpr std::uint32_t kNoRecord = 0xffffffffu;
};

/// Throws common::ModelError, or std::runtime_error where a variant's records are not those of the
/// plain object.
ComparedModel load_compared(const std::filesystem::path& path, const ComparisonOptions& options);

/// A loss of datagrams among the first `sent` share of the stream.
struct Cell {
    double loss = 0;
    double sent = 1;
    unsigned seed = 1;
};

/// What arrives of the plain stream.
struct CellReception {
    receiver::ReceivedObject object;
    std::uint64_t bytes = 0;
    std::uint64_t bytes_in_order = 0;  // before the first lost datagram
    std::size_t datagrams = 0;
};
CellReception receive_cell(const ComparedModel& model, const Cell& cell, double burst);

/// The record of each vertex of the original, or kNoRecord.
std::vector<std::uint32_t> records_of_original(const SimulatedModel& model);

/// The original's vertices that were received.
std::vector<bool> kept_vertices(const ComparedModel& model, const receiver::ReceivedObject& object);

/// Fills in what `mesh` is worth beside the original and the promise; nothing for an empty mesh.
void judge(const common::TriangleMesh& mesh, const SimulatedModel& model,
           const ComparisonOptions& options, ComparisonRow& row);

/// A variant on what was received, which is named by the plain object's records.
ComparisonRow run_variant(const ComparedModel& model, const VariantObject& variant,
                          const CellReception& reception, const ComparisonOptions& options);

/// All chosen methods on one cell. One thread; callers run cells side by side.
std::vector<ComparisonRow> run_cell(const ComparedModel& model, const Cell& cell,
                                    const ComparisonOptions& options);

/// CPU seconds of this thread so far.
double thread_seconds();

}  // namespace ellicast::tests
