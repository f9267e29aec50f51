#include "receiver/status.hpp"

#include <spdlog/spdlog.h>

#include <chrono>
#include <nlohmann/json.hpp>

#include "common/model_io.hpp"
#include "receiver/output_files.hpp"
#include "receiver/report.hpp"

namespace ellicast::receiver {
namespace {

using Json = nlohmann::ordered_json;

constexpr Time kInterval = std::chrono::seconds(1);

Json page_json(const Page& page, const StatusFacts& facts) {
    const RecordStore::Group& group = page.best();
    Json json = {
        {"name", page.name},
        {"object_id", id_text(group.object)},
        {"version", page.version},
        {"complete", group.complete()},
        {"ellipsoids",
         {{"received", group.ellipsoids.size()}, {"expected", group.hint.ellipsoids}}},
        {"vertices", {{"received", group.vertices.size()}, {"expected", group.hint.vertices}}},
        {"output", nullptr},
        {"valid", nullptr}};
    if (!facts.written) return json;
    const auto written = facts.written->find(page.name);
    if (written != facts.written->end() && written->second.has_mesh) {
        json["output"] = written->second.output.string();
        json["valid"] = written->second.topology.closed && written->second.topology.manifold;
    }
    return json;
}

}  // namespace

Json status_json(const StatusFacts& facts, const Session& session, Time now) {
    ReportContent content;
    content.session = session.summary(now);
    content.kernel_dropped = facts.kernel_dropped;
    content.live = facts.live;
    Json json;
    json["program"] = "ellicast-recv";
    json["version"] = program_version();
    json["state"] = facts.state;
    json["listening"] = facts.listening;
    json["seconds"] = std::chrono::duration<double>(facts.running).count();
    json["rate"] = {{"recent", facts.recent_rate}};
    json["page"] = nullptr;
    json["round"] = nullptr;
    if (const RecordStore::Group* const latest = session.store().latest()) {
        json["page"] = page_name(*latest, session.catalogue());
        json["round"] = latest->progress.round();
    }
    json["pages"] = Json::array();
    for (const Page& page : session.pages()) json["pages"].push_back(page_json(page, facts));
    add_counts(content, json);
    return json;
}

void StatusFile::write(StatusFacts facts, const Session& session, Time now) {
    if (!wanted()) return;
    next_ = now + kInterval;
    rate_.add(now, 8 * session.summary(now).datagrams.bytes);
    facts.recent_rate = rate_.bits_per_second();
    try {
        write_json(*path_, status_json(facts, session, now));
    } catch (const common::ModelError& error) {
        if (!complained_) spdlog::warn("{}", error.what());
        complained_ = true;
    }
}

}  // namespace ellicast::receiver
