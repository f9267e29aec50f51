// sender/report.cpp
#include "sender/report.hpp"

#include <nlohmann/json.hpp>
#include <system_error>

#include "common/atomic_file.hpp"
#include "common/hex_text.hpp"
#include "common/model_io.hpp"

namespace ellicast::sender {
namespace {

using nlohmann::ordered_json;

}  // namespace

std::string id_text(const protocol::ObjectId& id) {
    return common::hex_text(id);
}

namespace {

ordered_json object_json(const LoadedModel& model, const RoundPlan& plan) {
    const BroadcastObject& object = plan.object();
    ordered_json json;
    json["name"] = object.description.name;
    json["object_id"] = id_text(object.id);
    json["vertices"] = object.vertices.size();
    json["ellipsoids"] = object.ellipsoids.size();
    json["edges"] = object.edges.size();
    json["record_format"] = {{"normal_bits", object.hint.format.normal_bits},
                             {"ring", object.hint.format.ring},
                             {"colour", object.hint.format.colour}};
    json["order"] = object.order == SendingOrder::spread ? "spread" : "importance";
    json["copies"] = plan.copies();
    json["redundancy"] = plan.redundancy();
    json["datagrams"] = plan.datagrams();
    json["origin"] = object.description.origin;
    json["topology"] = {{"components", model.promise.components},
                        {"euler_all", model.promise.euler_all},
                        {"euler_largest", model.promise.euler_largest},
                        {"approximate", model.promise.approximate},
                        {"reason", model.promise.reason}};
    return json;
}

ordered_json certificate_json(const Certificate& certificate) {
    return {{"loss", certificate.goal.loss}, {"share", certificate.goal.share},
            {"holds", certificate.holds},    {"draws", certificate.draws},
            {"right", certificate.right},    {"share_at_least", certificate.lower_bound},
            {"copies", certificate.copies},  {"ellipsoids", certificate.ellipsoids}};
}

ordered_json model_json(const LoadedModel& model, const RoundPlan* plan) {
    ordered_json json;
    json["model"] = model.path.string();
    if (plan) json.update(object_json(model, *plan));
    json["decomposition"] = {{"seeds", model.decomposition.seeds},
                             {"candidates", model.decomposition.candidates},
                             {"covered", model.decomposition.covered},
                             {"outside", model.decomposition.outside},
                             {"cached", model.cached}};
    if (model.certificate) json["certificate"] = certificate_json(*model.certificate);
    json["seconds"] = ordered_json::object();
    for (const StageTime& stage : model.stages) {
        json["seconds"][stage.stage] = {{"wall", stage.wall_s}, {"cpu", stage.cpu_s}};
    }
    json["warnings"] = model.warnings;
    return json;
}

ordered_json sending_json(const Options& options, const SendOutcome& outcome) {
    const SessionCounts& session = outcome.session;
    const EndpointCounts& endpoint = outcome.endpoint;
    ordered_json json;
    json["to"] = outcome.peer;
    json["rounds"] = session.rounds;
    json["interrupted"] = outcome.interrupted;
    json["seconds"] = outcome.seconds;
    const SecuritySummary& security = outcome.security;
    json["security"] = {{"sealed", security.protection.sealed},
                        {"signed", security.protection.is_signed},
                        {"public_key", nullptr},
                        {"signing_rate", nullptr}};
    if (!security.public_key.empty()) json["security"]["public_key"] = security.public_key;
    if (security.signing_rate) json["security"]["signing_rate"] = *security.signing_rate;
    json["rate"] = {{"asked", options.bits_per_second}, {"achieved", achieved_rate(outcome)}};
    json["datagrams"] = datagrams_json(session, endpoint);
    return json;
}

}  // namespace

nlohmann::ordered_json datagrams_json(const SessionCounts& session,
                                      const EndpointCounts& endpoint) {
    return {{"offered", session.offered},
            {"sent", endpoint.sent},
            {"dropped_by_simulation", session.dropped},
            {"duplicated_by_simulation", session.duplicated},
            {"refused", endpoint.refused},
            {"unreachable", endpoint.unreachable},
            {"socket_full", endpoint.socket_full},
            {"bytes", endpoint.bytes}};
}

double achieved_rate(const SendOutcome& outcome) {
    const EndpointCounts& endpoint = outcome.endpoint;
    if (endpoint.sent < 2 || !(outcome.seconds > 0)) return 0.0;
    const auto count = static_cast<double>(endpoint.sent);
    const double bytes =
        static_cast<double>(endpoint.bytes) + count * static_cast<double>(outcome.ip_udp_bytes);
    // n datagrams have n - 1 distances.
    return 8.0 * bytes * (count - 1.0) / count / outcome.seconds;
}

std::string report_json(const Options& options, const std::vector<LoadedModel>& models,
                        const std::vector<RoundPlan>& plans,
                        const std::optional<SendOutcome>& outcome) {
    ordered_json json;
    json["program"] = "ellicast-send";
    json["version"] = ELLICAST_VERSION;
    json["models"] = ordered_json::array();
    for (std::size_t k = 0; k < models.size(); ++k) {
        json["models"].push_back(model_json(models[k], k < plans.size() ? &plans[k] : nullptr));
        if (outcome && k < outcome->versions.size()) {
            json["models"].back()["version"] = outcome->versions[k];
        }
    }
    if (outcome) json["sending"] = sending_json(options, *outcome);
    // File names need not be UTF-8, JSON must.
    return json.dump(2, ' ', false, ordered_json::error_handler_t::replace) + "\n";
}

void write_report(const std::filesystem::path& path, const std::string& json) {
    try {
        common::write_file_atomically(path, json);
    } catch (const common::WriteFailure& reason) {
        throw common::ModelError(path.string() + ": cannot be written: " + reason.what());
    }
}

void check_writable(const std::filesystem::path& path) {
    namespace fs = std::filesystem;
    std::error_code error;
    const fs::path parent = path.has_parent_path() ? path.parent_path() : fs::path(".");
    if (fs::is_directory(path, error)) {
        throw common::ModelError(path.string() + ": cannot be written: is a directory");
    }
    if (!fs::is_directory(parent, error)) {
        throw common::ModelError(path.string() + ": cannot be written: no such directory");
    }
}

}  // namespace ellicast::sender
