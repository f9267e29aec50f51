// tests/tools/make_model.cpp: writes a made model, for where no scan can be had.
#include <cstdio>
#include <exception>
#include <string>

#include "common/model_io.hpp"
#include "tests/support/made_models.hpp"

int main(int argc, char** argv) {
    if (argc < 2 || argc > 3) {
        std::fprintf(stderr, "usage: make_model FILE.ply [NAME]\nnames:");
        for (const std::string& name : ellicast::tests::made_model_names()) {
            std::fprintf(stderr, " %s", name.c_str());
        }
        std::fprintf(stderr, "; rope-rings without\n");
        return 2;
    }
    try {
        const std::string name = argc == 3 ? argv[2] : "rope-rings";
        ellicast::common::write_ply(argv[1], ellicast::tests::made_model(name));
    } catch (const std::exception& error) {
        std::fprintf(stderr, "make_model: %s\n", error.what());
        return 2;
    }
    return 0;
}
