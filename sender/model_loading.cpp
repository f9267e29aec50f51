// sender/model_loading.cpp
#include "sender/model_loading.hpp"

#include <future>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "common/model_io.hpp"
#include "common/parallel.hpp"

namespace ellicast::sender {
namespace {

namespace fs = std::filesystem;

/// Geometry says what is wrong with a model; the user wants to know with which.
template <class Work>
auto naming(const fs::path& path, const Work& work) {
    try {
        return work();
    } catch (const std::invalid_argument& error) {
        throw common::ModelError(path.string() + ": " + error.what());
    }
}

/// The directory when it can be used, else a warning.
std::optional<fs::path> usable(const std::optional<fs::path>& cache,
                               std::vector<std::string>& warnings) {
    if (!cache) return std::nullopt;
    std::error_code error;
    fs::create_directories(*cache, error);
    if (!error && fs::is_directory(*cache, error)) return cache;
    warnings.push_back("cache " + cache->string() +
                       " is not used: " + (error ? error.message() : "not a directory"));
    return std::nullopt;
}

PreparedModel prepared(const fs::path& path, LoadedModel& loaded) {
    common::TriangleMesh input =
        timed(loaded.stages, "read", [&] { return common::read_model(path); });
    PreparedModel model = timed(loaded.stages, "prepare", [&] {
        return naming(path, [&] { return prepare_model(std::move(input)); });
    });
    loaded.path = path;
    loaded.warnings = model.warnings;
    return model;
}

struct Decomposed {
    Decomposition decomposition;
    std::string key;
};

/// From the cache, or computed and then cached.
Decomposed decomposed(const common::TriangleMesh& solid, const DecompositionOptions& options,
                      const std::optional<fs::path>& cache, LoadedModel& loaded) {
    Decomposed result;
    result.key = decomposition_key(solid, options);
    const std::optional<fs::path> directory = usable(cache, loaded.warnings);
    const fs::path file = directory.value_or(fs::path()) / (result.key + ".ellipsoids");
    if (directory) {
        std::optional<Decomposition> found =
            timed(loaded.stages, "cache", [&] { return read_decomposition(file, result.key); });
        loaded.cached = found.has_value();
        if (found) result.decomposition = *std::move(found);
    }
    if (!loaded.cached) {
        result.decomposition = timed(loaded.stages, "decompose", [&] {
            return naming(loaded.path, [&] { return decompose(solid, options); });
        });
    }
    if (directory && !loaded.cached) {
        try {
            write_decomposition(file, result.key, result.decomposition);
        } catch (const common::ModelError& error) {
            loaded.warnings.push_back("not cached: " + std::string(error.what()));
        }
    }
    loaded.decomposition = result.decomposition;
    loaded.decomposition.ellipsoids.clear();
    return result;
}

}  // namespace

LoadedModel load_model(const fs::path& path, const DecompositionOptions& options,
                       const std::optional<fs::path>& cache, const TagOptions& tags,
                       SendingOrder order) {
    LoadedModel loaded;
    PreparedModel model = prepared(path, loaded);
    const ObjectOptions object_options{path.stem().string(), options.seed, tags, order,
                                       options.threads};
    // Neither needs the other, and of each a part is for one thread.
    std::future<VertexRecords> records = common::beside(options.threads, [&] {
        return naming(path, [&] { return vertex_records(model, object_options); });
    });
    const Decomposition decomposition =
        decomposed(model.solid, options, cache, loaded).decomposition;
    loaded.promise =
        timed(loaded.stages, "promise", [&] { return promise_topology(model, options.threads); });
    VertexRecords vertices = timed(loaded.stages, "records", [&] { return records.get(); });
    loaded.object = timed(loaded.stages, "object", [&] {
        return naming(path, [&] {
            return make_object(std::move(model), std::move(vertices), loaded.promise, decomposition,
                               object_options);
        });
    });
    if (loaded.promise.approximate) {
        loaded.warnings.push_back("topology promised only approximately: " + loaded.promise.reason);
    }
    return loaded;
}

LoadedModel decompose_to_file(const fs::path& path, const DecompositionOptions& options,
                              const std::optional<fs::path>& cache, const fs::path& output) {
    LoadedModel loaded;
    const PreparedModel model = prepared(path, loaded);
    const Decomposed result = decomposed(model.solid, options, cache, loaded);
    write_decomposition(output, result.key, result.decomposition);
    return loaded;
}

}  // namespace ellicast::sender
