// sender/certified_loading.hpp
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "sender/model_loading.hpp"
#include "sender/round_plan.hpp"
#include "sender/topology_certificate.hpp"

namespace ellicast::sender {

struct CertificationOptions {
    TrialOptions trial;
    PlanOptions plan;                            // as it is asked for; the session plays no part
    std::size_t ellipsoids = 0;                  // to begin with
    std::optional<std::filesystem::path> cache;  // directory
};

/// A model with as many ellipsoids and, in LoadedModel::certificate, as many copies as its goal
/// needs (certify()); the certificate's text is in the object's description. `load(n)` loads it
/// with n ellipsoids. What was found is kept in the cache and taken from it; a cache that cannot be
/// used is no error. A model whose topology is promised only approximately gets a warning instead
/// of a certificate. Throws what `load` throws.
LoadedModel load_certified(const std::function<LoadedModel(std::size_t)>& load,
                           const CertificationOptions& options);

/// Key of a cached certificate: 32 hex digits of BLAKE2b over goal, seed, grid and every byte of
/// round 0 of the plan that the search begins with, which depends on all that the result depends
/// on.
std::string certificate_key(const BroadcastObject& object, const PlanOptions& plan,
                            const TrialOptions& trial);

/// Five lines of text, written atomically; reading gives nothing when the file is missing, damaged
/// or of another key or goal. Writing throws common::WriteFailure.
void write_certificate(const std::filesystem::path& path, const std::string& key,
                       const Certificate& certificate);
std::optional<Certificate> read_certificate(const std::filesystem::path& path,
                                            const std::string& key, const CertificateGoal& goal);

}  // namespace ellicast::sender
