#include "sender/status.hpp"

#include <chrono>
#include <nlohmann/json.hpp>

#include "sender/report.hpp"

namespace ellicast::sender {
namespace {

using nlohmann::ordered_json;

ordered_json page_json(const Session& session, std::size_t page) {
    const BroadcastObject& object = session.plans()[page].object();
    return {{"page", page},
            {"name", object.description.name},
            {"object_id", id_text(object.id)},
            {"version", session.versions()[page]}};
}

}  // namespace

std::string status_json(const StatusFacts& facts, const Session& session,
                        const EndpointCounts& counts) {
    ordered_json json;
    json["program"] = "ellicast-send";
    json["version"] = ELLICAST_VERSION;
    json["state"] = facts.state;
    json["to"] = facts.peer;
    json["seconds"] = std::chrono::duration<double>(facts.running).count();
    json["round"] = session.round();
    json["rounds"] = session.plans().front().rounds();
    json["page"] = page_json(session, session.page());
    json["page"]["ordinal"] = session.ordinal();
    json["page"]["datagrams"] = session.plans()[session.page()].datagrams();
    json["pages"] = ordered_json::array();
    for (std::size_t page = 0; page < session.plans().size(); ++page) {
        const RoundPlan& plan = session.plans()[page];
        ordered_json line = page_json(session, page);
        line["vertices"] = plan.object().vertices.size();
        line["ellipsoids"] = plan.object().ellipsoids.size();
        line["datagrams"] = plan.datagrams();
        json["pages"].push_back(line);
    }
    json["rate"] = {{"asked", facts.asked_rate}, {"recent", facts.recent_rate}};
    json["datagrams"] = datagrams_json(session.counts(), counts);
    return json.dump(2, ' ', false, ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace ellicast::sender
