// tests/support/made_models.hpp: models on which nothing was tuned, made by formula.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/triangle_mesh.hpp"

namespace ellicast::tests {

/// All are closed, outward and manifold; 8 to 51 thousand vertices.

/// A turned machine part with sharp creases: hexagonal head, flange, filleted neck, stepped shaft
/// with chamfers and a stepped bore through it. Triangles are longer along than around, as CAD
/// programs make them. Genus 1.
common::TriangleMesh turned_part();

/// A trefoil knot of changing thickness with grooves wound around it. Genus 1.
common::TriangleMesh knot();

/// A sphere displaced by six octaves of ridges. Genus 0.
common::TriangleMesh boulder();

/// Two rings of rope side by side, joined where they meet; by marching cubes. Genus 2.
common::TriangleMesh rope_rings();

/// Names that made_model knows.
std::vector<std::string> made_model_names();
/// Throws std::invalid_argument for an unknown name.
common::TriangleMesh made_model(std::string_view name);

}  // namespace ellicast::tests
