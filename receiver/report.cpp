// receiver/report.cpp
#include "receiver/report.hpp"

#include <fmt/format.h>

#include <chrono>

#include <algorithm>
#include <iterator>
#include <nlohmann/json.hpp>
#include <numeric>

#include "common/atomic_file.hpp"
#include "common/hex_text.hpp"
#include "common/model_io.hpp"
#include "receiver/output_files.hpp"

namespace ellicast::receiver {
namespace {

using Json = nlohmann::ordered_json;

Json object_json(const ReportContent& content) {
    if (!content.object) return nullptr;
    const ReceivedObject& object = *content.object;
    return {{"id", id_text(object.id)},
            {"name", name_of(object)},
            {"unit", object.description ? object.description->unit : ""},
            {"complete", is_complete(object)},
            {"id_verified", content.id_verified}};
}

Json hint_json(const ReportContent& content) {
    if (!content.object) return nullptr;
    const protocol::Hint& hint = content.object->hint;
    return {{"box_min", hint.box_min},
            {"box_max", hint.box_max},
            {"components", hint.components},
            {"euler_all", hint.euler_all},
            {"euler_largest", hint.euler_largest},
            {"approximate", hint.approximate}};
}

Json record_format_json(const ReportContent& content) {
    if (!content.object) return nullptr;
    const protocol::RecordFormat& format = content.object->hint.format;
    return {{"normal_bits", format.normal_bits}, {"ring", format.ring}, {"colour", format.colour}};
}

std::uint64_t lost_in_network(const ReportContent& content) {
    const std::uint64_t lost = content.session.datagrams.lost;
    return lost - std::min(lost, content.kernel_dropped);
}

double share(std::uint64_t part, std::uint64_t whole) {
    return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole) : 0.0;
}

Json datagrams_json(const ReportContent& content) {
    const StreamCounts& counts = content.session.datagrams;
    const LossPattern& pattern = counts.pattern;
    const std::uint64_t sent = counts.received - counts.duplicate + counts.lost;
    Json by_cause = Json::object();
    for (std::size_t k = 0; k < static_cast<std::size_t>(protocol::WireError::kCount); ++k) {
        const auto cause = static_cast<protocol::WireError>(k);
        by_cause[std::string(to_string(cause))] = content.session.malformed.of(cause);
    }
    Json refused_by = Json::object();
    std::uint64_t refused = 0;
    for (std::size_t k = 0; k < content.session.refused.size(); ++k) {
        refused_by[std::string(to_string(static_cast<Refusal>(k)))] = content.session.refused[k];
        refused += content.session.refused[k];
    }
    return {
        {"received", counts.received},
        {"lost", counts.lost},
        {"duplicate", counts.duplicate},
        {"reordered", counts.reordered},
        {"malformed", content.session.malformed.total()},
        {"kernel_dropped", content.kernel_dropped},
        {"bytes", counts.bytes},
        {"lost_in_network", lost_in_network(content)},
        {"jitter_ms", counts.jitter_ms},
        {"loss_rate", share(counts.lost, sent)},
        {"recent", {{"lost", counts.recent_lost}, {"expected", counts.recent_expected}}},
        {"reorder",
         {{"mean", share(counts.reorder_sum, counts.reordered)},
          {"farthest", counts.reorder_farthest}}},
        {"runs",
         {{"count", pattern.runs}, {"mean", pattern.mean_run()}, {"longest", pattern.longest_run}}},
        {"bursts",
         {{"count", pattern.bursts},
          {"loss_density", pattern.burst_density()},
          {"mean_datagrams", pattern.mean_burst()},
          {"mean_ms", pattern.mean_burst() * counts.datagram_ms}}},
        {"gaps",
         {{"count", pattern.gaps},
          {"loss_density", pattern.gap_density()},
          {"mean_datagrams", pattern.mean_gap()},
          {"mean_ms", pattern.mean_gap() * counts.datagram_ms}}},
        {"malformed_by", by_cause},
        {"refused", refused},
        {"refused_by", refused_by},
        {"unverified_dropped", content.session.unverified_dropped}};
}

Json authenticity_json(const ReportContent& content) {
    if (!content.object) return nullptr;
    const Authenticity& authenticity = content.session.authenticity;
    Json json = {{"signed", authenticity.is_signed},
                 {"sealed", authenticity.sealed},
                 {"verified_by", nullptr}};
    if (authenticity.verified()) json["verified_by"] = common::hex_text(authenticity.key);
    return json;
}

std::size_t vertices_in_mesh(const ReportContent& content) {
    if (!content.reconstruction) return 0;
    const auto& index = content.reconstruction->vertex_index;
    return index.size() -
           static_cast<std::size_t>(std::count(index.begin(), index.end(), kNotReceived));
}

void add_records(const ReportContent& content, Json& report) {
    const ReceivedObject* const object = content.object;
    report["ellipsoids"] = {{"received", object ? object->ellipsoids.size() : 0},
                            {"expected", object ? object->hint.ellipsoids : 0}};
    report["vertices"] = {{"received", object ? object->vertices.size() : 0},
                          {"expected", object ? object->hint.vertices : 0},
                          {"in_mesh", vertices_in_mesh(content)}};
    report["edges"] = {{"received", object ? object->edges.size() : 0}};
}

void add_strangers(const ReportContent& content, Json& report) {
    const SessionSummary& session = content.session;
    report["records"] = {{"repeated", session.store.repeated},
                         {"conflicting", session.conflicting},
                         {"refused", session.store.refused}};
    report["others"] = {{"groups", session.other_groups},
                        {"datagrams", session.other_datagrams},
                        {"contradictory_hints", session.contradictory_hints},
                        {"evicted", session.store.evicted},
                        {"over_limit", session.store.over_limit}};
}

Json confidence_json(const Reconstruction& reconstruction) {
    const ConfidenceSummary& summary = reconstruction.summary;
    const auto vertices = [&](Provenance kind) {
        const auto& all = reconstruction.provenance;
        return std::count(all.begin(), all.end(), kind);
    };
    Json json = {{"missing", summary.missing},
                 {"received", vertices(Provenance::received)},
                 {"concealed", vertices(Provenance::concealed)},
                 {"coarse", vertices(Provenance::coarse)},
                 {"largest_gap", nullptr},
                 {"farther", Json::array()},
                 {"octants", Json::array()}};
    if (summary.largest_gap) {
        const Eigen::Vector3d& x = summary.largest_gap->center;
        json["largest_gap"] = {{"center", {x[0], x[1], x[2]}},
                               {"radius", summary.largest_gap->radius}};
    }
    for (const FartherShare& farther : summary.farther) {
        json["farther"].push_back({{"distance", farther.distance}, {"share", farther.share}});
    }
    for (const OctantCount& octant : summary.octants) {
        json["octants"].push_back({{"received", octant.received}, {"expected", octant.expected}});
    }
    return json;
}

void add_mesh(const ReportContent& content, Json& report) {
    if (!content.reconstruction) {
        report["mesh"] = nullptr;
        report["confidence"] = nullptr;
        report["not_inserted"] = Json::array();
        return;
    }
    const Reconstruction& reconstruction = *content.reconstruction;
    const common::MeshTopology& topology = reconstruction.topology;
    report["mesh"] = {{"vertices", topology.vertices},
                      {"faces", topology.faces},
                      {"components", topology.components},
                      {"genus", topology.genus()},
                      {"closed", topology.closed},
                      {"manifold", topology.manifold},
                      {"topology_as_promised", reconstruction.topology_as_promised},
                      {"judged", reconstruction.judged},
                      {"isolevel", reconstruction.isolevel}};
    report["confidence"] = confidence_json(reconstruction);
    if (reconstruction.rings) {
        report["mesh"]["rings"] = {{"agree", reconstruction.rings->agree},
                                   {"disagree", reconstruction.rings->disagree}};
    }
    report["not_inserted"] = reconstruction.not_inserted;
}

Json quality_json(const common::MeshDistance& quality) {
    return {{"rms", quality.rms()},
            {"mean", quality.mean()},
            {"max", quality.max},
            {"rms_to_reference", quality.rms_to_reference},
            {"rms_from_reference", quality.rms_from_reference},
            {"normal_deg", quality.normal_deg}};
}

std::string plural(std::size_t count, const char* one, const char* many) {
    return fmt::format("{} {}", count, count == 1 ? one : many);
}

std::string datagram_line(const ReportContent& content) {
    const StreamCounts& counts = content.session.datagrams;
    const std::uint64_t sent = counts.received - counts.duplicate + counts.lost;
    std::string line =
        fmt::format("{}, {} lost ({:.1f} %)", plural(counts.received, "datagram", "datagrams"),
                    counts.lost, 100.0 * share(counts.lost, sent));
    const auto mention = [&](std::uint64_t count, const char* what) {
        if (count > 0) line += fmt::format(", {} {}", count, what);
    };
    mention(content.kernel_dropped, "dropped by the kernel");
    mention(counts.duplicate, "duplicate");
    mention(counts.reordered, "reordered");
    mention(content.session.malformed.total(), "malformed");
    const RefusalCounts& refused = content.session.refused;
    mention(std::accumulate(refused.begin(), refused.end(), std::uint64_t{0}), "refused");
    mention(content.session.unverified_dropped, "dropped unverified");
    mention(content.session.other_datagrams, "of others");
    return line + "\n";
}

std::string mesh_line(const ReportContent& content) {
    const Reconstruction& reconstruction = *content.reconstruction;
    const common::MeshTopology& topology = reconstruction.topology;
    const char* const verdict = !reconstruction.judged                ? "topology not judged"
                                : reconstruction.topology_as_promised ? "topology as promised"
                                                                      : "topology NOT as promised";
    return fmt::format(
        "{}: {} vertices, {} faces, {}, genus {}, {}, {}\n", content.output, topology.vertices,
        topology.faces, plural(topology.components, "component", "components"), topology.genus(),
        topology.closed && topology.manifold ? "closed manifold" : "NOT a closed manifold",
        verdict);
}

// What is missing, and where; "" when nothing is.
std::string missing_line(const ReportContent& content) {
    const Reconstruction& reconstruction = *content.reconstruction;
    const ConfidenceSummary& summary = reconstruction.summary;
    if (summary.missing == 0) return "";
    std::string line = fmt::format("{} missing", plural(summary.missing, "vertex", "vertices"));
    const auto& kinds = reconstruction.provenance;
    const auto guessed =
        static_cast<std::size_t>(std::count(kinds.begin(), kinds.end(), Provenance::concealed));
    if (guessed > 0) line += fmt::format(", {} guessed", guessed);
    if (summary.largest_gap) {
        const Eigen::Vector3d& x = summary.largest_gap->center;
        line += fmt::format("; largest gap: radius {:.3g} at ({:.4g}, {:.4g}, {:.4g})",
                            summary.largest_gap->radius, x[0], x[1], x[2]);
    }
    const FartherShare& farther = summary.farther[1];
    line += fmt::format("; {:.1f} % of the surface farther than {:.3g} from a received vertex",
                        100.0 * farther.share, farther.distance);
    return line + "\n";
}

Json live_json(const ReportContent& content) {
    if (!content.live) return nullptr;
    const LiveSummary& live = *content.live;
    const auto ms = [](Time time) {
        return std::chrono::duration<double, std::milli>(time).count();
    };
    if (live.updates == 0) return {{"updates", 0}, {"first_shape_ms", nullptr}, {"last", nullptr}};
    return {{"updates", live.updates},
            {"first_shape_ms", ms(live.first_shape)},
            {"last",
             {{"ms", ms(live.last_shape)},
              {"vertices", live.last_vertices},
              {"records", live.last_records}}}};
}

}  // namespace

nlohmann::ordered_json make_report(const ReportContent& content) {
    Json report;
    report["program"] = "ellicast-recv";
    report["version"] = ELLICAST_VERSION;
    report["ends_by"] = std::string(to_string(content.session.ends_by));
    report["output"] = content.output.empty() ? Json(nullptr) : Json(content.output);
    report["object"] = object_json(content);
    report["hint"] = hint_json(content);
    report["record_format"] = record_format_json(content);
    report["datagrams"] = datagrams_json(content);
    report["authenticity"] = authenticity_json(content);
    add_records(content, report);
    add_strangers(content, report);
    report["live"] = live_json(content);
    add_mesh(content, report);
    if (content.quality) report["quality"] = quality_json(*content.quality);
    report["seconds"] = Json::object();
    for (const StageTime& time : content.times) {
        report["seconds"][time.stage] = {{"wall", time.wall_s}, {"cpu", time.cpu_s}};
    }
    report["pages"] = Json::array();
    for (const PageResult& page : content.pages) report["pages"].push_back(page_json(page));
    return report;
}

void add_counts(const ReportContent& content, Json& json) {
    json["datagrams"] = datagrams_json(content);
    add_strangers(content, json);
    json["live"] = live_json(content);
}

std::string program_version() {
    return ELLICAST_VERSION;
}

void write_report(const std::filesystem::path& path, const ReportContent& content) {
    write_json(path, make_report(content));
}

void write_json(const std::filesystem::path& path, const Json& json) {
    // A path need not be UTF-8, and no report is worth failing for that.
    const std::string text = json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
    try {
        common::write_file_atomically(path, text);
    } catch (const common::WriteFailure& failure) {
        throw common::ModelError("cannot write '" + path.string() + "': " + failure.what());
    }
}

std::string summary_text(const ReportContent& content) {
    std::string text = datagram_line(content);
    if (!content.object) return text;
    const ReceivedObject& object = *content.object;
    text = fmt::format("{}: {} of {} ellipsoids, {} of {} vertices\n", name_of(object),
                       object.ellipsoids.size(), object.hint.ellipsoids, object.vertices.size(),
                       object.hint.vertices) +
           text;
    if (content.reconstruction) text += mesh_line(content) + missing_line(content);
    if (content.quality) {
        const common::MeshDistance& q = *content.quality;
        text += fmt::format(
            "distance to the reference, shares of its diagonal: rms {:.2e}, mean {:.2e}, max "
            "{:.2e}; "
            "normals {:.1f} degrees\n",
            q.rms(), q.mean(), q.max, q.normal_deg);
    }
    return text;
}

}  // namespace ellicast::receiver
