// common/openmesh_io.cpp: long because OpenMesh's two base classes ask for all they might ever
// need.
#include "common/openmesh_io.hpp"

#include <OpenMesh/Core/IO/MeshIO.hh>
#include <OpenMesh/Core/IO/exporter/BaseExporter.hh>
#include <OpenMesh/Core/IO/importer/BaseImporter.hh>
#include <OpenMesh/Core/Utils/color_cast.hh>
#include <cmath>
#include <cstdint>
#include <mutex>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace ellicast::common {
namespace {

using OpenMesh::EdgeHandle;
using OpenMesh::FaceHandle;
using OpenMesh::HalfedgeHandle;
using OpenMesh::Vec2f;
using OpenMesh::Vec3d;
using OpenMesh::Vec3f;
using OpenMesh::Vec3uc;
using OpenMesh::Vec3ui;
using OpenMesh::Vec4f;
using OpenMesh::Vec4uc;
using OpenMesh::Vec4ui;
using OpenMesh::VertexHandle;
using OpenMesh::Attributes::StatusInfo;

// Readers and writers are singletons with state, and they print: one at a time, in silence.
class OpenMeshSession {
  public:
    OpenMeshSession() : lock_(mutex()) {
        omerr().disable();
        omlog().disable();
        omout().disable();
    }

  private:
    static std::mutex& mutex() {
        static std::mutex instance;
        return instance;
    }
    std::lock_guard<std::mutex> lock_;
};

// Collects faces as they are listed. An OpenMesh mesh would refuse those that make it non-manifold.
class SoupImporter final : public OpenMesh::IO::BaseImporter {
  public:
    explicit SoupImporter(PolygonSoup& soup) : soup_(soup) {}

    VertexHandle add_vertex(const Vec3f& p) override {
        soup_.positions.emplace_back(p[0], p[1], p[2]);
        return VertexHandle(static_cast<int>(soup_.positions.size()) - 1);
    }
    VertexHandle add_vertex(const Vec3d& p) override {
        soup_.positions.emplace_back(p[0], p[1], p[2]);
        return VertexHandle(static_cast<int>(soup_.positions.size()) - 1);
    }
    VertexHandle add_vertex() override { return add_vertex(Vec3f(0, 0, 0)); }
    void set_point(VertexHandle v, const Vec3f& p) override {
        soup_.positions[static_cast<std::size_t>(v.idx())] = Eigen::Vector3d(p[0], p[1], p[2]);
    }
    FaceHandle add_face(const VHandles& corners) override {
        for (const VertexHandle v : corners) {
            soup_.corners.push_back(static_cast<std::uint32_t>(v.idx()));
        }
        soup_.ends.push_back(soup_.corners.size());
        return FaceHandle(static_cast<int>(soup_.ends.size()) - 1);
    }
    std::size_t n_vertices() const override { return soup_.positions.size(); }
    std::size_t n_faces() const override { return soup_.faces(); }
    std::size_t n_edges() const override { return 0; }

    // What only OpenMesh's own format brings, and all that is not shape.
    HalfedgeHandle add_edge(VertexHandle, VertexHandle) override { return HalfedgeHandle(); }
    FaceHandle add_face(HalfedgeHandle) override { return FaceHandle(); }
    void add_face_texcoords(FaceHandle, VertexHandle, const std::vector<Vec2f>&) override {}
    void add_face_texcoords(FaceHandle, VertexHandle, const std::vector<Vec3f>&) override {}
    void set_face_texindex(FaceHandle, int) override {}
    void set_halfedge(VertexHandle, HalfedgeHandle) override {}
    void set_next(HalfedgeHandle, HalfedgeHandle) override {}
    void set_face(HalfedgeHandle, FaceHandle) override {}
    void request_face_texcoords2D() override {}
    void set_normal(VertexHandle, const Vec3f&) override {}
    void set_normal(VertexHandle, const Vec3d&) override {}
    void set_normal(FaceHandle, const Vec3f&) override {}
    void set_normal(FaceHandle, const Vec3d&) override {}
    void set_texcoord(VertexHandle, const Vec2f&) override {}
    void set_texcoord(VertexHandle, const Vec3f&) override {}
    void set_texcoord(HalfedgeHandle, const Vec2f&) override {}
    void set_texcoord(HalfedgeHandle, const Vec3f&) override {}
    void set_color(VertexHandle, const Vec3uc&) override {}
    void set_color(VertexHandle, const Vec4uc&) override {}
    void set_color(VertexHandle, const Vec3f&) override {}
    void set_color(VertexHandle, const Vec4f&) override {}
    void set_color(EdgeHandle, const Vec3uc&) override {}
    void set_color(EdgeHandle, const Vec4uc&) override {}
    void set_color(EdgeHandle, const Vec3f&) override {}
    void set_color(EdgeHandle, const Vec4f&) override {}
    void set_color(FaceHandle, const Vec3uc&) override {}
    void set_color(FaceHandle, const Vec4uc&) override {}
    void set_color(FaceHandle, const Vec3f&) override {}
    void set_color(FaceHandle, const Vec4f&) override {}
    void set_status(VertexHandle, const StatusInfo&) override {}
    void set_status(HalfedgeHandle, const StatusInfo&) override {}
    void set_status(EdgeHandle, const StatusInfo&) override {}
    void set_status(FaceHandle, const StatusInfo&) override {}
    void add_texture_information(int, std::string) override {}

  private:
    PolygonSoup& soup_;
};

// Shows a triangle mesh to the writers.
class MeshExporter final : public OpenMesh::IO::BaseExporter {
  public:
    explicit MeshExporter(const TriangleMesh& mesh) : mesh_(mesh) {}

    Vec3f point(VertexHandle v) const override {
        const Eigen::Vector3f p = position(v).cast<float>();
        return {p[0], p[1], p[2]};
    }
    Vec3d pointd(VertexHandle v) const override {
        const Eigen::Vector3d& p = position(v);
        return {p[0], p[1], p[2]};
    }
    bool is_point_double() const override { return false; }
    unsigned get_vhandles(FaceHandle f, std::vector<VertexHandle>& corners) const override {
        corners.clear();
        for (const std::uint32_t v : mesh_.triangles[static_cast<std::size_t>(f.idx())]) {
            corners.emplace_back(static_cast<int>(v));
        }
        return 3;
    }
    std::size_t n_vertices() const override { return mesh_.positions.size(); }
    std::size_t n_faces() const override { return mesh_.triangles.size(); }
    std::size_t n_edges() const override { return 0; }
    bool is_triangle_mesh() const override { return true; }

    // There is nothing but vertices and faces.
    Vec3f normal(VertexHandle) const override { return Vec3f(0, 0, 0); }
    Vec3d normald(VertexHandle) const override { return Vec3d(0, 0, 0); }
    bool is_normal_double() const override { return false; }
    Vec3f normal(FaceHandle) const override { return Vec3f(0, 0, 0); }
    Vec3d normald(FaceHandle) const override { return Vec3d(0, 0, 0); }
    Vec2f texcoord(VertexHandle) const override { return Vec2f(0, 0); }
    Vec2f texcoord(HalfedgeHandle) const override { return Vec2f(0, 0); }
    unsigned get_face_texcoords(std::vector<Vec2f>&) const override { return 0; }
    HalfedgeHandle getHeh(FaceHandle, VertexHandle) const override { return HalfedgeHandle(); }
    Vec3uc color(VertexHandle) const override { return Vec3uc(0, 0, 0); }
    Vec3uc color(FaceHandle) const override { return Vec3uc(0, 0, 0); }
    Vec3uc color(EdgeHandle) const override { return Vec3uc(0, 0, 0); }
    Vec4uc colorA(VertexHandle) const override { return Vec4uc(0, 0, 0, 0); }
    Vec4uc colorA(FaceHandle) const override { return Vec4uc(0, 0, 0, 0); }
    Vec4uc colorA(EdgeHandle) const override { return Vec4uc(0, 0, 0, 0); }
    Vec3ui colori(VertexHandle) const override { return Vec3ui(0, 0, 0); }
    Vec3ui colori(FaceHandle) const override { return Vec3ui(0, 0, 0); }
    Vec3ui colori(EdgeHandle) const override { return Vec3ui(0, 0, 0); }
    Vec4ui colorAi(VertexHandle) const override { return Vec4ui(0, 0, 0, 0); }
    Vec4ui colorAi(FaceHandle) const override { return Vec4ui(0, 0, 0, 0); }
    Vec4ui colorAi(EdgeHandle) const override { return Vec4ui(0, 0, 0, 0); }
    Vec3f colorf(VertexHandle) const override { return Vec3f(0, 0, 0); }
    Vec3f colorf(FaceHandle) const override { return Vec3f(0, 0, 0); }
    Vec3f colorf(EdgeHandle) const override { return Vec3f(0, 0, 0); }
    Vec4f colorAf(VertexHandle) const override { return Vec4f(0, 0, 0, 0); }
    Vec4f colorAf(FaceHandle) const override { return Vec4f(0, 0, 0, 0); }
    Vec4f colorAf(EdgeHandle) const override { return Vec4f(0, 0, 0, 0); }
    StatusInfo status(VertexHandle) const override { return {}; }
    StatusInfo status(FaceHandle) const override { return {}; }
    StatusInfo status(EdgeHandle) const override { return {}; }
    StatusInfo status(HalfedgeHandle) const override { return {}; }
    int get_halfedge_id(VertexHandle) override { return -1; }
    int get_halfedge_id(FaceHandle) override { return -1; }
    int get_next_halfedge_id(HalfedgeHandle) override { return -1; }
    int get_to_vertex_id(HalfedgeHandle) override { return -1; }
    int get_face_id(HalfedgeHandle) override { return -1; }

  private:
    const Eigen::Vector3d& position(VertexHandle v) const {
        return mesh_.positions[static_cast<std::size_t>(v.idx())];
    }
    const TriangleMesh& mesh_;
};

const char* extension_of(ModelFormat format) {
    switch (format) {
        case ModelFormat::ply:
            return "ply";
        case ModelFormat::obj:
            return "obj";
        case ModelFormat::off:
            return "off";
        case ModelFormat::stl:
            break;
    }
    return "stl";
}

// float32 is what OpenMesh made of the same digits: its half ulp is 2^-24 of the value, and the
// smallest step near zero 2^-149.
bool agree(const std::vector<Eigen::Vector3d>& a, const std::vector<Eigen::Vector3d>& b) {
    for (std::size_t i = 0; i < a.size(); ++i) {
        const double allowed = 0x1p-23 * a[i].cwiseAbs().maxCoeff() + 0x1p-148;
        if (!((a[i] - b[i]).cwiseAbs().maxCoeff() <= allowed)) return false;
    }
    return true;
}

}  // namespace

PolygonSoup read_through_openmesh(PlainModelFile file, ModelFormat format) {
    const OpenMeshSession session;
    PolygonSoup soup;
    soup.positions.reserve(format == ModelFormat::stl ? file.faces / 2 : file.vertices);
    soup.corners.reserve(3 * file.faces);
    soup.ends.reserve(file.faces);
    SoupImporter importer(soup);
    OpenMesh::IO::Options options =
        file.binary ? OpenMesh::IO::Options::Binary : OpenMesh::IO::Options::Default;
    std::istringstream stream(std::move(file.bytes));
    if (!OpenMesh::IO::IOManager().read(stream, extension_of(format), importer, options)) {
        throw BadModelFile("OpenMesh cannot read it");
    }
    // Faces may be fewer: those with less than three distinct corners count for nothing.
    bool same = soup.faces() <= file.faces &&
                (format == ModelFormat::stl || soup.positions.size() == file.vertices);
    for (const std::uint32_t corner : soup.corners) same = same && corner < soup.positions.size();
    if (!file.exact.empty()) {
        same = same && agree(file.exact, soup.positions);
        soup.positions = std::move(file.exact);
    }
    if (!same) throw BadModelFile("OpenMesh reads it otherwise than the check before");
    return soup;
}

std::string write_through_openmesh(const TriangleMesh& mesh, ModelFormat format) {
    const OpenMeshSession session;
    MeshExporter exporter(mesh);
    const OpenMesh::IO::Options options =
        format == ModelFormat::stl ? OpenMesh::IO::Options::Binary : OpenMesh::IO::Options::Default;
    constexpr std::streamsize kDigits = 9;  // bring every float32 back
    std::ostringstream stream;
    if (!OpenMesh::IO::IOManager().write(stream, extension_of(format), exporter, options,
                                         kDigits)) {
        throw BadModelFile("OpenMesh cannot write it");
    }
    return std::move(stream).str();
}

}  // namespace ellicast::common
