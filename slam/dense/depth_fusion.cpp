#include "slam/dense/depth_fusion.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "slam/dense/cloud_pieces.h"
#include "slam/dense/plane_fill.h"
#include "slam/util/parallel.h"
#include "slam/util/statistics.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

// Interpolates the depth between pixels, from those of the four neighbours that are near `expected`; 0 if
// there is none.
double DepthNear(const cv::Mat& depth, double u, double v, double expected, double tolerance) {
  const int x = static_cast<int>(u);
  const int y = static_cast<int>(v);
  double sum = 0.0, weights = 0.0;
  for (int dy = 0; dy < 2; ++dy) {
    for (int dx = 0; dx < 2; ++dx) {
      const double z = depth.at<float>(y + dy, x + dx);
      if (std::abs(z - expected) <= tolerance) {
        const double weight = (1.0 - std::abs(u - x - dx)) * (1.0 - std::abs(v - y - dy)) + 1e-6;
        sum += weight * z;
        weights += weight;
      }
    }
  }
  return weights > 0.0 ? sum / weights : 0.0;
}

// Returns true if the map's surface at the pixel lies clearly behind `expected`.
bool SeesThrough(const cv::Mat& depth, const Eigen::Vector2d& pixel, double expected) {
  constexpr double kMinGap = 3.0 * kMaxDepthDifference;  // share of the depth
  return depth.at<float>(static_cast<int>(pixel.y() + 0.5), static_cast<int>(pixel.x() + 0.5)) >
         (1.0 + kMinGap) * expected;
}

}  // namespace

DepthMap KeepConsistent(const DepthMap& map, const std::vector<DepthMap>& neighbours, int min_views) {
  DepthMap kept = map;
  kept.depth = cv::Mat(map.depth.size(), CV_32F, cv::Scalar(0));
  kept.views = cv::Mat(map.depth.size(), CV_8U, cv::Scalar(0));
  const std::vector<Rigid3d> T_neighbour_map =
      ToVector(neighbours, [](const DepthMap& neighbour) { return neighbour.T_map_camera.Inverse(); });
  for (int y = 0; y < map.depth.rows; ++y) {
    for (int x = 0; x < map.depth.cols; ++x) {
      const double z = map.depth.at<float>(y, x);
      if (!(z > 0.0)) {
        continue;
      }
      const Eigen::Vector3d p_map = map.PointAt(x, y);
      double ratios = 1.0;
      int views = 0, against = 0;
      for (std::size_t i = 0; i < neighbours.size(); ++i) {
        const DepthMap& other = neighbours[i];
        const Eigen::Vector3d p = T_neighbour_map[i] * p_map;
        if (!(p.z() > 0.0)) {
          continue;
        }
        const Eigen::Vector2d pixel = other.camera.Project(p);
        if (!(pixel.x() >= 0.0 && pixel.y() >= 0.0 && pixel.x() < other.depth.cols - 1 &&
              pixel.y() < other.depth.rows - 1)) {
          continue;
        }
        const double seen = DepthNear(other.depth, pixel.x(), pixel.y(), p.z(), kMaxDepthDifference * p.z());
        if (seen > 0.0) {
          ratios += seen / p.z();
          ++views;
        } else if (SeesThrough(other.depth, pixel, p.z())) {
          ++against;
        }
      }
      if (views >= std::max(min_views, against)) {
        kept.depth.at<float>(y, x) = static_cast<float>(z * ratios / (1 + views));
        kept.views.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(views);
      }
    }
  }
  return kept;
}

namespace {

// Depth maps of a batch: those that the next batch needs too are decoded once.
class DepthCache {
 public:
  DepthCache(int threads, std::function<DepthMap(std::int64_t)> read)
      : threads_(threads), read_(std::move(read)) {}

  // Reads the missing depth maps of these keyframes in parallel, and drops all others.
  void Load(const std::set<std::int64_t>& keyframes) {
    std::erase_if(maps_, [&](const auto& map) { return !keyframes.contains(map.first); });
    std::vector<std::pair<std::int64_t, DepthMap*>> missing;
    for (const std::int64_t keyframe : keyframes) {
      if (const auto [map, fresh] = maps_.try_emplace(keyframe); fresh) {
        missing.emplace_back(keyframe, &map->second);
      }
    }
    ParallelFor(missing.size(), threads_,
                [&](std::size_t i) { *missing[i].second = read_(missing[i].first); });
  }
  const DepthMap& Get(std::int64_t keyframe) const { return maps_.at(keyframe); }

 private:
  int threads_;
  std::function<DepthMap(std::int64_t)> read_;
  std::map<std::int64_t, DepthMap> maps_;
};

// Returns the edge of the cloud's cubes: a pixel at the median depth of the map points.
double SpacingOf(const DenseInput& input, const std::vector<KeyframePlan>& plans) {
  std::vector<double> depths;
  for (std::size_t k = 0; k < plans.size(); ++k) {
    const Rigid3d T_camera_map = input.keyframes[k].T_map_camera.Inverse();
    for (const Eigen::Vector3d& p : plans[k].in_view) {
      depths.push_back((T_camera_map * p).z());
    }
  }
  return UpperMedian(std::move(depths)) / input.camera.fx;
}

// A keyframe with an estimated depth, and the others that it is compared with.
struct Neighbourhood {
  std::int64_t keyframe = 0;  // id
  std::vector<std::int64_t> neighbours;
};

std::vector<Neighbourhood> NeighbourhoodsOf(const DenseInput& input, const std::vector<KeyframePlan>& plans,
                                            const std::vector<std::int64_t>& estimated) {
  std::vector<PosedFrame> keyframes;
  std::vector<std::size_t> positions;
  for (std::size_t k = 0; k < input.keyframes.size(); ++k) {
    if (std::ranges::find(estimated, input.ids[k]) != estimated.end()) {
      keyframes.push_back(input.keyframes[k]);
      positions.push_back(k);
    }
  }
  std::vector<Neighbourhood> all;
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    const std::vector<std::size_t> chosen =
        ChooseNeighbours(i, keyframes, plans[positions[i]].in_view, input.camera, kNeighbours);
    all.push_back(
        {input.ids[positions[i]], ToVector(chosen, [&](std::size_t n) { return input.ids[positions[n]]; })});
  }
  return all;
}

constexpr std::size_t kBatch = 8;  // depth maps read and processed at a time

// Records the result of `make` for each depth map. Returns false if `progress` ended it.
bool ProcessAll(const std::vector<Neighbourhood>& all, DepthCache& cache, int threads,
                const std::string& state,
                const std::function<DepthMap(const DepthMap&, const std::vector<DepthMap>&)>& make,
                DepthRecording& recording, const DensifyProgress& progress) {
  for (std::size_t first = 0; first < all.size(); first += kBatch) {
    const std::size_t end = std::min(first + kBatch, all.size());
    std::set<std::int64_t> needed;
    for (std::size_t i = first; i < end; ++i) {
      needed.insert(all[i].keyframe);
      needed.insert(all[i].neighbours.begin(), all[i].neighbours.end());
    }
    cache.Load(needed);
    ParallelFor(end - first, threads, [&](std::size_t i) {
      const Neighbourhood& one = all[first + i];
      const std::vector<DepthMap> neighbours =
          ToVector(one.neighbours, [&](const std::int64_t neighbour) { return cache.Get(neighbour); });
      recording.PutKept(make(cache.Get(one.keyframe), neighbours));
    });
    if (!progress(static_cast<int>(end), static_cast<int>(all.size()), state)) {
      return false;
    }
  }
  return true;
}

// Merges the kept depth maps into a cloud.
FusedDepth Gather(const std::vector<Neighbourhood>& all, double spacing, int threads,
                  const DepthRecording& recording) {
  CloudFusion fusion(spacing, threads);
  FusedDepth fused;
  for (std::size_t first = 0; first < all.size(); first += kBatch) {
    std::vector<DepthMap> maps(std::min(kBatch, all.size() - first));
    ParallelFor(maps.size(), threads,
                [&](std::size_t i) { maps[i] = recording.Kept(all[first + i].keyframe); });
    for (const DepthMap& kept : maps) {
      const auto planes = static_cast<std::size_t>(cv::countNonZero(kept.views == kFilledByPlane));
      fused.measured += static_cast<std::size_t>(cv::countNonZero(kept.depth > 0.0)) - planes;
      fused.filled += planes;
      fusion.Add(kept);
    }
  }
  fused.cloud = fusion.Cloud();
  return fused;
}

}  // namespace

std::optional<FusedDepth> FuseDepthMaps(const DenseInput& input, const std::vector<KeyframePlan>& plans,
                                        const DenseOptions& options, int threads, DepthRecording& recording,
                                        const DensifyProgress& progress) {
  const std::vector<Neighbourhood> all = NeighbourhoodsOf(input, plans, recording.Estimated());
  CloudPieces pieces;
  {
    DepthCache estimates(threads, [&](std::int64_t keyframe) { return recording.Estimate(keyframe); });
    const auto keep = [&](const DepthMap& map, const std::vector<DepthMap>& neighbours) {
      const DepthMap kept = KeepConsistent(map, neighbours, options.fusion.min_views);
      pieces.Add(kept);
      return kept;
    };
    if (!ProcessAll(all, estimates, threads, "fused", keep, recording, progress)) {
      return std::nullopt;
    }
  }
  constexpr double kMinPiece = 0.01;  // share of an image; smaller isolated pieces of the cloud are dropped
  pieces.Join(kMinPiece * input.camera.width * input.camera.height);
  DepthCache sifted(threads, [&](std::int64_t keyframe) {
    DepthMap map = recording.Kept(keyframe);
    map.depth.setTo(0.0F, map.views == kFilledByPlane);  // fills of neighbours that were processed before
    pieces.DropSmall(map);
    return options.fill.enabled ? FillPlanes(map) : map;
  });
  const auto confirm = [&](const DepthMap& map, const std::vector<DepthMap>& neighbours) {
    return KeepConfirmedFills(map, neighbours, options.fusion.min_views);
  };
  if (!ProcessAll(all, sifted, threads, "filled", confirm, recording, progress)) {
    return std::nullopt;
  }
  return Gather(all, SpacingOf(input, plans), threads, recording);
}

}  // namespace sqslam
