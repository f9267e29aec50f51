// tests/support/made_models.cpp
#include "tests/support/made_models.hpp"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <stdexcept>

#include "common/marching_cubes.hpp"
#include "tests/support/meshes.hpp"

namespace ellicast::tests {
namespace {

using common::TriangleMesh;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kTurn = 2 * std::numbers::pi;

// Triangles of a grid that closes on itself both ways; vertex (i, j) has index i * nv + j.
void add_closed_grid(TriangleMesh& mesh, std::size_t nu, std::size_t nv) {
    const auto at = [&](std::size_t i, std::size_t j) {
        return static_cast<std::uint32_t>((i % nu) * nv + j % nv);
    };
    for (std::size_t i = 0; i < nu; ++i) {
        for (std::size_t j = 0; j < nv; ++j) {
            mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
            mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
        }
    }
}

// A point of the turned part's half section: distance from the axis, height, and whether the
// distance is that of a hexagon's corners.
struct SectionPoint {
    Vector2d at;
    bool hexagonal = false;
};

// Appends points from the last one to `to`, no farther apart than `step`; corners are points.
void line_to(std::vector<SectionPoint>& section, const Vector2d& to, double step, bool hexagonal) {
    const SectionPoint from = section.back();
    const int pieces = std::max(1, static_cast<int>(std::ceil((to - from.at).norm() / step)));
    for (int k = 1; k <= pieces; ++k) {
        const double t = static_cast<double>(k) / pieces;
        // A shoulder between hexagon and circle changes over at its far end.
        section.push_back(
            {from.at + t * (to - from.at), k == pieces ? hexagonal : from.hexagonal && hexagonal});
    }
}

void arc_to(std::vector<SectionPoint>& section, const Vector2d& center, double r, double from,
            double to) {
    constexpr int kPieces = 8;
    for (int k = 1; k <= kPieces; ++k) {
        const double a = from + (to - from) * k / kPieces;
        section.push_back({center + r * Vector2d(std::cos(a), std::sin(a)), false});
    }
}

// Counter-clockwise in (distance, height), the bore first, upwards on the outside.
std::vector<SectionPoint> turned_section() {
    constexpr double kAlong = 0.05;  // spacing along the axis
    constexpr double kAcross = 0.035;
    const double quarter = kTurn / 4;
    std::vector<SectionPoint> section{{{0.30, 0.0}, false}};
    line_to(section, {0.86, 0.0}, kAcross, false);   // foot of the head
    line_to(section, {0.90, 0.06}, kAcross, true);   // to the hexagon
    line_to(section, {0.90, 0.46}, kAlong, true);    // the head's flats
    line_to(section, {1.05, 0.46}, kAcross, false);  // under the flange
    line_to(section, {1.05, 0.58}, kAcross, false);  // its rim
    line_to(section, {0.70, 0.58}, kAcross, false);
    arc_to(section, {0.70, 0.70}, 0.12, 3 * quarter, 2 * quarter);  // fillet to the neck
    line_to(section, {0.58, 1.50}, kAlong, false);
    line_to(section, {0.50, 1.50}, kAcross, false);  // a step
    line_to(section, {0.50, 2.20}, kAlong, false);
    line_to(section, {0.44, 2.28}, kAcross, false);  // chamfer
    line_to(section, {0.34, 2.28}, kAcross, false);
    line_to(section, {0.34, 1.80}, kAlong, false);  // counterbore
    line_to(section, {0.18, 1.80}, kAcross, false);
    line_to(section, {0.18, 0.30}, kAlong, false);  // bore
    line_to(section, {0.30, 0.30}, kAcross, false);
    line_to(section, {0.30, 0.0}, kAlong, false);
    section.pop_back();  // the first point again
    return section;
}

// Shares of a hexagon's corner distance at an angle; corners at multiples of a sixth turn.
double hexagon(double angle) {
    const double sixth = kTurn / 6;
    const double off = angle - sixth * std::floor(angle / sixth) - sixth / 2;
    return std::cos(sixth / 2) / std::cos(off);
}

// Sum of octaves of ridges, each turned against the last; between -1 and 1 or so.
double ridges(const Vector3d& p) {
    const Eigen::Matrix3d turn =
        Eigen::AngleAxisd(1.1, Vector3d(1, 2, 3).normalized()).toRotationMatrix();
    Vector3d q = p;
    double sum = 0;
    double size = 0.5;
    for (int octave = 0; octave < 6; ++octave) {
        q = turn * q * 1.9;
        const double wave = std::sin(q.x() + std::sin(q.y())) * std::cos(q.z() - std::cos(q.x()));
        sum += size * (1 - 2 * std::abs(wave));
        size /= 2.1;
    }
    return sum;
}

// Signed length to a torus around the z axis; its tube is wound with ribs, as a rope is.
double rope_ring(const Vector3d& p, double ring, double tube) {
    const double around = std::atan2(p.y(), p.x());
    const double across = std::hypot(p.x(), p.y()) - ring;
    const double twist = std::atan2(p.z(), across);
    const double ribs = 0.035 * std::cos(22 * around + 3 * twist);
    return std::hypot(across, p.z()) - tube - ribs;
}

// Smooth union: the smaller of both, rounded where they are within k of each other.
double blend(double a, double b, double k) {
    const double h = std::max(k - std::abs(a - b), 0.0) / k;
    return std::min(a, b) - 0.25 * k * h * h;
}

double rope_rings_field(const Vector3d& p) {
    const double left = rope_ring(p + Vector3d(0.95, 0, 0), 0.8, 0.26);
    const double right = rope_ring(p - Vector3d(0.95, 0, 0), 0.8, 0.26);
    return blend(left, right, 0.25);
}

}  // namespace

TriangleMesh turned_part() {
    const std::vector<SectionPoint> section = turned_section();
    constexpr std::size_t kAround = 96;  // a multiple of 6, for the hexagon's corners
    TriangleMesh mesh;
    for (std::size_t i = 0; i < kAround; ++i) {
        const double angle = kTurn * static_cast<double>(i) / kAround;
        for (const SectionPoint& point : section) {
            const double r = point.at.x() * (point.hexagonal ? hexagon(angle) : 1.0);
            mesh.positions.emplace_back(r * std::cos(angle), r * std::sin(angle), point.at.y());
        }
    }
    add_closed_grid(mesh, kAround, section.size());
    return mesh;
}

TriangleMesh knot() {
    constexpr std::size_t kAlong = 600;
    constexpr std::size_t kAround = 32;
    const auto curve = [](double t) {
        const double s = 2 + std::cos(3 * t);
        return Vector3d(s * std::cos(2 * t), s * std::sin(2 * t), 1.3 * std::sin(3 * t));
    };
    TriangleMesh mesh;
    for (std::size_t i = 0; i < kAlong; ++i) {
        const double t = kTurn * static_cast<double>(i) / kAlong;
        const Vector3d tangent = (curve(t + 1e-4) - curve(t - 1e-4)).normalized();
        const Vector3d side = tangent.cross(Vector3d::UnitZ()).normalized();
        const Vector3d up = side.cross(tangent);
        const double thickness = 0.42 + 0.08 * std::sin(5 * t);
        for (std::size_t j = 0; j < kAround; ++j) {
            const double v = kTurn * static_cast<double>(j) / kAround;
            const double r = thickness * (1 + 0.09 * std::cos(4 * v + 30 * t));
            mesh.positions.push_back(curve(t) + r * (std::cos(v) * side + std::sin(v) * up));
        }
    }
    add_closed_grid(mesh, kAlong, kAround);
    return mesh;
}

TriangleMesh boulder() {
    TriangleMesh mesh = icosphere(5);
    for (Vector3d& p : mesh.positions) p *= 1 + 0.18 * ridges(p);
    return mesh;
}

TriangleMesh rope_rings() {
    common::GridFrame frame;
    frame.spacing = 0.024;
    frame.origin = Vector3d(-2.4, -1.4, -0.6);
    frame.dims = {201, 118, 51};
    std::vector<float> values;
    values.reserve(frame.size());
    for (int k = 0; k < frame.dims[2]; ++k) {
        for (int j = 0; j < frame.dims[1]; ++j) {
            for (int i = 0; i < frame.dims[0]; ++i) {
                const Vector3d p = frame.origin + frame.spacing * Vector3d(i, j, k);
                values.push_back(static_cast<float>(rope_rings_field(p)));
            }
        }
    }
    return common::marching_cubes(frame, values, 0.0F);
}

namespace {

struct Maker {
    const char* name;
    TriangleMesh (*make)();
};
constexpr std::array kMakers{Maker{"turned-part", turned_part}, Maker{"knot", knot},
                             Maker{"boulder", boulder}, Maker{"rope-rings", rope_rings}};

}  // namespace

std::vector<std::string> made_model_names() {
    std::vector<std::string> names;
    for (const Maker& maker : kMakers) names.emplace_back(maker.name);
    return names;
}

TriangleMesh made_model(std::string_view name) {
    for (const Maker& maker : kMakers) {
        if (name == maker.name) return maker.make();
    }
    throw std::invalid_argument("no made model is called " + std::string(name));
}

}  // namespace ellicast::tests
