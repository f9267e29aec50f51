// tests/tools/surface_view.cpp
#include "tests/tools/surface_view.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

namespace ellicast::tests {
namespace {

using common::Triangle;
using common::TriangleMesh;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3f;
using Eigen::Vector4f;

constexpr float kNothing = -std::numeric_limits<float>::infinity();

/// What the nearest surface is like in a pixel.
struct Fragment {
    float depth = kNothing;              // along the viewer axis, larger is nearer
    Vector3f normal = Vector3f::Zero();  // in camera axes
    std::uint32_t triangle = 0;
    float edge = 0;  // pixels to the triangle's nearest edge
};

struct Buffer {
    int width;
    int height;
    std::vector<Fragment> fragments;

    Buffer(int w, int h)
        : width(w),
          height(h),
          fragments(static_cast<std::size_t>(w) * static_cast<std::size_t>(h)) {}
    [[nodiscard]] std::size_t index(int x, int y) const {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
               static_cast<std::size_t>(x);
    }
    Fragment& at(int x, int y) { return fragments[index(x, y)]; }
    [[nodiscard]] const Fragment& at(int x, int y) const { return fragments[index(x, y)]; }
};

/// Normals weighted by the angle at the corner, so that they do not depend on the triangulation.
std::vector<Vector3d> vertex_normals(const TriangleMesh& mesh) {
    std::vector<Vector3d> normals(mesh.positions.size(), Vector3d::Zero());
    for (const Triangle& t : mesh.triangles) {
        for (std::size_t k = 0; k < 3; ++k) {
            const Vector3d a = mesh.positions[t[(k + 1) % 3]] - mesh.positions[t[k]];
            const Vector3d b = mesh.positions[t[(k + 2) % 3]] - mesh.positions[t[k]];
            const Vector3d n = a.cross(b);
            const double length = n.norm();
            if (length > 0) normals[t[k]] += std::atan2(length, a.dot(b)) / length * n;
        }
    }
    for (Vector3d& n : normals) n.normalize();
    return normals;
}

/// Where a camera puts a point: pixels from the top left, and depth.
Vector3d projected(const Camera& camera, const Buffer& buffer, const Vector3d& p) {
    const Vector3d q = camera.R * p;
    return {0.5 * buffer.width + (q.x() - camera.centre.x()) * camera.pixels_per_unit,
            0.5 * buffer.height - (q.y() - camera.centre.y()) * camera.pixels_per_unit, q.z()};
}

double cross(const Vector2d& a, const Vector2d& b) {
    return a.x() * b.y() - a.y() * b.x();
}

struct Corners {
    std::array<Vector3d, 3> at;      // projected
    std::array<Vector3f, 3> normal;  // in camera axes
};

void draw_triangle(const Corners& corners, std::uint32_t number, Buffer& buffer) {
    const Vector2d a = corners.at[0].head<2>();
    const Vector2d b = corners.at[1].head<2>();
    const Vector2d c = corners.at[2].head<2>();
    const double area = cross(b - a, c - a);
    if (!(std::abs(area) > 1e-12)) return;
    const Vector2d low = a.cwiseMin(b).cwiseMin(c);
    const Vector2d high = a.cwiseMax(b).cwiseMax(c);
    const int x0 = std::max(0, static_cast<int>(std::floor(low.x())));
    const int y0 = std::max(0, static_cast<int>(std::floor(low.y())));
    const int x1 = std::min(buffer.width - 1, static_cast<int>(std::ceil(high.x())));
    const int y1 = std::min(buffer.height - 1, static_cast<int>(std::ceil(high.y())));
    const Vector3d height_of_corner(std::abs(area) / (c - b).norm(),
                                    std::abs(area) / (a - c).norm(),
                                    std::abs(area) / (b - a).norm());
    for (int y = y0; y <= y1; ++y) {
        for (int x = x0; x <= x1; ++x) {
            const Vector2d p(x + 0.5, y + 0.5);
            const Vector3d w(cross(c - b, p - b) / area, cross(a - c, p - c) / area,
                             cross(b - a, p - a) / area);
            if (w.minCoeff() < 0) continue;
            const auto depth = static_cast<float>(
                w[0] * corners.at[0].z() + w[1] * corners.at[1].z() + w[2] * corners.at[2].z());
            Fragment& fragment = buffer.at(x, y);
            if (depth <= fragment.depth) continue;
            const Vector3f weights = w.cast<float>();
            fragment.depth = depth;
            fragment.triangle = number;
            fragment.edge = static_cast<float>(w.cwiseProduct(height_of_corner).minCoeff());
            fragment.normal = weights[0] * corners.normal[0] + weights[1] * corners.normal[1] +
                              weights[2] * corners.normal[2];
        }
    }
}

Buffer rasterise(const TriangleMesh& mesh, const Camera& camera, int width, int height, bool flat) {
    Buffer buffer(width, height);
    const std::vector<Vector3d> normals = flat ? std::vector<Vector3d>{} : vertex_normals(mesh);
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        const Triangle& t = mesh.triangles[i];
        Corners corners;
        for (std::size_t k = 0; k < 3; ++k) {
            corners.at[k] = projected(camera, buffer, mesh.positions[t[k]]);
            if (!flat) corners.normal[k] = (camera.R * normals[t[k]]).cast<float>();
        }
        if (flat) {
            const Vector3d& a = mesh.positions[t[0]];
            const Vector3d n =
                (mesh.positions[t[1]] - a).cross(mesh.positions[t[2]] - a).normalized();
            corners.normal.fill((camera.R * n).cast<float>());
        }
        draw_triangle(corners, static_cast<std::uint32_t>(i), buffer);
    }
    for (Fragment& fragment : buffer.fragments) {
        fragment.normal.normalize();
        if (fragment.normal.z() < 0) fragment.normal = -fragment.normal;  // seen from inside
    }
    return buffer;
}

/// Component of every triangle, numbered by its smallest vertex.
std::vector<std::uint32_t> components(const TriangleMesh& mesh) {
    std::vector<std::uint32_t> root(mesh.positions.size());
    std::iota(root.begin(), root.end(), 0U);
    const auto find = [&](std::uint32_t v) {
        while (root[v] != v) v = root[v] = root[root[v]];
        return v;
    };
    for (const Triangle& t : mesh.triangles) {
        for (std::size_t k = 1; k < 3; ++k) {
            const std::uint32_t a = find(t[0]);
            const std::uint32_t b = find(t[k]);
            root[std::max(a, b)] = std::min(a, b);
        }
    }
    std::vector<std::uint32_t> component;
    component.reserve(mesh.triangles.size());
    for (const Triangle& t : mesh.triangles) component.push_back(find(t[0]));
    return component;
}

/// One of a few muted colours that go together, in linear light.
Vector3f colour_of_part(std::uint32_t part) {
    static const std::array<Vector3f, 7> kColours{
        Vector3f(0.70F, 0.44F, 0.27F), Vector3f(0.26F, 0.42F, 0.50F), Vector3f(0.76F, 0.62F, 0.38F),
        Vector3f(0.42F, 0.52F, 0.38F), Vector3f(0.58F, 0.30F, 0.26F), Vector3f(0.52F, 0.62F, 0.66F),
        Vector3f(0.72F, 0.66F, 0.58F)};
    // Parts are numbered by a vertex, with a stride; the multiplication mixes that (Knuth, 6.4).
    return kColours[(part * 2654435761U >> 16) % kColours.size()];
}

/// Light of a scene whose axes are the camera's.
struct Lights {
    Vector3f key = Vector3f(-0.45F, 0.62F, 0.64F).normalized();
    Vector3f fill = Vector3f(0.80F, 0.10F, 0.55F).normalized();
};

/// 1 in full light, 0 in shadow, softly between: depth seen from the light, averaged over
/// neighbours.
class ShadowMap {
  public:
    ShadowMap(const TriangleMesh& mesh, const Camera& camera, const Vector3f& key)
        : camera_(light_camera(mesh, camera, key)),
          buffer_(rasterise(mesh, camera_, kSize, kSize, true)),
          bias_(0.006F * static_cast<float>(kSize / camera_.pixels_per_unit)) {}

    [[nodiscard]] float light_at(const Vector3d& p) const {
        const Vector3d q = projected(camera_, buffer_, p);
        const int x = static_cast<int>(q.x());
        const int y = static_cast<int>(q.y());
        if (x < kReach || y < kReach || x >= kSize - kReach || y >= kSize - kReach) return 1.0F;
        int lit = 0;
        int seen = 0;
        for (int dy = -kReach; dy <= kReach; ++dy) {
            for (int dx = -kReach; dx <= kReach; ++dx, ++seen) {
                if (buffer_.at(x + dx, y + dy).depth <= static_cast<float>(q.z()) + bias_) ++lit;
            }
        }
        return static_cast<float>(lit) / static_cast<float>(seen);
    }

  private:
    static constexpr int kSize = 700;
    static constexpr int kReach = 4;

    static Camera light_camera(const TriangleMesh& mesh, const Camera& camera,
                               const Vector3f& key) {
        const Vector3d towards = camera.R.transpose() * key.cast<double>();
        const Vector3d up = camera.R.row(1).transpose();
        const Eigen::AlignedBox3d box = common::bounding_box(mesh.positions);
        Camera light;
        light.R = viewing_axes(towards, up);
        light.centre = (light.R * box.center()).head<2>();
        light.pixels_per_unit = (kSize - 4 * kReach) / std::max(box.diagonal().norm(), 1e-300);
        return light;
    }

    Camera camera_;
    Buffer buffer_;
    float bias_;
};

/// Share of the sky that the neighbourhood on the picture hides, 0 to 1. Samples lie on a spiral.
float occlusion(const Buffer& buffer, int x, int y, double pixels_per_unit, double radius) {
    constexpr int kSamples = 40;
    const Fragment& here = buffer.at(x, y);
    float hidden = 0;
    for (int k = 0; k < kSamples; ++k) {
        const double share = std::sqrt((k + 0.5) / kSamples);
        const double angle = 2.39996323 * k;
        const double reach = std::max(share * radius * pixels_per_unit, 1.5);
        const int sx = x + static_cast<int>(std::lround(reach * std::cos(angle)));
        const int sy = y + static_cast<int>(std::lround(reach * std::sin(angle)));
        if (sx < 0 || sy < 0 || sx >= buffer.width || sy >= buffer.height) continue;
        const Fragment& there = buffer.at(sx, sy);
        if (there.depth == kNothing) continue;
        const Vector3f v(static_cast<float>((sx - x) / pixels_per_unit),
                         static_cast<float>((y - sy) / pixels_per_unit), there.depth - here.depth);
        const float distance = v.norm();
        if (distance <= 0) continue;
        const float far = distance / static_cast<float>(radius);
        hidden += std::max(0.0F, here.normal.dot(v) / distance - 0.08F) / (1 + far * far);
    }
    return std::min(1.0F, 2.0F * hidden / kSamples);
}

Vector3f lit(const Vector3f& colour, const Vector3f& n, const Lights& lights, float shadow,
             float open) {
    const Vector3f sky(0.80F, 0.88F, 1.0F);
    const Vector3f ground(0.62F, 0.52F, 0.44F);
    const Vector3f sun(1.0F, 0.95F, 0.86F);
    const float up = 0.5F + 0.5F * n.y();
    const Vector3f ambient = 0.38F * (up * sky + (1 - up) * ground) * open * open;
    const Vector3f key = 0.80F * shadow * std::max(0.0F, n.dot(lights.key)) * sun;
    const Vector3f fill = 0.16F * open * std::max(0.0F, n.dot(lights.fill)) * sky;
    const float rim = 0.10F * open * std::pow(1.0F - n.z(), 3.0F);
    const Vector3f half = (lights.key + Vector3f::UnitZ()).normalized();
    const float gloss = 0.10F * shadow * std::pow(std::max(0.0F, n.dot(half)), 28.0F);
    return colour.cwiseProduct(ambient + key + fill) + Vector3f::Constant(rim + gloss);
}

}  // namespace

Eigen::Matrix3d viewing_axes(const Eigen::Vector3d& from, const Eigen::Vector3d& up) {
    Eigen::Matrix3d R;
    R.row(2) = from.normalized();
    R.row(0) = up.cross(from).normalized();
    R.row(1) = R.row(2).cross(R.row(0));
    return R;
}

Image::Image(int w, int h)
    : width(w),
      height(h),
      pixels(static_cast<std::size_t>(w) * static_cast<std::size_t>(h), Vector4f::Zero()) {}

Vector4f& Image::at(int x, int y) {
    return pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                  static_cast<std::size_t>(x)];
}

const Vector4f& Image::at(int x, int y) const {
    return pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                  static_cast<std::size_t>(x)];
}

Image draw_surface(const common::TriangleMesh& mesh, const Camera& camera, int width, int height,
                   const SurfaceStyle& style) {
    const Vector3f plaster(0.72F, 0.50F, 0.33F);
    const Vector3f ink(0.10F, 0.13F, 0.20F);
    const Lights lights;
    const Buffer buffer = rasterise(mesh, camera, width, height, style.shading == Shading::flat);
    const ShadowMap shadows(mesh, camera, lights.key);
    const std::vector<std::uint32_t> part =
        style.shading == Shading::parts ? components(mesh) : std::vector<std::uint32_t>{};
    Image image(width, height);
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const Fragment& fragment = buffer.at(x, y);
            if (fragment.depth == kNothing) continue;
            const Vector3d q(camera.centre.x() + (x + 0.5 - 0.5 * width) / camera.pixels_per_unit,
                             camera.centre.y() - (y + 0.5 - 0.5 * height) / camera.pixels_per_unit,
                             fragment.depth);
            const float shadow = shadows.light_at(camera.R.transpose() * q);
            const float hidden =
                occlusion(buffer, x, y, camera.pixels_per_unit, style.occlusion_radius);
            const Vector3f own = part.empty() ? plaster : colour_of_part(part[fragment.triangle]);
            Vector3f colour = lit(own, fragment.normal, lights, shadow, 1.0F - hidden);
            if (style.wires) {
                const float line = std::clamp(1.3F - fragment.edge, 0.0F, 1.0F);
                colour += 0.75F * line * (ink - colour);
            }
            image.at(x, y) = Vector4f(colour.x(), colour.y(), colour.z(), 1.0F).cwiseMin(1.0F);
        }
    }
    return image;
}

}  // namespace ellicast::tests
