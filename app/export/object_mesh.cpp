#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <map>
#include <numeric>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "app/export/map_export.h"
#include "render/scene/style.h"
#include "render/solids/tessellation.h"
#include "slam/util/atomic_file.h"
#include "slam/util/throw_if.h"
#include "slam/util/to_vector.h"

namespace sqslam::app {
namespace {

constexpr int kRows = 32;     // steps of eta, pole to pole
constexpr int kColumns = 64;  // steps of omega around

// A closed mesh of triangles and quads, in the map frame.
struct ObjectMesh {
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector3d> normals;  // of the points: outward, unit length
  std::vector<std::vector<int>> faces;   // counter-clockwise seen from outside
};

// Merges the vertices of a grid that are so close that a triangle between them would have no area, as at the
// poles and at the edges of boxes.
class GridWelder {
 public:
  explicit GridWelder(const std::vector<Eigen::Vector3d>& points) : points_(points), root_(points.size()) {
    std::iota(root_.begin(), root_.end(), 0);
  }
  void MergeIfClose(int a, int b, double tolerance) {
    const auto at = [&](int i) { return points_[static_cast<std::size_t>(i)]; };
    if ((at(a) - at(b)).norm() < tolerance) {
      root_[static_cast<std::size_t>(RootOf(a))] = RootOf(b);
    }
  }
  int RootOf(int i) {
    while (root_[static_cast<std::size_t>(i)] != i) {
      i = root_[static_cast<std::size_t>(i)] =
          root_[static_cast<std::size_t>(root_[static_cast<std::size_t>(i)])];
    }
    return i;
  }

 private:
  const std::vector<Eigen::Vector3d>& points_;
  std::vector<int> root_;
};

// Returns the vertex indices of each quad of the grid.
std::vector<std::array<int, 4>> Quads() {
  std::vector<std::array<int, 4>> quads;
  for (int row = 0; row < kRows; ++row) {
    for (int column = 0; column < kColumns; ++column) {
      const int a = row * kColumns + column;
      const int b = row * kColumns + (column + 1) % kColumns;
      quads.push_back({a, b, b + kColumns, a + kColumns});
    }
  }
  return quads;
}

ObjectMesh MeshOf(const PosedSuperquadric& superquadric) {
  constexpr double kTolerance = 1e-4;  // of the largest half size
  const auto& [shape, T_map_object] = superquadric;
  const TriangleMesh grid = Tessellate(shape, kColumns);
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector3d> normals;
  for (std::size_t i = 0; i < grid.vertices.size(); ++i) {
    if (i % (kColumns + 1) < kColumns) {  // the last column repeats the first
      points.push_back(T_map_object * grid.vertices[i].cast<double>());
      normals.push_back(T_map_object.rotation * grid.normals[i].cast<double>());
    }
  }
  GridWelder welder(points);
  for (const auto& [a, b, c, d] : Quads()) {
    for (const auto& [from, to] : {std::pair(a, b), std::pair(b, c), std::pair(c, d), std::pair(d, a)}) {
      welder.MergeIfClose(from, to, kTolerance * shape.half_size.maxCoeff());
    }
  }
  ObjectMesh mesh;
  std::map<int, int> index;  // by root
  for (int i = 0; i < static_cast<int>(points.size()); ++i) {
    const auto [at, is_new] = index.emplace(welder.RootOf(i), static_cast<int>(mesh.points.size()));
    if (is_new) {
      mesh.points.push_back(points[static_cast<std::size_t>(at->first)]);
      mesh.normals.push_back(Eigen::Vector3d::Zero());
    }
    mesh.normals[static_cast<std::size_t>(at->second)] += normals[static_cast<std::size_t>(i)];
  }
  for (Eigen::Vector3d& normal : mesh.normals) {
    normal.normalize();
  }
  for (const std::array<int, 4>& quad : Quads()) {
    std::vector<int> face;
    for (const int corner : quad) {
      const int merged = index.at(welder.RootOf(corner));
      if (std::ranges::find(face, merged) == face.end()) {
        face.push_back(merged);
      }
    }
    if (face.size() > 2) {
      mesh.faces.push_back(std::move(face));
    }
  }
  return mesh;
}

// Returns the closed meshes of all solids of an object as one.
ObjectMesh MeshOf(const SnapshotObject& object) {
  ObjectMesh whole;
  for (const PosedSuperquadric& solid : SolidsOf(object)) {
    ObjectMesh mesh = MeshOf(solid);
    for (std::vector<int>& face : mesh.faces) {
      std::ranges::for_each(face, [&](int& corner) { corner += static_cast<int>(whole.points.size()); });
      whole.faces.push_back(std::move(face));
    }
    whole.points.insert(whole.points.end(), mesh.points.begin(), mesh.points.end());
    whole.normals.insert(whole.normals.end(), mesh.normals.begin(), mesh.normals.end());
  }
  return whole;
}

std::vector<ObjectMesh> MeshesOf(const std::vector<SnapshotObject>& objects) {
  return ToVector(objects, [](const SnapshotObject& object) { return MeshOf(object); });
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

// Returns a direction or point of the map in a file with this axis up.
Eigen::Vector3d InFile(const Eigen::Vector3d& p_map, UpAxis up) {
  return up == UpAxis::kZ ? p_map : Eigen::Vector3d(p_map.x(), p_map.z(), -p_map.y());
}

std::string ObjText(const std::vector<SnapshotObject>& objects, const std::string& mtl_file,
                    const MeshFileOptions& options) {
  std::string text = fmt::format("# superquadrics; {}; in this file {} up\nmtllib {}\n", options.frame,
                                 NameOf(options.up), mtl_file);
  auto out = std::back_inserter(text);
  int base = 1;  // OBJ indices start at 1 and run over the whole file
  for (const SnapshotObject& object : objects) {
    fmt::format_to(out, "o {}_{}\nusemtl {}\n", MaterialName(ShownName(object)), object.id,
                   MaterialName(object.label));
    const ObjectMesh mesh = MeshOf(object);
    for (std::size_t i = 0; i < mesh.points.size(); ++i) {
      fmt::format_to(out, "v {:.9g}\nvn {:.4f}\n", fmt::join(InFile(mesh.points[i], options.up), " "),
                     fmt::join(InFile(mesh.normals[i], options.up), " "));
    }
    for (const std::vector<int>& face : mesh.faces) {
      text += 'f';
      for (const int corner : face) {
        fmt::format_to(out, " {0}//{0}", base + corner);
      }
      text += '\n';
    }
    base += static_cast<int>(mesh.points.size());
  }
  return text;
}

std::string PlyText(const std::vector<SnapshotObject>& objects, const MeshFileOptions& options) {
  const std::vector<ObjectMesh> meshes = MeshesOf(objects);
  std::size_t points = 0;
  std::size_t faces = 0;
  for (const ObjectMesh& mesh : meshes) {
    points += mesh.points.size();
    faces += mesh.faces.size();
  }
  std::string text = fmt::format(
      "ply\nformat ascii 1.0\ncomment superquadrics; {}\nelement vertex {}\nproperty float x\n"
      "property float y\nproperty float z\nproperty float nx\nproperty float ny\nproperty float nz\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\n"
      "element face {}\nproperty list uchar int vertex_indices\nend_header\n",
      options.frame, points, faces);
  auto out = std::back_inserter(text);
  for (std::size_t k = 0; k < objects.size(); ++k) {
    const Eigen::Vector3i c = (255.0 * options.colors(objects[k].label)).array().round().cast<int>();
    for (std::size_t i = 0; i < meshes[k].points.size(); ++i) {
      fmt::format_to(out, "{:.9g} {:.4f} {}\n", fmt::join(meshes[k].points[i], " "),
                     fmt::join(meshes[k].normals[i], " "), fmt::join(c, " "));
    }
  }
  int base = 0;
  for (const ObjectMesh& mesh : meshes) {
    for (const std::vector<int>& face : mesh.faces) {
      fmt::format_to(out, "{}", face.size());
      for (const int corner : face) {
        fmt::format_to(out, " {}", base + corner);
      }
      text += '\n';
    }
    base += static_cast<int>(mesh.points.size());
  }
  return text;
}

}  // namespace

void WriteObjectMeshes(const std::filesystem::path& path, const std::vector<SnapshotObject>& objects,
                       const MeshFileOptions& options) {
  const std::string extension = path.extension().string();
  ThrowIf<UsageError>(extension != ".obj" && extension != ".ply",
                      "{}: unknown extension of a mesh, expected .obj or .ply", path.string());
  if (extension == ".ply") {
    WriteFileAtomically(path, PlyText(objects, options));
    return;
  }
  const std::filesystem::path materials = std::filesystem::path(path).replace_extension(".mtl");
  WriteFileAtomically(materials, MtlText(objects, options.colors));  // first: the .obj refers to it
  try {
    WriteFileAtomically(path, ObjText(objects, materials.filename().string(), options));
  } catch (...) {
    std::error_code none;
    std::filesystem::remove(materials, none);  // nothing refers to it
    throw;
  }
}

}  // namespace sqslam::app
