#include "render/surface/surface_mesh.h"

#include <vtkCellArray.h>
#include <vtkFloatArray.h>
#include <vtkFlyingEdges3D.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkQuadricDecimation.h>
#include <vtkUnsignedCharArray.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "render/solids/poly_data.h"
#include "slam/util/disjoint_sets.h"
#include "slam/util/key_index.h"
#include "slam/util/parallel.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

using Place = SurfaceVolume::Place;

constexpr int kVoxels = SurfaceVolume::kEdge;
constexpr int kChunk = 8;                    // blocks along the part marched at a time
constexpr int kSide = kChunk * kVoxels + 1;  // voxels along a part, with the first of the next part

// A cubic part of the volume.
class Chunk {
 public:
  Chunk() : voxels_(static_cast<std::size_t>(kSide) * kSide * kSide) {}

  void Fill(const SurfaceVolume& volume, const std::map<Place, std::size_t>& blocks, const Place& chunk) {
    std::ranges::fill(voxels_, nullptr);
    for (int z = 0; z <= kChunk; ++z) {
      for (int y = 0; y <= kChunk; ++y) {
        for (int x = 0; x <= kChunk; ++x) {
          const auto block =
              blocks.find({chunk[0] * kChunk + x, chunk[1] * kChunk + y, chunk[2] * kChunk + z});
          if (block != blocks.end()) {
            Copy(volume.blocks[block->second], x * kVoxels, y * kVoxels, z * kVoxels);
          }
        }
      }
    }
  }

  // Returns null if no camera saw the voxel.
  const SurfaceVolume::Voxel* At(int x, int y, int z) const { return voxels_[Index(x, y, z)]; }

  vtkNew<vtkImageData> Image() const {
    vtkNew<vtkImageData> image;
    image->SetDimensions(kSide, kSide, kSide);
    image->AllocateScalars(VTK_FLOAT, 1);
    auto* values = static_cast<float*>(image->GetScalarPointer());
    for (const SurfaceVolume::Voxel* voxel : voxels_) {
      *values++ = voxel != nullptr ? voxel->distance : 1.0F;
    }
    return image;
  }

 private:
  static std::size_t Index(int x, int y, int z) {
    return static_cast<std::size_t>((z * kSide + y) * kSide + x);
  }
  void Copy(const SurfaceVolume::Block& block, int x0, int y0, int z0) {
    for (int z = 0; z < std::min(kVoxels, kSide - z0); ++z) {
      for (int y = 0; y < std::min(kVoxels, kSide - y0); ++y) {
        for (int x = 0; x < std::min(kVoxels, kSide - x0); ++x) {
          const SurfaceVolume::Voxel& voxel = block[SurfaceVolume::IndexOf(x, y, z)];
          voxels_[Index(x0 + x, y0 + y, z0 + z)] = voxel.weight > 0.0F ? &voxel : nullptr;
        }
      }
    }
  }

  std::vector<const SurfaceVolume::Voxel*> voxels_;
};

// The grid edge that a vertex lies on: its lower voxel and its axis (3: at the voxel itself).
struct GridEdge {
  Place voxel;
  int axis = 3;
  double share = 0.0;  // position between lower (0) and upper voxel (1)

  static GridEdge Of(const double* p) {
    constexpr double kVoxelTolerance = 1e-4;
    GridEdge edge;
    for (int i = 0; i < 3; ++i) {
      const double whole = std::floor(p[i] + kVoxelTolerance);
      edge.voxel[static_cast<std::size_t>(i)] = static_cast<std::int32_t>(whole);
      if (p[i] - whole > kVoxelTolerance) {
        edge.axis = i;
        edge.share = p[i] - whole;
      }
    }
    return edge;
  }
};

// Joins the parts: vertices on the same grid edge are merged.
class SurfaceBuilder {
 public:
  explicit SurfaceBuilder(double voxel) : voxel_(voxel) {}

  void Add(const Chunk& chunk, const Place& place, vtkPolyData& part) {
    std::vector<std::int64_t> vertices(static_cast<std::size_t>(part.GetNumberOfPoints()));
    for (std::size_t i = 0; i < vertices.size(); ++i) {
      std::array<double, 3> p{};
      part.GetPoint(static_cast<vtkIdType>(i), p.data());
      vertices[i] = Vertex(chunk, place, GridEdge::Of(p.data()));
    }
    vtkNew<vtkIdList> corners;
    part.GetPolys()->InitTraversal();
    while (part.GetPolys()->GetNextCell(corners) != 0) {
      const auto a = vertices[static_cast<std::size_t>(corners->GetId(0))];
      const auto b = vertices[static_cast<std::size_t>(corners->GetId(1))];
      const auto c = vertices[static_cast<std::size_t>(corners->GetId(2))];
      if (a >= 0 && b >= 0 && c >= 0 && a != b && b != c && c != a) {
        // The filter's corners have the opposite orientation.
        mesh_.triangles.push_back(
            {static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(c), static_cast<std::uint32_t>(b)});
      }
    }
  }
  SurfaceMesh Take() { return std::move(mesh_); }

 private:
  // Returns -1 if one of the edge's voxels was not seen.
  std::int64_t Vertex(const Chunk& chunk, const Place& place, const GridEdge& edge) {
    Place upper = edge.voxel;
    if (edge.axis < 3) {
      ++upper[static_cast<std::size_t>(edge.axis)];
    }
    const SurfaceVolume::Voxel* a = chunk.At(edge.voxel[0], edge.voxel[1], edge.voxel[2]);
    const SurfaceVolume::Voxel* b = chunk.At(upper[0], upper[1], upper[2]);
    if (a == nullptr || b == nullptr) {
      return -1;
    }
    KeyIndex<4>::Key key{};
    Eigen::Vector3d p;
    for (std::size_t i = 0; i < 3; ++i) {
      key[i] = place[i] * kChunk * kVoxels + edge.voxel[i];
      p[static_cast<int>(i)] = key[i] + (edge.axis == static_cast<int>(i) ? edge.share : 0.0);
    }
    key[3] = edge.axis;
    const auto [vertex, is_new] = places_.Insert(key);
    if (is_new) {
      mesh_.vertices.push_back((voxel_ * p).cast<float>());
      std::array<std::uint8_t, 3> rgb{};
      for (std::size_t i = 0; i < 3; ++i) {
        const double color = (a->rgb[i] + edge.share * (b->rgb[i] - a->rgb[i])) / 256.0;
        rgb[i] = static_cast<std::uint8_t>(std::clamp(std::lround(color), 0L, 255L));
      }
      mesh_.rgb.push_back(rgb);
    }
    return vertex;
  }

  double voxel_;
  SurfaceMesh mesh_;
  KeyIndex<4> places_;  // of the vertices
};

// Removes the triangles marked in `drop`, and unused vertices.
SurfaceMesh RemoveTriangles(const SurfaceMesh& mesh, const std::vector<bool>& drop) {
  constexpr std::uint32_t kUnused = 0xFFFFFFFF;
  SurfaceMesh kept;
  std::vector<std::uint32_t> places(mesh.vertices.size(), kUnused);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (drop[t]) {
      continue;
    }
    kept.triangles.push_back(mesh.triangles[t]);
    for (std::uint32_t& corner : kept.triangles.back()) {
      if (places[corner] == kUnused) {
        places[corner] = static_cast<std::uint32_t>(kept.vertices.size());
        kept.vertices.push_back(mesh.vertices[corner]);
        kept.rgb.push_back(mesh.rgb[corner]);
      }
      corner = places[corner];
    }
  }
  return kept;
}

SurfaceMesh RemoveIslands(const SurfaceMesh& mesh, int min_triangles) {
  DisjointSets connected(mesh.vertices.size());
  for (const auto& [a, b, c] : mesh.triangles) {
    connected.Join(static_cast<std::int32_t>(a), static_cast<std::int32_t>(b));
    connected.Join(static_cast<std::int32_t>(b), static_cast<std::int32_t>(c));
  }
  const auto roots = ToVector(mesh.triangles, [&](const auto& triangle) {
    return static_cast<std::size_t>(connected.Root(static_cast<std::int32_t>(triangle[0])));
  });
  std::vector<int> sizes(mesh.vertices.size());
  for (const std::size_t root : roots) {
    ++sizes[root];
  }
  return RemoveTriangles(mesh,
                         ToVector(roots, [&](std::size_t root) { return sizes[root] < min_triangles; }));
}

SurfaceMesh FromPolyData(vtkPolyData& data) {
  SurfaceMesh mesh;
  auto* colors = data.GetPointData()->GetScalars();
  for (vtkIdType i = 0; i < data.GetNumberOfPoints(); ++i) {
    std::array<double, 3> p{};
    data.GetPoint(i, p.data());
    mesh.vertices.emplace_back(static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2]));
    std::array<std::uint8_t, 3> rgb{};
    for (int k = 0; k < 3; ++k) {
      rgb[static_cast<std::size_t>(k)] =
          static_cast<std::uint8_t>(std::clamp(std::lround(colors->GetComponent(i, k)), 0L, 255L));
    }
    mesh.rgb.push_back(rgb);
  }
  vtkNew<vtkIdList> corners;
  data.GetPolys()->InitTraversal();
  while (data.GetPolys()->GetNextCell(corners) != 0) {
    mesh.triangles.push_back({static_cast<std::uint32_t>(corners->GetId(0)),
                              static_cast<std::uint32_t>(corners->GetId(1)),
                              static_cast<std::uint32_t>(corners->GetId(2))});
  }
  return mesh;
}

SurfaceMesh Simplified(const SurfaceMesh& mesh, int max_triangles) {
  const auto wanted = static_cast<std::size_t>(max_triangles);
  if (mesh.triangles.size() <= wanted) {
    return mesh;
  }
  vtkNew<vtkQuadricDecimation> decimation;
  const auto data = PolyDataOf(mesh.vertices, mesh.triangles);
  data->GetPointData()->SetScalars(TuplesOf<vtkUnsignedCharArray>(mesh.rgb));
  decimation->SetInputData(data);
  decimation->SetTargetReduction(1.0 -
                                 static_cast<double>(wanted) / static_cast<double>(mesh.triangles.size()));
  decimation->AttributeErrorMetricOn();
  const int warnings = vtkObject::GetGlobalWarningDisplay();
  vtkObject::GlobalWarningDisplayOff();  // it warns about every singular quadric
  decimation->Update();
  vtkObject::SetGlobalWarningDisplay(warnings);
  const SurfaceMesh thin = FromPolyData(*decimation->GetOutput());
  return RemoveTriangles(thin, std::vector<bool>(thin.triangles.size()));
}

}  // namespace

SurfaceMesh MarchSurface(const SurfaceVolume& volume, const SurfaceOptions& options) {
  std::map<Place, std::size_t> blocks;
  std::set<Place> parts;
  for (std::size_t b = 0; b < volume.places.size(); ++b) {
    blocks.emplace(volume.places[b], b);
    Place part = volume.places[b];
    for (std::int32_t& coordinate : part) {
      coordinate = static_cast<std::int32_t>(std::floor(static_cast<double>(coordinate) / kChunk));
    }
    parts.insert(part);
  }
  SurfaceBuilder builder(volume.voxel);
  Chunk chunk;
  for (const Place& part : parts) {
    chunk.Fill(volume, blocks, part);
    vtkNew<vtkFlyingEdges3D> march;
    march->SetInputData(chunk.Image());
    march->SetValue(0, 0.0);
    march->ComputeNormalsOff();
    march->ComputeScalarsOff();
    march->Update();
    builder.Add(chunk, part, *march->GetOutput());
  }
  return Simplified(RemoveIslands(builder.Take(), options.min_island), options.max_triangles);
}

void MarkFirstSeen(const DepthRecording& depths, SurfaceMesh& mesh) {
  constexpr double kDepthTolerance =
      0.04;  // relative to the depth; the fused surface averages the depth maps
  constexpr std::size_t kBatch = 1 << 14;
  constexpr std::int32_t kUnseen = std::numeric_limits<std::int32_t>::max();
  mesh.frames.assign(mesh.vertices.size(), kUnseen);
  std::int32_t last = 0;
  for (const std::int64_t keyframe : depths.Keyframes()) {
    const DepthMap map = depths.Kept(keyframe);
    const Rigid3d T_camera_map = map.T_map_camera.Inverse();
    last = static_cast<std::int32_t>(map.frame_index);
    ParallelFor(mesh.vertices.size() / kBatch + 1, 0, [&](std::size_t part) {
      const std::size_t end = std::min(mesh.vertices.size(), (part + 1) * kBatch);
      for (std::size_t i = part * kBatch; i < end; ++i) {
        if (mesh.frames[i] != kUnseen) {
          continue;
        }
        const Eigen::Vector3d p = T_camera_map * mesh.vertices[i].cast<double>();
        const Eigen::Vector2d pixel = p.z() > 0.0 ? map.camera.Project(p) : Eigen::Vector2d(-1.0, -1.0);
        const cv::Point at(cvRound(pixel.x()), cvRound(pixel.y()));
        if (cv::Rect({}, map.depth.size()).contains(at) &&
            std::abs(map.depth.at<float>(at) - p.z()) < kDepthTolerance * p.z()) {
          mesh.frames[i] = last;
        }
      }
    });
  }
  // Vertices that no depth map shows (depth too far off, or a hole that the surface closes) take the frame of
  // a neighbour, the earlier one of two.
  for (bool found = true; found;) {
    found = false;
    for (const auto& triangle : mesh.triangles) {
      for (std::size_t k = 0; k < 3; ++k) {
        std::int32_t& frame = mesh.frames[triangle[k]];
        const std::int32_t other =
            std::min(mesh.frames[triangle[(k + 1) % 3]], mesh.frames[triangle[(k + 2) % 3]]);
        if (frame == kUnseen && other != kUnseen) {
          frame = other;
          found = true;
        }
      }
    }
  }
  std::ranges::replace(mesh.frames, kUnseen, last);
}

}  // namespace sqslam
