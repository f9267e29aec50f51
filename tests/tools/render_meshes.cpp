// tests/tools/render_meshes.cpp: a row of meshes, seen alike, as a PPM picture.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <fstream>
#include <string>
#include <vector>

#include "common/model_io.hpp"
#include "tests/tools/surface_view.hpp"

using namespace ellicast;
using tests::Camera;
using tests::Image;
using tests::Shading;

namespace {

constexpr int kSamples = 2;  // per pixel and axis

struct Options {
    std::vector<std::string> meshes;
    std::string out;
    int size = 400;
    std::array<double, 3> view{0.15, 0.12, 1.0};
    std::array<double, 3> up{0.0, 1.0, 0.0};
    std::vector<double> lens;
};

struct Panel {
    common::TriangleMesh mesh;
    Shading shading = Shading::smooth;
};

// FILE or FILE:parts, FILE:flat, FILE:smooth.
Panel read_panel(const std::string& text) {
    const std::size_t colon = text.rfind(':');
    const std::string style = colon == std::string::npos ? "" : text.substr(colon + 1);
    Panel panel;
    if (style == "parts") panel.shading = Shading::parts;
    if (style == "flat") panel.shading = Shading::flat;
    const bool styled = style == "parts" || style == "flat" || style == "smooth";
    panel.mesh = common::read_model(styled ? text.substr(0, colon) : text);
    return panel;
}

Eigen::Vector3d vector_of(const std::array<double, 3>& a) {
    return {a[0], a[1], a[2]};
}

/// What the camera of all panels sees: its box in camera axes around every mesh.
Eigen::AlignedBox2d seen_box(const std::vector<Panel>& panels, const Eigen::Matrix3d& R) {
    Eigen::AlignedBox2d box;
    for (const Panel& panel : panels) {
        for (const Eigen::Vector3d& p : panel.mesh.positions) {
            box.extend(Eigen::Vector2d((R * p).head<2>()));
        }
    }
    return box;
}

/// Lays a picture over another, by its alpha, within a disc of the given radius and a thin rim.
void lay_lens(const Image& lens, int x0, int y0, double radius, Image& onto) {
    const double rim = 2.0 * kSamples;
    for (int y = 0; y < lens.height; ++y) {
        for (int x = 0; x < lens.width; ++x) {
            const double d = std::hypot(x + 0.5 - 0.5 * lens.width, y + 0.5 - 0.5 * lens.height);
            const int tx = x0 + x;
            const int ty = y0 + y;
            if (d > radius || tx < 0 || ty < 0 || tx >= onto.width || ty >= onto.height) continue;
            Eigen::Vector4f& pixel = onto.at(tx, ty);
            if (d > radius - rim) {
                pixel = Eigen::Vector4f(0.30F, 0.33F, 0.38F, 1.0F);
            } else {
                const Eigen::Vector4f& p = lens.at(x, y);
                const Eigen::Vector4f white = Eigen::Vector4f::Ones();
                pixel = p.w() * p + (1 - p.w()) * white;
                pixel.w() = 1.0F;
            }
        }
    }
}

/// A ring that shows on the model what the lens enlarges.
void draw_ring(double cx, double cy, double radius, Image& onto) {
    for (int y = 0; y < onto.height; ++y) {
        for (int x = 0; x < onto.width; ++x) {
            const double d = std::hypot(x + 0.5 - cx, y + 0.5 - cy);
            if (std::abs(d - radius) < 0.7 * kSamples) {
                onto.at(x, y) = Eigen::Vector4f(0.30F, 0.33F, 0.38F, 1.0F);
            }
        }
    }
}

struct Frame {
    Camera camera;
    int width = 0;  // in samples
    int height = 0;
};

Frame frame_of(const std::vector<Panel>& panels, const Options& options) {
    Frame frame;
    frame.camera.R = tests::viewing_axes(vector_of(options.view), vector_of(options.up));
    const Eigen::AlignedBox2d box = seen_box(panels, frame.camera.R);
    const Eigen::Vector2d extent = box.sizes();
    const double longest = std::max(extent.maxCoeff(), 1e-300);
    frame.camera.centre = box.center();
    frame.camera.pixels_per_unit = 0.95 * options.size * kSamples / longest;
    const auto side = [&](double share) {
        return kSamples *
               std::max(16, static_cast<int>(std::ceil(options.size * (0.05 + 0.95 * share))));
    };
    frame.width = side(extent.x() / longest);
    frame.height = side(extent.y() / longest);
    return frame;
}

/// The lens: a disc at (x, y) of the panel of a radius, both as shares of its size, enlarged into
/// the disc at the place and of the radius that the last three numbers say.
void add_lens(const Panel& panel, const Frame& frame, const Options& options, double occlusion,
              Image& image) {
    const double size = kSamples * options.size;
    const double from_x = options.lens[0] * frame.width;
    const double from_y = options.lens[1] * frame.height;
    const double from_radius = options.lens[2] * size;
    const double to_radius = options.lens[5] * size;
    Camera near = frame.camera;
    near.centre += Eigen::Vector2d(from_x - 0.5 * frame.width, 0.5 * frame.height - from_y) /
                   frame.camera.pixels_per_unit;
    near.pixels_per_unit *= to_radius / from_radius;
    const int side = 2 * static_cast<int>(std::ceil(to_radius));
    const tests::SurfaceStyle style{
        panel.shading == Shading::parts ? Shading::parts : Shading::flat,
        panel.shading != Shading::parts, occlusion};
    const Image lens = tests::draw_surface(panel.mesh, near, side, side, style);
    draw_ring(from_x, from_y, from_radius, image);
    lay_lens(lens, static_cast<int>(options.lens[3] * frame.width) - side / 2,
             static_cast<int>(options.lens[4] * frame.height) - side / 2, to_radius, image);
}

Image draw_panel(const Panel& panel, const Frame& frame, const Options& options) {
    const double occlusion = 0.05 * common::bounding_box(panel.mesh.positions).diagonal().norm();
    Image image = tests::draw_surface(panel.mesh, frame.camera, frame.width, frame.height,
                                      {panel.shading, false, occlusion});
    if (!options.lens.empty()) add_lens(panel, frame, options, occlusion, image);
    return image;
}

std::uint8_t byte_of(float linear) {
    const float x = std::clamp(linear, 0.0F, 1.0F);
    return static_cast<std::uint8_t>(std::lround(255.0F * std::pow(x, 1.0F / 2.2F)));
}

/// Averages the samples of each pixel over white paper and writes the row.
void write_ppm(const std::string& path, const std::vector<Image>& panels) {
    const int height = panels.front().height / kSamples;
    std::string bytes;
    int width = 0;
    for (const Image& panel : panels) width += panel.width / kSamples;
    bytes = "P6\n" + std::to_string(width) + " " + std::to_string(height) + "\n255\n";
    for (int y = 0; y < height; ++y) {
        for (const Image& panel : panels) {
            for (int x = 0; x < panel.width / kSamples; ++x) {
                Eigen::Vector3f sum = Eigen::Vector3f::Zero();
                for (int k = 0; k < kSamples * kSamples; ++k) {
                    const Eigen::Vector4f& p =
                        panel.at(kSamples * x + k % kSamples, kSamples * y + k / kSamples);
                    sum += p.w() * p.head<3>() + (1 - p.w()) * Eigen::Vector3f::Ones();
                }
                for (const float c : sum) {
                    bytes += static_cast<char>(byte_of(c / (kSamples * kSamples)));
                }
            }
        }
    }
    std::ofstream file(path, std::ios::binary);
    if (!file.write(bytes.data(), static_cast<std::streamsize>(bytes.size())).flush()) {
        throw common::ModelError("cannot write '" + path + "'");
    }
}

void render(const Options& options) {
    std::vector<Panel> panels;
    for (const std::string& text : options.meshes) panels.push_back(read_panel(text));
    const Frame frame = frame_of(panels, options);
    std::vector<Image> images;
    images.reserve(panels.size());
    for (const Panel& panel : panels) images.push_back(draw_panel(panel, frame, options));
    write_ppm(options.out, images);
}

}  // namespace

int main(int argc, char** argv) {
    Options options;
    CLI::App app("Draws meshes side by side, seen by one camera.", "render_meshes");
    app.add_option("MESH", options.meshes, "FILE[:smooth|flat|parts]; parts: a colour each")
        ->required();
    app.add_option("--out", options.out, "PPM to write")->required();
    app.add_option("--size", options.size, "Pixels of the longest side of a panel")
        ->check(CLI::Range(16, 4000));
    app.add_option("--view", options.view, "Direction towards the viewer")->delimiter(',');
    app.add_option("--up", options.up, "Direction that is up")->delimiter(',');
    app.add_option("--lens", options.lens,
                   "X,Y,RADIUS of a disc and X,Y,RADIUS of its enlargement, shares of the panel")
        ->delimiter(',')
        ->expected(6);
    CLI11_PARSE(app, argc, argv);
    try {
        render(options);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "render_meshes: %s\n", error.what());
        return 2;
    }
    return 0;
}
