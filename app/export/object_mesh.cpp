#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <set>
#include <string>

#include "app/export/map_export.h"
#include "render/scene/style.h"
#include "render/solids/tessellation.h"
#include "slam/util/atomic_file.h"
#include "slam/util/throw_if.h"

namespace sqslam::app {
namespace {

constexpr int kRows = 32;     // steps of eta, pole to pole
constexpr int kColumns = 64;  // steps of omega around
constexpr int kVertices = (kRows + 1) * kColumns;
constexpr int kFaces = kRows * kColumns;

struct Vertex {
  Eigen::Vector3d p;  // map frame
  Eigen::Vector3d n;  // outward, unit length
};

std::vector<Vertex> Vertices(const PosedSuperquadric& superquadric) {
  const auto& [shape, T_map_object] = superquadric;
  const TriangleMesh mesh = Tessellate(shape, kColumns);
  std::vector<Vertex> vertices;
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    if (i % (kColumns + 1) < kColumns) {  // the last column repeats the first
      vertices.push_back({T_map_object * mesh.vertices[i].cast<double>(),
                          T_map_object.rotation * mesh.normals[i].cast<double>()});
    }
  }
  return vertices;
}

// Returns the vertex indices of each quad, starting at `base`, counter-clockwise seen from outside.
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

// Replaces blanks, which end a name in .obj and .mtl files.
std::string MaterialName(std::string label) {
  std::ranges::replace(label, ' ', '_');
  return label;
}

std::string MtlText(const std::vector<SnapshotObject>& objects, const LabelColors& colors) {
  std::string text = "# colours of the classes\n";
  std::set<std::string> written;
  for (const SnapshotObject& object : objects) {
    if (written.insert(object.label).second) {
      text += fmt::format("\nnewmtl {}\nKa 0 0 0\nKd {:.4f}\nKs 0.1 0.1 0.1\nNs 30\nd 1\nillum 2\n",
                          MaterialName(object.label), fmt::join(colors(object.label), " "));
    }
  }
  return text;
}

std::string ObjText(const std::vector<SnapshotObject>& objects, const std::string& mtl_file) {
  std::string text = fmt::format("# superquadrics, map frame, z up\nmtllib {}\n", mtl_file);
  auto out = std::back_inserter(text);
  int base = 1;  // OBJ indices start at 1 and run over the whole file
  for (const SnapshotObject& object : objects) {
    fmt::format_to(out, "o {}_{}\nusemtl {}\n", MaterialName(ShownName(object)), object.id,
                   MaterialName(object.label));
    for (const auto& [p, n] : Vertices(object.superquadric)) {
      fmt::format_to(out, "v {:.6g}\nvn {:.4f}\n", fmt::join(p, " "), fmt::join(n, " "));
    }
    for (const auto& [a, b, c, d] : Quads(base)) {
      fmt::format_to(out, "f {0}//{0} {1}//{1} {2}//{2} {3}//{3}\n", a, b, c, d);
    }
    base += kVertices;
  }
  return text;
}

std::string PlyText(const std::vector<SnapshotObject>& objects, const LabelColors& colors) {
  std::string text = fmt::format(
      "ply\nformat ascii 1.0\ncomment superquadrics, map frame, z up\nelement vertex {}\nproperty float x\n"
      "property float y\nproperty float z\nproperty float nx\nproperty float ny\nproperty float nz\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\n"
      "element face {}\nproperty list uchar int vertex_indices\nend_header\n",
      objects.size() * kVertices, objects.size() * kFaces);
  auto out = std::back_inserter(text);
  for (const SnapshotObject& object : objects) {
    const Eigen::Vector3i c = (255.0 * colors(object.label)).array().round().cast<int>();
    for (const auto& [p, n] : Vertices(object.superquadric)) {
      fmt::format_to(out, "{:.7g} {:.4f} {}\n", fmt::join(p, " "), fmt::join(n, " "), fmt::join(c, " "));
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

void WriteObjectMeshes(const std::filesystem::path& path, const std::vector<SnapshotObject>& objects,
                       const LabelColors& colors) {
  const std::string extension = path.extension().string();
  ThrowIf<UsageError>(extension != ".obj" && extension != ".ply",
                      "{}: unknown extension of a mesh, expected .obj or .ply", path.string());
  if (extension == ".ply") {
    WriteFileAtomically(path, PlyText(objects, colors));
    return;
  }
  const std::filesystem::path materials = std::filesystem::path(path).replace_extension(".mtl");
  WriteFileAtomically(materials, MtlText(objects, colors));  // first: the .obj refers to it
  try {
    WriteFileAtomically(path, ObjText(objects, materials.filename().string()));
  } catch (...) {
    std::error_code none;
    std::filesystem::remove(materials, none);  // nothing refers to it
    throw;
  }
}

}  // namespace sqslam::app
