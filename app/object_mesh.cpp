#include "app/object_mesh.h"

#include <fmt/format.h>

#include <array>
#include <iterator>
#include <numbers>
#include <string>

#include "slam/io/atomic_file.h"
#include "slam/util/error.h"

namespace sqslam::app {
namespace {

constexpr int kRows = 32;     // steps of eta from pole to pole
constexpr int kColumns = 64;  // steps of omega around
constexpr int kVertices = (kRows + 1) * kColumns;
constexpr int kFaces = kRows * kColumns;

struct Vertex {
  Eigen::Vector3d p;  // map frame
  Eigen::Vector3d n;  // outward, unit length
};

std::vector<Vertex> Vertices(const PosedSuperquadric& superquadric) {
  std::vector<Vertex> vertices;
  for (int row = 0; row <= kRows; ++row) {
    const double eta = std::numbers::pi * (static_cast<double>(row) / kRows - 0.5);
    for (int column = 0; column < kColumns; ++column) {
      const double omega = std::numbers::pi * (2.0 * column / kColumns - 1.0);
      vertices.push_back({superquadric.T_map_object * superquadric.shape.PointAt(eta, omega),
                          superquadric.T_map_object.rotation * superquadric.shape.NormalAt(eta, omega)});
    }
  }
  return vertices;
}

// Corners of each quad, counted from `base`, counter-clockwise from outside.
std::vector<std::array<int, 4>> Quads(int base) {
  std::vector<std::array<int, 4>> quads;
  for (int row = 0; row < kRows; ++row) {
    for (int column = 0; column < kColumns; ++column) {
      const int a = base + row * kColumns + column;
      const int b = base + row * kColumns + (column + 1) % kColumns;
      quads.push_back({a, b, b + kColumns, a + kColumns});
    }
  }
  return quads;
}

std::string ObjText(const std::vector<SnapshotObject>& objects) {
  std::string text = "# superquadrics, map frame, z up\n";
  auto out = std::back_inserter(text);
  int base = 1;  // OBJ counts from one, over the whole file
  for (const SnapshotObject& object : objects) {
    fmt::format_to(out, "o {}_{}\n", object.label, object.id);
    for (const auto& [p, n] : Vertices(object.superquadric)) {
      fmt::format_to(out, "v {:.6g} {:.6g} {:.6g}\nvn {:.4f} {:.4f} {:.4f}\n", p.x(), p.y(), p.z(), n.x(),
                     n.y(), n.z());
    }
    for (const auto& [a, b, c, d] : Quads(base)) {
      fmt::format_to(out, "f {0}//{0} {1}//{1} {2}//{2} {3}//{3}\n", a, b, c, d);
    }
    base += kVertices;
  }
  return text;
}

std::string PlyText(const std::vector<SnapshotObject>& objects) {
  std::string text = fmt::format(
      "ply\nformat ascii 1.0\ncomment superquadrics, map frame, z up\nelement vertex {}\nproperty float x\n"
      "property float y\nproperty float z\nproperty float nx\nproperty float ny\nproperty float nz\n"
      "element face {}\nproperty list uchar int vertex_indices\nend_header\n",
      objects.size() * kVertices, objects.size() * kFaces);
  auto out = std::back_inserter(text);
  for (const SnapshotObject& object : objects) {
    for (const auto& [p, n] : Vertices(object.superquadric)) {
      fmt::format_to(out, "{:.7g} {:.7g} {:.7g} {:.4f} {:.4f} {:.4f}\n", p.x(), p.y(), p.z(), n.x(), n.y(),
                     n.z());
    }
  }
  for (std::size_t i = 0; i < objects.size(); ++i) {
    for (const auto& [a, b, c, d] : Quads(static_cast<int>(i) * kVertices)) {
      fmt::format_to(out, "4 {} {} {} {}\n", a, b, c, d);
    }
  }
  return text;
}

}  // namespace

void WriteObjectMeshes(const std::filesystem::path& path, const std::vector<SnapshotObject>& objects) {
  const std::string extension = path.extension().string();
  if (extension != ".obj" && extension != ".ply") {
    throw UsageError(fmt::format("{}: unknown extension of a mesh, expected .obj or .ply", path.string()));
  }
  WriteFileAtomically(path, extension == ".obj" ? ObjText(objects) : PlyText(objects));
}

}  // namespace sqslam::app
