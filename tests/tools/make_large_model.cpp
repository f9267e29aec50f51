// tests/tools/make_large_model.cpp: writes a model enlarged to any number of vertices.
#include <cstdint>
#include <cstdio>
#include <exception>
#include <string>

#include "common/model_io.hpp"
#include "tests/support/large_model.hpp"

int main(int argc, char** argv) {
    if (argc != 5) {
        std::fprintf(stderr, "usage: make_large_model MODEL VERTICES SEED OUT.ply\n");
        return 2;
    }
    try {
        const std::uint64_t vertices = std::stoull(argv[2]);
        const std::uint64_t seed = std::stoull(argv[3]);
        ellicast::common::write_ply(
            argv[4],
            ellicast::tests::large_model(ellicast::common::read_model(argv[1]), vertices, seed));
    } catch (const std::exception& error) {
        std::fprintf(stderr, "make_large_model: %s\n", error.what());
        return 2;
    }
    return 0;
}
