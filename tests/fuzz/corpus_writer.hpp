// tests/fuzz/corpus_writer.hpp: what the programs that make corpora have in common.
#pragma once

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace ellicast::tests {

/// A file of a corpus: its name, its bytes.
struct Seed {
    const char* name;
    std::vector<std::uint8_t> bytes;
};

/// The rest of `main`: writes the seeds into the one folder that the command line names. Returns
/// the exit code.
inline int write_corpus(int argc, char** argv, const std::vector<Seed>& seeds) {
    const std::string program = std::filesystem::path(argv[0]).filename().string();
    if (argc != 2) {
        std::fprintf(stderr, "usage: %s FOLDER\n", program.c_str());
        return 2;
    }
    for (const Seed& seed : seeds) {
        std::ofstream file(std::filesystem::path(argv[1]) / seed.name, std::ios::binary);
        file << std::string(seed.bytes.begin(), seed.bytes.end());
        if (file.flush()) continue;
        std::fprintf(stderr, "%s: cannot write to %s\n", program.c_str(), argv[1]);
        return 2;
    }
    return 0;
}

}  // namespace ellicast::tests
