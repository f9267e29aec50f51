// receiver/report.hpp
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/mesh_distance.hpp"
#include "receiver/live_view.hpp"
#include "receiver/page_result.hpp"
#include "receiver/received_object.hpp"
#include "receiver/reconstruction.hpp"
#include "receiver/session.hpp"
#include "receiver/stage_clock.hpp"

namespace ellicast::receiver {

/// All that a run of the receiver has to tell. Pointers may be null: nothing received, nothing
/// rebuilt, nothing compared.
struct ReportContent {
    SessionSummary session;
    std::uint64_t kernel_dropped = 0;
    std::optional<LiveSummary> live;
    const ReceivedObject* object = nullptr;
    const Reconstruction* reconstruction = nullptr;
    const common::MeshDistance* quality = nullptr;
    bool id_verified = false;
    std::string output;  // path of the mesh, "" when none was written
    std::vector<StageTime> times;
    std::vector<PageResult> pages;  // all chosen ones
};

// clang-format off
/// The report, whose keys are:
///   program, version
///   ends_by       complete, stream_end, round, idle, waited or interrupted (EndReason)
///   output        path of the mesh, or null
///   object        {id, name, unit, complete, id_verified}, or null when nothing was received
///                 complete: every record is there; id_verified: and they are those of the id
///   hint          {box_min, box_max, components, euler_all, euler_largest, approximate}, or null
///   record_format {normal_bits, ring, colour}: of vertices beside the position, or null
///   datagrams     {received, lost, duplicate, reordered, bytes}: of the object's streams;
///                   received - duplicate + lost = sent while we listened
///                 {malformed, kernel_dropped}: of all that came
///                 {lost_in_network}: lost, less what the kernel dropped
///                 {jitter_ms}: RFC 3550;  {malformed_by}: {cause: count}, by WireError
///                 {loss_rate}: lost of those sent;  {recent: {lost, expected}}: of the last 1024
///                 {reorder: {mean, farthest}}: datagrams that the reordered came behind
///                 {runs: {count, mean, longest}}: of losses in a row
///                 {bursts, gaps: {count, loss_density, mean_datagrams, mean_ms}}: RFC 3611, Gmin 16
///                 {refused}, {refused_by}: {cause: count}, by Refusal: of right form, but keys or
///                   times do not admit them; {unverified_dropped}: no room to wait in
///   authenticity  {signed, sealed, verified_by} of the object's stream: verified_by is the public
///                   key, null when nobody verified; null when nothing was received
///   ellipsoids    {received, expected}
///   vertices      {received, expected, in_mesh}
///   records       {repeated, conflicting, refused}: records that came again; indices with
///                   contradictory content; records beyond the memory limit
///   others        {groups, datagrams, contradictory_hints, evicted, over_limit}: strangers
///   mesh          {vertices, faces, components, genus, closed, manifold, topology_as_promised,
///                   judged, isolevel}, or null; judged is false for an approximate promise
///                 {rings: {agree, disagree}}: with ring tags, received vertices whose neighbours
///                   are, or are not, those of the original
///   confidence    {missing, received, concealed, coarse, largest_gap, farther, octants}, or null
///                 missing: vertices that did not arrive; received, concealed, coarse: vertices of
///                   the mesh by Provenance; largest_gap: {center, radius}, null when none is
///                   missing; farther: [{distance, share}], of the surface; octants: [{received,
///                   expected}], of the hinted box, x fastest. All in model units, as explained in
///                   receiver/confidence.hpp
///   live          {updates, first_shape_ms, last: {ms, vertices, records}}, or null without live
///                 meshes; times since the first datagram, null before the first mesh
///   not_inserted  indices of received vertices that are no vertex of the mesh
///   quality       {rms, mean, max, rms_to_reference, rms_from_reference, normal_deg}: shares of
///                   the reference's diagonal, degrees; only with a reference and a mesh
///   seconds       {stage: {wall, cpu}}
///   pages         [page_json()] of the chosen pages, the shown one first
// clang-format on
nlohmann::ordered_json make_report(const ReportContent& content);

/// The parts datagrams, records, others and live of it, which hold before the end, too.
void add_counts(const ReportContent& content, nlohmann::ordered_json& json);

/// As `version` in every JSON of ours.
std::string program_version();

/// Atomic. Throws common::ModelError with the path and the reason.
void write_json(const std::filesystem::path& path, const nlohmann::ordered_json& json);
void write_report(const std::filesystem::path& path, const ReportContent& content);

/// The same for people: a few lines, each with its end.
std::string summary_text(const ReportContent& content);

}  // namespace ellicast::receiver
