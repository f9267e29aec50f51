// tests/tools/make_model.cpp: writes a made model of genus 2, for where no scan can be had.
#include <cmath>
#include <cstdio>
#include <exception>
#include <numbers>
#include <vector>

#include "common/marching_cubes.hpp"
#include "common/model_io.hpp"

using namespace ellicast;
using Eigen::Vector3d;

namespace {

/// Signed length to a torus around the z axis; its tube is wound with ribs, as a rope is.
double rope_ring(const Vector3d& p, double ring, double tube) {
    const double around = std::atan2(p.y(), p.x());
    const double across = std::hypot(p.x(), p.y()) - ring;
    const double twist = std::atan2(p.z(), across);
    const double ribs = 0.035 * std::cos(22 * around + 3 * twist);
    return std::hypot(across, p.z()) - tube - ribs;
}

/// Smooth union: the smaller of both, rounded where they are within k of each other.
double blend(double a, double b, double k) {
    const double h = std::max(k - std::abs(a - b), 0.0) / k;
    return std::min(a, b) - 0.25 * k * h * h;
}

/// Two rings of rope side by side, joined where they meet.
double field(const Vector3d& p) {
    const double left = rope_ring(p + Vector3d(0.95, 0, 0), 0.8, 0.26);
    const double right = rope_ring(p - Vector3d(0.95, 0, 0), 0.8, 0.26);
    return blend(left, right, 0.25);
}

}  // namespace

int main(int argc, char** argv) {
    if (argc != 2) {
        std::fprintf(stderr, "usage: make_model FILE.ply\n");
        return 2;
    }
    common::GridFrame frame;
    frame.spacing = 0.024;
    frame.origin = Vector3d(-2.4, -1.4, -0.6);
    frame.dims = {201, 118, 51};
    std::vector<float> values;
    values.reserve(frame.size());
    for (int k = 0; k < frame.dims[2]; ++k) {
        for (int j = 0; j < frame.dims[1]; ++j) {
            for (int i = 0; i < frame.dims[0]; ++i) {
                values.push_back(
                    static_cast<float>(field(frame.origin + frame.spacing * Vector3d(i, j, k))));
            }
        }
    }
    try {
        common::write_ply(argv[1], common::marching_cubes(frame, values, 0.0F));
    } catch (const std::exception& error) {
        std::fprintf(stderr, "make_model: %s\n", error.what());
        return 2;
    }
    return 0;
}
