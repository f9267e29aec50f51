// sender/report.hpp
#pragma once

#include <cstddef>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "sender/model_loading.hpp"
#include "sender/options.hpp"
#include "sender/session.hpp"
#include "sender/stream_security.hpp"
#include "sender/udp_endpoint.hpp"

namespace ellicast::sender {

/// What the sending came to.
struct SendOutcome {
    std::string peer;
    SessionCounts session;
    EndpointCounts endpoint;
    std::size_t ip_udp_bytes = 28;
    std::vector<std::uint32_t> versions;  // of the pages
    double seconds = 0;                   // from the first datagram to the last
    bool interrupted = false;             // before the last round was over
    std::optional<double> rate_not_kept;  // bits per second that were, when that ended it
    SecuritySummary security;
};

/// Bits per second from the first datagram to the last, headers below the payload included; 0 when
/// fewer than two were sent.
double achieved_rate(const SendOutcome& outcome);

/// The JSON of --report:
///   program, version
///   models[]: one object each
///     model          path as given
///     name           as broadcast
///     version        of the page: 1, and one more for every change while it was sent
///     object_id      16 hex digits; this and the next nine keys are absent after --decompose-only
///     vertices, ellipsoids   distinct records
///     record_format  {normal_bits, ring, colour}: what a vertex holds beside its position
///     order          of the vertices: importance or spread
///     copies         of every ellipsoid in a round
///     redundancy     as asked: bytes of a round, in rounds that hold each vertex once
///     datagrams      in a round
///     origin         [x, y, z] subtracted before the wire
///     topology       {components, euler_all, euler_largest, approximate, reason}
///     decomposition  {seeds, candidates, covered, outside, cached}; shares of the solid's voxels
///     seconds        {stage: {wall, cpu}} for read, prepare, cache, decompose, promise, object
///     warnings       [text]
///   sending          absent after --decompose-only
///     to             address and port
///     rounds         whole ones sent
///     interrupted    true when a signal, or a rate that was not kept, ended it
///     seconds        wall clock
///     security       {sealed, signed, public_key, signing_rate}: public_key null when not signed;
///                     signing_rate: bits per second that one core signs, where it was measured
///     rate           {asked, achieved}: bits per second, IP and UDP headers included; asked 0:
///     unpaced datagrams      {offered, sent, dropped_by_simulation, duplicated_by_simulation,
///     refused,
///                     unreachable, socket_full, bytes}; see SessionCounts and EndpointCounts.
///                     bytes are UDP payload of those sent. offered + duplicated = sent + dropped +
///                     refused, unless interrupted.
/// Plans are those of the models, in order, or none.
std::string report_json(const Options& options, const std::vector<LoadedModel>& models,
                        const std::vector<RoundPlan>& plans,
                        const std::optional<SendOutcome>& outcome);

/// 16 hex digits.
std::string id_text(const protocol::ObjectId& id);

/// The part `datagrams` of the report and of the status.
nlohmann::ordered_json datagrams_json(const SessionCounts& session, const EndpointCounts& endpoint);

/// Throws common::ModelError when it cannot be written.
void write_report(const std::filesystem::path& path, const std::string& json);

/// Throws common::ModelError when a file obviously cannot be made there (no such directory, a
/// directory in its place), so that one learns it before the work and not after.
void check_writable(const std::filesystem::path& path);

}  // namespace ellicast::sender
