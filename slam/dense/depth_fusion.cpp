#include "slam/dense/depth_fusion.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "slam/dense/cloud_pieces.h"
#include "slam/dense/plane_fill.h"
#include "slam/util/parallel.h"
#include "slam/util/statistics.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

struct UncertainDepth {
  double depth = 0.0;  // 0: unknown
  double sigma = 0.0;  // share of the depth
};

// Interpolates the depth between pixels, from those of the four neighbours that are near `expected`.
UncertainDepth DepthNear(const DepthMap& map, double u, double v, double expected, double tolerance) {
  const int x = static_cast<int>(u);
  const int y = static_cast<int>(v);
  double depth = 0.0, sigma = 0.0, weights = 0.0;
  for (int dy = 0; dy < 2; ++dy) {
    for (int dx = 0; dx < 2; ++dx) {
      const double z = map.depth.at<float>(y + dy, x + dx);
      if (std::abs(z - expected) <= tolerance) {
        const double weight = (1.0 - std::abs(u - x - dx)) * (1.0 - std::abs(v - y - dy)) + 1e-6;
        depth += weight * z;
        sigma += weight * map.SigmaAt(x + dx, y + dy);
        weights += weight;
      }
    }
  }
  return weights > 0.0 ? UncertainDepth{depth / weights, sigma / weights} : UncertainDepth{};
}

// Mean of depths of one surface, as ratios to the first.
class DepthMean {
 public:
  explicit DepthMean(double sigma) { Add(1.0, sigma); }

  // `sigma`: share of the depth.
  void Add(double ratio, double sigma) {
    const double weight = 1.0 / (sigma * sigma);
    sum_ += weight * ratio;
    squares_ += weight * ratio * ratio;
    weights_ += weight;
    ++count_;
  }

  double Ratio() const { return sum_ / weights_; }

  // Returns the standard deviation of the mean, larger if the depths differ by more than theirs predict.
  double Sigma() const {
    constexpr double kSharedErrors =
        5.0;  // times the variance: of poses, texture and light, which neighbours share
    const double excess = count_ > 1 ? (squares_ - sum_ * sum_ / weights_) / (count_ - 1) : 1.0;
    return std::sqrt(kSharedErrors * std::max(excess, 1.0) / weights_);
  }

 private:
  double sum_ = 0.0, squares_ = 0.0, weights_ = 0.0;
  int count_ = 0;
};

// Returns true if the map's surface at the pixel lies clearly behind `expected`.
bool SeesThrough(const cv::Mat& depth, const Eigen::Vector2d& pixel, double expected) {
  constexpr double kMinGap = 3.0 * kMaxDepthDifference;  // share of the depth
  return depth.at<float>(static_cast<int>(pixel.y() + 0.5), static_cast<int>(pixel.x() + 0.5)) >
         (1.0 + kMinGap) * expected;
}

// A depth map that another one is compared with.
struct Neighbour {
  const DepthMap* map;
  Rigid3d T_camera_map;

  // Returns pixel and depth at which it would see a point, or nothing if that is outside.
  std::optional<Eigen::Vector3d> Place(const Eigen::Vector3d& p_map) const {
    const Eigen::Vector3d p = T_camera_map * p_map;
    if (!(p.z() > 0.0)) {
      return std::nullopt;
    }
    const Eigen::Vector2d pixel = map->camera.Project(p);
    const bool inside = pixel.x() >= 0.0 && pixel.y() >= 0.0 && pixel.x() < map->depth.cols - 1 &&
                        pixel.y() < map->depth.rows - 1;
    return inside ? std::optional(Eigen::Vector3d(pixel.x(), pixel.y(), p.z())) : std::nullopt;
  }
};

// Returns by how much the depths of one surface differ more than their standard deviations predict, at least
// 1: where poses are worse than assumed, by a rolling shutter for example, all depths of a map suffer.
double Disagreement(const DepthMap& map, const std::vector<Neighbour>& neighbours) {
  constexpr int kStride = 5;                // pixels
  constexpr double kMaxGap = 0.05;          // between depths of one surface, share of the depth
  constexpr double kNormalMedian = 0.6745;  // of the absolute values of a standard normal variable
  std::vector<double> differences;
  for (int y = 0; y < map.depth.rows; y += kStride) {
    for (int x = 0; x < map.depth.cols; x += kStride) {
      if (!(map.depth.at<float>(y, x) > 0.0F)) {
        continue;
      }
      const Eigen::Vector3d p_map = map.PointAt(x, y);
      for (const Neighbour& other : neighbours) {
        const auto place = other.Place(p_map);
        if (!place) {
          continue;
        }
        const double z = place->z();
        const UncertainDepth seen = DepthNear(*other.map, place->x(), place->y(), z, kMaxGap * z);
        if (seen.depth > 0.0) {
          differences.push_back(std::abs(seen.depth / z - 1.0) / std::hypot(seen.sigma, map.SigmaAt(x, y)));
        }
      }
    }
  }
  return differences.empty() ? 1.0 : std::max(1.0, UpperMedian(std::move(differences)) / kNormalMedian);
}

}  // namespace

DepthMap KeepConsistent(const DepthMap& map, const std::vector<DepthMap>& neighbours,
                        const DepthFusionOptions& options) {
  DepthMap kept = map;
  kept.depth = cv::Mat(map.depth.size(), CV_32F, cv::Scalar(0));
  kept.sigma = cv::Mat(map.depth.size(), CV_32F, cv::Scalar(0));
  kept.views = cv::Mat(map.depth.size(), CV_8U, cv::Scalar(0));
  const std::vector<Neighbour> others = ToVector(neighbours, [](const DepthMap& neighbour) {
    return Neighbour{&neighbour, neighbour.T_map_camera.Inverse()};
  });
  const double disagreement = Disagreement(map, others);
  for (int y = 0; y < map.depth.rows; ++y) {
    for (int x = 0; x < map.depth.cols; ++x) {
      const double z = map.depth.at<float>(y, x);
      if (!(z > 0.0)) {
        continue;
      }
      const Eigen::Vector3d p_map = map.PointAt(x, y);
      DepthMean mean(map.SigmaAt(x, y));
      int views = 0, against = 0;
      for (const Neighbour& other : others) {
        const auto place = other.Place(p_map);
        if (!place) {
          continue;
        }
        const double expected = place->z();
        const UncertainDepth seen =
            DepthNear(*other.map, place->x(), place->y(), expected, kMaxDepthDifference * expected);
        if (seen.depth > 0.0) {
          mean.Add(seen.depth / expected, seen.sigma);
          ++views;
        } else if (SeesThrough(other.map->depth, place->head<2>(), expected)) {
          ++against;
        }
      }
      const double sigma = disagreement * mean.Sigma();
      if (views >= std::max(options.min_views, against) && sigma <= options.max_sigma) {
        kept.depth.at<float>(y, x) = static_cast<float>(z * mean.Ratio());
        kept.sigma.at<float>(y, x) = static_cast<float>(sigma);
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
      const DepthMap kept = KeepConsistent(map, neighbours, options.fusion);
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
    return KeepConfirmedFills(map, neighbours, options.fusion);
  };
  if (!ProcessAll(all, sifted, threads, "filled", confirm, recording, progress)) {
    return std::nullopt;
  }
  return Gather(all, SpacingOf(input, plans), threads, recording);
}

}  // namespace sqslam
