// sender/model_loading.hpp
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "sender/broadcast_object.hpp"
#include "sender/decomposition.hpp"
#include "sender/model_preparation.hpp"
#include "sender/stage_time.hpp"
#include "sender/topology_certificate.hpp"

namespace ellicast::sender {

/// A model ready for sending, and the story of how it came to be.
struct LoadedModel {
    std::filesystem::path path;
    BroadcastObject object;  // empty when the model was only decomposed
    ShapePromise promise;
    Decomposition decomposition;             // without the ellipsoids: those are in the object
    bool cached = false;                     // the decomposition was found, not computed
    std::optional<Certificate> certificate;  // when one was asked for and the topology is promised
    /// read, prepare, cache, decompose, promise, records, object. The vertices' records are made
    /// from the end of prepare on, beside what comes next: "records" is what was left to wait for.
    std::vector<StageTime> stages;
    std::vector<std::string> warnings;  // of preparation, cache and promise
};

/// Reads a model file, prepares and decomposes it, and makes its object, which is named after the
/// file's stem and has the seed of the decomposition. The cache's directory is made when missing;
/// when it cannot be used, that is a warning. Throws common::ModelError, one line that names the
/// path and the reason.
LoadedModel load_model(const std::filesystem::path& path, const DecompositionOptions& options,
                       const std::optional<std::filesystem::path>& cache,
                       const TagOptions& tags = {}, SendingOrder order = SendingOrder::importance);

/// The same up to the decomposition, which is written to `output`. Throws common::ModelError.
LoadedModel decompose_to_file(const std::filesystem::path& path,
                              const DecompositionOptions& options,
                              const std::optional<std::filesystem::path>& cache,
                              const std::filesystem::path& output);

}  // namespace ellicast::sender
