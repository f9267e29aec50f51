// tests/support/meshes.hpp: closed-form shapes and the zoo of nasty meshes.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "common/triangle_mesh.hpp"

namespace ellicast::tests {

/// Closed, outward oriented shapes.
common::TriangleMesh cube(double side = 1.0);  // 8 vertices, centred at the origin
common::TriangleMesh icosphere(int subdivisions, double r = 1.0);  // 10 * 4^s + 2 vertices
common::TriangleMesh torus(double R, double r, int nu, int nv);    // genus 1, axis z
common::TriangleMesh double_torus(int resolution);                 // genus 2
common::TriangleMesh box(const Eigen::Vector3d& size, int n);      // faces split n x n

/// The zoo.
common::TriangleMesh open_hemisphere(int subdivisions);
common::TriangleMesh moebius_strip(int n);
common::TriangleMesh two_parts();                 // two disjoint spheres
common::TriangleMesh overlapping_parts();         // two spheres that intersect
common::TriangleMesh nested_shells();             // a sphere with a spherical cavity
common::TriangleMesh edge_shared_by_four();       // two cubes that share an edge
common::TriangleMesh edge_touching_itself();      // two 2 x 2 x 1 plates on two diagonal pillars
common::TriangleMesh vertex_shared_by_two();      // two cubes that share a corner
common::TriangleMesh with_degenerates();          // a cube with zero-area and duplicate triangles
common::TriangleMesh inconsistent_orientation();  // a sphere with every second triangle flipped

/// A concatenation; indices are shifted.
common::TriangleMesh join(const common::TriangleMesh& a, const common::TriangleMesh& b);
common::TriangleMesh translated(common::TriangleMesh mesh, const Eigen::Vector3d& by);

/// The folder of reference models: $ELLICAST_MODELS, else ../shared/models beside the source tree.
/// Empty when it is not there; callers then skip with a line that says so.
std::optional<std::filesystem::path> models_dir();

}  // namespace ellicast::tests
