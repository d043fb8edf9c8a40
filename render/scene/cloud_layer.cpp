#include "render/scene/cloud_layer.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "slam/snapshot/depth_recording.h"
#include "slam/util/statistics.h"
#include "slam/util/to_vector.h"
#include "slam/util/worker_thread.h"

namespace sqslam {
namespace {

KeyIndex<3>::Key CubeOf(const Eigen::Vector3f& p, double edge) {
  constexpr double kMaxCube = (1 << 20) - 1;  // far points share the outermost cubes
  const Eigen::Array3i cube =
      (p.cast<double>().array() / edge).floor().max(-kMaxCube).min(kMaxCube).cast<int>();
  return {cube[0], cube[1], cube[2]};
}

}  // namespace

CloudLayerBuilder::CloudLayerBuilder(double spacing, std::size_t most) : spacing_(spacing), most_(most) {}

void CloudLayerBuilder::Add(std::span<const Source> points) {
  const auto cubes = ToVector(points, [&](const Source& point) { return CubeOf(point.p_map, spacing_); });
  cubes_.InsertAll(cubes, [&](std::size_t i, std::uint32_t index, bool is_new) {
    const auto& [p_map, rgb, distance, weight, frame] = points[i];
    if (is_new) {
      cells_.push_back({.first = p_map, .distance = distance, .frame = frame});
    }
    Cell& cell = cells_[index];
    cell.position += weight * (p_map - cell.first);
    cell.rgb += weight * Eigen::Vector3f(rgb[0], rgb[1], rgb[2]);
    cell.weight += weight;
    cell.distance = std::min(cell.distance, distance);
  });
  while (cells_.size() > most_) {
    Coarsen();
  }
}

void CloudLayerBuilder::Add(const DepthMap& map) {
  std::vector<Source> row;
  for (int y = 0; y < map.depth.rows; ++y) {
    const auto* depth = map.depth.ptr<float>(y);
    const auto* bgr = map.bgr.ptr<cv::Vec3b>(y);
    row.clear();
    for (int x = 0; x < map.depth.cols; ++x) {
      if (const float z = depth[x]; z > 0.0F) {
        row.push_back({map.PointAt(x, y).cast<float>(),
                       {bgr[x][2], bgr[x][1], bgr[x][0]},
                       z / static_cast<float>(map.camera.fx),
                       1.0F / (z * z),
                       static_cast<std::int32_t>(map.frame_index)});
      }
    }
    Add(row);
  }
}

void CloudLayerBuilder::Coarsen() {
  spacing_ *= 2.0;
  cubes_ = KeyIndex<3>(cells_.size() / 3);
  std::vector<Cell> before;
  std::swap(before, cells_);
  const auto cubes = ToVector(before, [&](const Cell& cell) { return CubeOf(cell.first, spacing_); });
  cubes_.InsertAll(cubes, [&](std::size_t i, std::uint32_t index, bool is_new) {
    const Cell& cell = before[i];
    if (is_new) {
      cells_.push_back(cell);
      return;
    }
    Cell& sum = cells_[index];
    sum.position += cell.position + cell.weight * (cell.first - sum.first);
    sum.rgb += cell.rgb;
    sum.weight += cell.weight;
    sum.distance = std::min(sum.distance, cell.distance);
  });
}

// Each even level keeps the first point in every cube of twice the edge. The odd level in between also keeps
// the points in every second cube, in a checkerboard pattern.
void CloudLayerBuilder::Rank(CloudLayer& layer) const {
  std::vector<std::int32_t> level(layer.points.size());
  for (std::size_t i = 0; i < level.size(); ++i) {
    level[i] = static_cast<std::int32_t>(i);
  }
  double edge = spacing_;
  for (int rank = 1; rank < CloudLayer::kRanks; rank += 2, edge *= 2.0) {
    const auto in_cube = [&](std::int32_t index) { return cells_[static_cast<std::size_t>(index)].first; };
    const auto wide = ToVector(level, [&](std::int32_t index) { return CubeOf(in_cube(index), 2.0 * edge); });
    std::vector<std::int32_t> next;
    KeyIndex<3>(level.size() / 3).InsertAll(wide, [&](std::size_t i, std::uint32_t, bool is_new) {
      CloudPoint& point = layer.points[static_cast<std::size_t>(level[i])];
      if (is_new) {
        point.rank = static_cast<std::uint8_t>(rank + 1);
        next.push_back(level[i]);
      } else if (const auto [x, y, z] = CubeOf(in_cube(level[i]), edge); ((x + y + z) & 1) == 0) {
        point.rank = static_cast<std::uint8_t>(rank);
      }
    });
    level = std::move(next);
  }
}

CloudLayerPtr CloudLayerBuilder::Finish() const {
  auto layer = std::make_shared<CloudLayer>();
  layer->spacing = spacing_;
  layer->points.reserve(cells_.size());
  for (const Cell& cell : cells_) {
    CloudPoint& point = layer->points.emplace_back();
    point.p_map = cell.first + cell.position / cell.weight;
    point.spacing = std::max(cell.distance, static_cast<float>(spacing_));
    for (int i = 0; i < 3; ++i) {
      point.rgb[static_cast<std::size_t>(i)] =
          static_cast<std::uint8_t>(std::clamp(std::lround(cell.rgb[i] / cell.weight), 0L, 255L));
    }
    point.frame = cell.frame;
  }
  Rank(*layer);
  return layer;
}

std::vector<Eigen::Vector3d> EvenSample(const CloudLayer& cloud, std::size_t most) {
  std::vector<Eigen::Vector3d> level;
  for (int rank = 0; rank < CloudLayer::kRanks && (rank == 0 || level.size() > most); ++rank) {
    level.clear();
    for (const CloudPoint& point : cloud.points) {
      if (point.rank >= rank) {
        level.push_back(point.p_map.cast<double>());
      }
    }
  }
  const std::size_t stride = level.size() / std::max<std::size_t>(most, 1) + 1;
  std::vector<Eigen::Vector3d> sample;
  for (std::size_t i = 0; i < level.size(); i += stride) {
    sample.push_back(level[i]);
  }
  return sample;
}

double SpacingOf(const std::vector<Eigen::Vector3f>& points) {
  // Cubes with two points on average are sqrt(2) times as wide as the spacing of points on a surface.
  constexpr double kPointsPerCube = 2.0;
  constexpr int kRounds = 8;
  Eigen::AlignedBox3f box;
  for (const Eigen::Vector3f& p : points) {
    box.extend(p);
  }
  const double extent = points.empty() ? 1.0 : std::max(static_cast<double>(box.diagonal().norm()), 1e-6);
  double edge = extent / std::sqrt(static_cast<double>(points.size()) + 1.0);
  for (int round = 0; round < kRounds; ++round) {
    KeyIndex<3> cubes(points.size() / 2);
    for (const Eigen::Vector3f& p : points) {
      cubes.Insert(CubeOf(p, edge));
    }
    const double per_cube = static_cast<double>(points.size()) / std::max<double>(cubes.Size(), 1.0);
    edge = std::clamp(edge * std::sqrt(kPointsPerCube / std::max(per_cube, 1e-9)), 1e-5 * extent, extent);
  }
  return edge / std::sqrt(kPointsPerCube);
}

CloudLayerPtr ReadCloudLayer(const std::filesystem::path& recording) {
  const DepthRecording depths(recording);
  const std::vector<std::int64_t> keyframes = depths.Keyframes();
  // The cube's edge is a pixel at the median depth of a few depth maps from the whole run.
  constexpr std::size_t kSampledMaps = 5;
  std::vector<double> pixels;
  for (std::size_t i = 0; i < std::min(kSampledMaps, keyframes.size()); ++i) {
    const DepthMap map = depths.Kept(keyframes[i * keyframes.size() / kSampledMaps]);
    for (auto z = map.depth.begin<float>(); z != map.depth.end<float>(); ++z) {
      if (*z > 0.0F) {
        pixels.push_back(*z / map.camera.fx);
      }
    }
  }
  if (pixels.empty()) {
    return nullptr;
  }
  CloudLayerBuilder builder(LowerQuantile(std::move(pixels), 0.5));
  WorkerThread<DepthMap> adder(2, [&](const DepthMap& map) { builder.Add(map); });  // while the next is read
  for (const std::int64_t keyframe : keyframes) {
    adder.Add(depths.Kept(keyframe));
  }
  adder.Finish();
  return builder.Finish();
}

}  // namespace sqslam
