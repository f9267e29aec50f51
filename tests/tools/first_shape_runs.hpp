// tests/tools/first_shape_runs.hpp: transmissions between network namespaces, and what was there
// when.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "common/triangle_mesh.hpp"

namespace ellicast::tests {

/// A mesh that a receiver had, from this moment on.
struct ShapePoint {
    double seconds = 0;  // since its first datagram
    double rms = 0;      // share of the original's diagonal; NaN where it was not measured
    bool right = false;  // closed, manifold, and of the promised components and genus
};

/// What one receiver saw of one transmission. No points: nothing, however long it waited.
struct ShapeRun {
    std::string method;  // "ellicast", or a rival's name
    std::string model;
    int loss = 0;  // percent
    std::size_t receivers = 1;
    bool midway = false;  // joined a carousel at a random moment
    int run = 0;
    std::size_t receiver = 0;
    std::vector<ShapePoint> points;
};

/// How many of the vertices a receiver lacked after so many rounds.
struct RoundsRun {
    std::string model;
    int loss = 0;
    int rounds = 1;
    std::size_t datagrams = 0;  // of a round
    double lacking = 0;         // share
};

struct ShapeSettings {
    std::vector<std::filesystem::path> models;
    std::vector<int> losses{0, 10, 30, 50, 70, 90};
    std::vector<std::size_t> receivers{1, 8};
    int runs = 5;
    std::string rate = "10M";
    double bits_per_second = 10e6;  // the same as a number
    std::string update_interval = "0.2";
    std::size_t samples = 20'000;  // for each distance
    std::filesystem::path cache;   // of decompositions
};

/// A model, and the files in which the rival sends it.
struct RivalFile {
    std::string method;
    std::filesystem::path path;
    double rms = 0;  // of what it holds
};
struct ShapeModel {
    std::string name;
    std::filesystem::path path;
    common::TriangleMesh mesh;
    std::vector<RivalFile> rivals;
};

/// Reads it and writes the rival's files to `directory`. Throws common::ModelError.
ShapeModel load_shape_model(const std::filesystem::path& path,
                            const std::filesystem::path& directory);

/// All runs of one model at one loss with so many receivers, ours and then the rivals'. Throws
/// std::runtime_error where a namespace cannot be made, a program fails, or a mesh is not closed.
std::vector<ShapeRun> run_shapes(const ShapeModel& model, const ShapeSettings& settings, int loss,
                                 std::size_t receivers);

/// What eight receivers lack of one round, of two and of three.
std::vector<RoundsRun> run_rounds(const ShapeModel& model, const ShapeSettings& settings, int loss);

}  // namespace ellicast::tests
