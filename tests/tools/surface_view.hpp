// tests/tools/surface_view.hpp
#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/triangle_mesh.hpp"

namespace ellicast::tests {

/// Parallel projection. Rows of R: right, up and towards the viewer, in model axes.
struct Camera {
    Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
    Eigen::Vector2d centre =
        Eigen::Vector2d::Zero();  // right and up, shown in the picture's middle
    double pixels_per_unit = 1.0;
};

/// Right, up and viewer axes for looking along -`from` with `up` upwards. Requires them not
/// parallel.
Eigen::Matrix3d viewing_axes(const Eigen::Vector3d& from, const Eigen::Vector3d& up);

enum class Shading { smooth, flat, parts };  // parts: smooth, each component in its own colour

struct SurfaceStyle {
    Shading shading = Shading::smooth;
    bool wires = false;           // edges of triangles drawn over
    double occlusion_radius = 0;  // model units; how far crevices darken
};

/// Linear light, row by row from the top; alpha 0 where nothing is seen.
struct Image {
    int width = 0;
    int height = 0;
    std::vector<Eigen::Vector4f> pixels;

    Image(int w, int h);
    Eigen::Vector4f& at(int x, int y);
    [[nodiscard]] const Eigen::Vector4f& at(int x, int y) const;
};

/// The mesh with a key light that throws shadows, light from the sky, and darkened crevices. No
/// anti-aliasing: draw larger and average. Cost: pixels and triangles. Same input, same picture.
Image draw_surface(const common::TriangleMesh& mesh, const Camera& camera, int width, int height,
                   const SurfaceStyle& style);

}  // namespace ellicast::tests
