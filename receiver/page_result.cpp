#include "receiver/page_result.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "common/model_io.hpp"
#include "receiver/output_files.hpp"

namespace ellicast::receiver {

PageResult result_of(const PageTask& task, const ReceivedObject& object) {
    PageResult result;
    result.name = task.name;
    result.version = task.version;
    result.object = object.id;
    result.ellipsoids = object.ellipsoids.size();
    result.vertices = object.vertices.size();
    result.conflicting = task.conflicting;
    result.hint = object.hint;
    result.complete = is_complete(object);
    result.id_verified = result.complete && id_matches(object);
    return result;
}

PageResult result_of(const PageTask& task, const ReceivedObject& object,
                     const Reconstruction& reconstruction) {
    PageResult result = result_of(task, object);
    result.has_mesh = true;
    result.output = task.output;
    result.topology = reconstruction.topology;
    result.topology_as_promised = reconstruction.topology_as_promised;
    result.judged = reconstruction.judged;
    return result;
}

PageResult make_page(const PageTask& task, const ReceivedObject& object,
                     const ReconstructionOptions& options) {
    const std::optional<Reconstruction> reconstruction = reconstruct(object, options);
    if (!reconstruction) return result_of(task, object);
    PageResult result = result_of(task, object, *reconstruction);
    try {
        write_mesh(task.output, *reconstruction, object);
    } catch (const common::ModelError& error) {
        result.error = error.what();
    }
    return result;
}

nlohmann::ordered_json page_json(const PageResult& result) {
    nlohmann::ordered_json json;
    json["name"] = result.name;
    json["object_id"] = id_text(result.object);
    json["version"] = result.version;
    json["output"] = nullptr;
    if (result.has_mesh && result.error.empty()) json["output"] = result.output.string();
    json["complete"] = result.complete;
    json["id_verified"] = result.id_verified;
    json["ellipsoids"] = {{"received", result.ellipsoids}, {"expected", result.hint.ellipsoids}};
    json["vertices"] = {{"received", result.vertices}, {"expected", result.hint.vertices}};
    json["mesh"] = nullptr;
    if (!result.has_mesh) return json;
    const common::MeshTopology& topology = result.topology;
    json["mesh"] = {{"vertices", topology.vertices},
                    {"faces", topology.faces},
                    {"components", topology.components},
                    {"genus", topology.genus()},
                    {"closed", topology.closed},
                    {"manifold", topology.manifold},
                    {"topology_as_promised", result.topology_as_promised},
                    {"judged", result.judged}};
    return json;
}

std::string page_text(const PageResult& result) {
    const std::string got =
        fmt::format("{}: {} of {} ellipsoids, {} of {} vertices", result.name, result.ellipsoids,
                    result.hint.ellipsoids, result.vertices, result.hint.vertices);
    if (!result.has_mesh) return got + "; no surface\n";
    if (!result.error.empty()) return got + "; " + result.error + "\n";
    const char* const verdict = !result.judged                ? "topology not judged"
                                : result.topology_as_promised ? "topology as promised"
                                                              : "topology NOT as promised";
    return fmt::format("{}; {}: genus {}, {}\n", got, result.output.string(),
                       result.topology.genus(), verdict);
}

}  // namespace ellicast::receiver
