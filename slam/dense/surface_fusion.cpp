#include "slam/dense/surface_fusion.h"

#include <algorithm>
#include <cmath>

#include "slam/dense/voxel_table.h"
#include "slam/util/parallel.h"
#include "slam/util/statistics.h"

namespace sqslam {
namespace {

constexpr int kEdge = SurfaceVolume::kEdge;
constexpr std::size_t kMapsAtOnce = 8;  // depth maps at a time

// Reads the kept depth maps of at most `most` keyframes from `first` on, in parallel.
std::vector<DepthMap> ReadKept(const DepthRecording& depths, const std::vector<std::int64_t>& keyframes,
                               std::size_t first, std::size_t most, int threads) {
  std::vector<DepthMap> maps(std::min(most, keyframes.size() - first));
  ParallelFor(maps.size(), threads, [&](std::size_t i) { maps[i] = depths.Kept(keyframes[first + i]); });
  return maps;
}

// Returns the width of a pixel at the median depth of a sample of the maps, map units.
double PixelAtMedianDepth(const DepthRecording& depths, const std::vector<std::int64_t>& keyframes) {
  constexpr std::size_t kMaps = 20;
  constexpr int kStride = 8;  // pixels
  std::vector<double> widths;
  for (std::size_t i = 0; i < keyframes.size(); i += std::max<std::size_t>(1, keyframes.size() / kMaps)) {
    const DepthMap map = depths.Kept(keyframes[i]);
    for (int y = 0; y < map.depth.rows; y += kStride) {
      for (int x = 0; x < map.depth.cols; x += kStride) {
        if (const float z = map.depth.at<float>(y, x); z > 0.0F) {
          widths.push_back(z / map.camera.fx);
        }
      }
    }
  }
  return widths.empty() ? 0.0 : UpperMedian(std::move(widths));
}

using Places = std::vector<SurfaceVolume::Place>;

void SortUniquely(Places& places) {
  std::ranges::sort(places);
  places.erase(std::unique(places.begin(), places.end()), places.end());
}

// Adds the blocks that the rays of a map's pixels cross within the truncation of their surfaces.
void AddPlaces(const DepthMap& map, double voxel, Places& places) {
  const double truncation = kTruncation * voxel;
  constexpr int kStride = 2;             // pixels
  constexpr double kCentreOffset = 0.5;  // voxels have their centres at whole numbers
  const double step = 0.5 * kEdge * voxel;
  const Eigen::Vector3d& center = map.T_map_camera.translation;
  for (int y = 0; y < map.depth.rows; y += kStride) {
    for (int x = 0; x < map.depth.cols; x += kStride) {
      if (!(map.depth.at<float>(y, x) > 0.0F)) {
        continue;
      }
      const Eigen::Vector3d p = map.PointAt(x, y);
      const Eigen::Vector3d ray = (p - center).normalized();
      for (double along = -truncation; along <= truncation + 0.5 * step; along += step) {
        const Eigen::Array3d in_blocks =
            ((p + std::min(along, truncation) * ray) / voxel).array() / kEdge + kCentreOffset / kEdge;
        places.push_back(CubeAt(in_blocks));
      }
    }
  }
}

// Returns the blocks of all maps, or nothing if there are more than `most`.
std::optional<Places> PlacesOf(const DepthRecording& depths, const std::vector<std::int64_t>& keyframes,
                               double voxel, std::size_t most, int threads) {
  Places places;
  for (std::size_t first = 0; first < keyframes.size(); first += kMapsAtOnce) {
    const std::vector<DepthMap> maps = ReadKept(depths, keyframes, first, kMapsAtOnce, threads);
    std::vector<Places> of_map(maps.size());
    ParallelFor(maps.size(), threads, [&](std::size_t i) {
      AddPlaces(maps[i], voxel, of_map[i]);
      SortUniquely(of_map[i]);
    });
    for (const Places& some : of_map) {
      places.insert(places.end(), some.begin(), some.end());
    }
    SortUniquely(places);
    if (places.size() > most) {
      return std::nullopt;
    }
  }
  return places;
}

void AddSample(double distance, double weight, const cv::Vec3b& bgr, SurfaceVolume::Voxel& voxel) {
  const double share = weight / (voxel.weight + weight);
  const auto mean = [share](double old, double now) { return old + share * (now - old); };
  voxel.distance = static_cast<float>(mean(voxel.distance, distance));
  for (int i = 0; i < 3; ++i) {
    std::uint16_t& color = voxel.rgb[static_cast<std::size_t>(i)];
    color = static_cast<std::uint16_t>(mean(color, 256.0 * bgr[2 - i]) + 0.5);
  }
  voxel.weight += static_cast<float>(weight);
}

// A block in the frame of a depth map's camera.
struct BlockInView {
  Eigen::Vector3d first;  // centre of its first voxel
  Eigen::Matrix3d steps;  // from a voxel to the next along x, y, z: columns
  double radius = 0.0;    // of its bounding sphere

  bool MayBeSeen(const Camera& camera) const {
    const Eigen::Vector3d center = first + steps * Eigen::Vector3d::Constant(0.5 * (kEdge - 1));
    if (center.z() < -radius) {
      return false;
    }
    const double z = std::max(center.z(), 1e-9);
    const double reach = radius / std::max(z - radius, 1e-9);
    const Eigen::Vector2d pixel = camera.Project({center.x(), center.y(), z});
    return z <= radius || (pixel.x() > -reach * camera.fx && pixel.x() < camera.width + reach * camera.fx &&
                           pixel.y() > -reach * camera.fy && pixel.y() < camera.height + reach * camera.fy);
  }
};

void IntegrateInto(const DepthMap& map, const BlockInView& view, double truncation,
                   SurfaceVolume::Block& block) {
  const Camera& camera = map.camera;
  std::size_t i = 0;
  for (int z = 0; z < kEdge; ++z) {
    for (int y = 0; y < kEdge; ++y) {
      Eigen::Vector3d p = view.first + y * view.steps.col(1) + z * view.steps.col(2);
      for (int x = 0; x < kEdge; ++x, ++i, p += view.steps.col(0)) {
        if (!(p.z() > 0.0)) {
          continue;
        }
        const double right = camera.fx * p.x() / p.z() + camera.cx + 0.5;
        const double down = camera.fy * p.y() / p.z() + camera.cy + 0.5;
        if (!(right >= 0.0 && down >= 0.0 && right < map.depth.cols && down < map.depth.rows)) {
          continue;
        }
        const int u = static_cast<int>(right);
        const int v = static_cast<int>(down);
        const double depth = map.depth.at<float>(v, u);
        const double distance = (depth - p.z()) / truncation;
        if (!(depth > 0.0) || distance < -1.0) {
          continue;
        }
        const double sigma = depth * map.SigmaAt(u, v);
        AddSample(std::min(distance, 1.0), 1.0 / (sigma * sigma), map.bgr.at<cv::Vec3b>(v, u), block[i]);
      }
    }
  }
}

// Integrates a depth map into blocks first_block to end_block - 1.
void IntegrateDepth(const DepthMap& map, std::size_t first_block, std::size_t end_block,
                    SurfaceVolume& volume) {
  const Rigid3d T_camera_map = map.T_map_camera.Inverse();
  BlockInView view;
  view.steps = volume.voxel * T_camera_map.RotationMatrix();
  view.radius = 0.5 * std::sqrt(3.0) * kEdge * volume.voxel;
  for (std::size_t b = first_block; b < end_block; ++b) {
    const auto& [x, y, z] = volume.places[b];
    view.first = T_camera_map * (volume.voxel * kEdge * Eigen::Vector3d(x, y, z));
    if (view.MayBeSeen(map.camera)) {
      IntegrateInto(map, view, kTruncation * volume.voxel, volume.blocks[b]);
    }
  }
}

}  // namespace

std::optional<SurfaceVolume> FuseSurface(const DepthRecording& depths, const SurfaceOptions& options,
                                         int threads, const DensifyProgress& progress) {
  constexpr double kVoxelGrowth = 1.3;
  const std::vector<std::int64_t> keyframes = depths.Keyframes();
  const double pixel = PixelAtMedianDepth(depths, keyframes);
  if (!(pixel > 0.0)) {
    return std::nullopt;
  }
  const auto most = static_cast<std::size_t>(options.memory_mib * 1048576.0 / sizeof(SurfaceVolume::Block));
  SurfaceVolume volume;
  volume.voxel = options.voxel * pixel;
  std::optional<Places> places;
  while (!(places = PlacesOf(depths, keyframes, volume.voxel, most, threads))) {
    volume.voxel *= kVoxelGrowth;
  }
  volume.places = std::move(*places);
  volume.blocks.resize(volume.places.size());

  constexpr std::size_t kParts = 64;  // of the blocks: each takes the maps in the same order
  for (std::size_t first = 0; first < keyframes.size(); first += kMapsAtOnce) {
    const std::vector<DepthMap> maps = ReadKept(depths, keyframes, first, kMapsAtOnce, threads);
    ParallelFor(kParts, threads, [&](std::size_t part) {
      for (const DepthMap& map : maps) {
        IntegrateDepth(map, volume.blocks.size() * part / kParts, volume.blocks.size() * (part + 1) / kParts,
                       volume);
      }
    });
    if (!progress(static_cast<int>(first + maps.size()), static_cast<int>(keyframes.size()), "surface")) {
      return std::nullopt;
    }
  }
  return volume;
}

}  // namespace sqslam
