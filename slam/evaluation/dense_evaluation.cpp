#include "slam/evaluation/dense_evaluation.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nanoflann.hpp>
#include <nlohmann/json.hpp>
#include <utility>

#include "slam/evaluation/known_surfaces.h"
#include "slam/geometry/eigen_system.h"
#include "slam/io/point_cloud.h"
#include "slam/io/trajectory.h"
#include "slam/snapshot/depth_recording.h"
#include "slam/snapshot/map_scale.h"
#include "slam/snapshot/recording.h"
#include "slam/util/json_file.h"
#include "slam/util/statistics.h"
#include "slam/util/throw_if.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

// Distance to the nearest point of a cloud.
class CloudDistance {
 public:
  explicit CloudDistance(std::vector<Eigen::Vector3d> points)
      : points_{std::move(points)}, tree_(3, points_, nanoflann::KDTreeSingleIndexAdaptorParams(10)) {
    tree_.buildIndex();
  }
  double To(const Eigen::Vector3d& p) const {
    std::size_t index = 0;
    double squared = 0.0;
    tree_.knnSearch(p.data(), 1, &index, &squared);
    return std::sqrt(squared);
  }

 private:
  struct Points {
    std::vector<Eigen::Vector3d> points;
    std::size_t kdtree_get_point_count() const { return points.size(); }
    double kdtree_get_pt(std::size_t i, std::size_t d) const { return points[i][static_cast<int>(d)]; }
    template <typename Box>
    bool kdtree_get_bbox(Box&) const {
      return false;
    }
  };
  Points points_;
  nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Points>, Points, 3, std::size_t>
      tree_;
};

DistanceSummary Summarized(const std::vector<double>& distances) {
  if (distances.empty()) {
    return {};
  }
  return {static_cast<int>(distances.size()), LinearQuantile(distances, 0.5), LinearQuantile(distances, 0.9)};
}

// Returns the root mean square distance of the points from a plane, over the share of points nearest to it;
// plane and selection are refined in turns.
std::optional<double> Flatness(std::vector<Eigen::Vector3d> points) {
  constexpr double kShare = 0.95;
  constexpr std::size_t kEnough = 100;
  if (points.size() < kEnough) {
    return std::nullopt;
  }
  const auto nearest = static_cast<std::ptrdiff_t>(kShare * static_cast<double>(points.size()));
  auto end = points.end();
  double rms = 0.0;
  for (int round = 0; round < 5; ++round) {
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (auto p = points.begin(); p != end; ++p) {
      mean += *p / static_cast<double>(end - points.begin());
    }
    Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
    for (auto p = points.begin(); p != end; ++p) {
      scatter += (*p - mean) * (*p - mean).transpose();
    }
    const Eigen::Vector3d normal = EigenSystemOf(scatter).vectors.col(0);
    end = points.begin() + nearest;
    std::nth_element(points.begin(), end, points.end(), [&](const auto& a, const auto& b) {
      return std::abs(normal.dot(a - mean)) < std::abs(normal.dot(b - mean));
    });
    double sum = 0.0;
    for (auto p = points.begin(); p != end; ++p) {
      sum += std::pow(normal.dot(*p - mean), 2);
    }
    rms = std::sqrt(sum / static_cast<double>(nearest));
  }
  return rms;
}

// Accumulates the errors of depth maps, pixel by pixel.
class DepthTally {
 public:
  DepthTally(const GroundTruth& truth, const fs::path& sequence, const Sim3d& S_world_map,
             const DenseEvaluationOptions& options)
      : truth_(truth),
        S_world_map_(S_world_map),
        options_(options),
        known_(truth.objects, options.min_hull_fill) {
    if (fs::exists(sequence / "dense.ply")) {
      cloud_.emplace(ReadPointCloud(sequence / "dense.ply").points);
    }
  }

  void Add(const DepthMap& map, double timestamp) {
    constexpr double kMaxTimeDifference = 0.02;  // seconds
    const std::optional<Rigid3d> true_pose = TruePoseAt(truth_.trajectory, timestamp, kMaxTimeDifference);
    pixels_ = map.depth.total();
    for (int y = 0; y < map.depth.rows; ++y) {
      for (int x = 0; x < map.depth.cols; ++x) {
        if (!(map.depth.at<float>(y, x) > 0.0F)) {
          continue;
        }
        const bool filled = map.views.at<std::uint8_t>(y, x) == kFilledByPlane;
        ++(filled ? filled_ : complete_);
        if (x % options_.stride == 0 && y % options_.stride == 0) {
          if (const auto miss = MissOf(map, x, y, true_pose)) {
            Distances& of = distances_[miss->object];
            (filled ? of.by_plane : of.measured).push_back(miss->distance);
          }
        }
      }
    }
  }

  void Summarize(DenseEvaluation& evaluation) const {
    const double all = static_cast<double>(pixels_) * evaluation.keyframes;
    evaluation.complete = static_cast<double>(complete_) / all;
    evaluation.filled = static_cast<double>(filled_) / all;
    std::vector<double> measured, by_plane, in_hollow;
    for (const auto& [object, distances] : distances_) {
      const auto& all_of = distances.measured;
      if (object != nullptr && !all_of.empty() && UpperMedian(all_of) < -options_.max_inside) {
        evaluation.hollow.push_back(ShownName(*object));
        AppendLengths(all_of, in_hollow);
      } else {
        AppendLengths(all_of, measured);
        AppendLengths(distances.by_plane, by_plane);
      }
    }
    std::ranges::sort(evaluation.hollow);
    evaluation.tested = static_cast<double>(measured.size()) * options_.stride * options_.stride / all;
    evaluation.measured = Summarized(measured);
    evaluation.by_plane = Summarized(by_plane);
    evaluation.in_hollow = Summarized(in_hollow);
  }

  const KnownSurfaces& Known() const { return known_; }

 private:
  using Miss = KnownSurfaces::Miss;
  struct Distances {
    std::vector<double> measured, by_plane;  // negative inside a solid
  };

  static void AppendLengths(const std::vector<double>& distances, std::vector<double>& lengths) {
    for (const double distance : distances) {
      lengths.push_back(std::abs(distance));
    }
  }

  std::optional<Miss> MissOf(const DepthMap& map, int x, int y,
                             const std::optional<Rigid3d>& true_pose) const {
    const Eigen::Vector3d p_world = S_world_map_ * map.PointAt(x, y);
    if (cloud_) {
      return Miss{cloud_->To(p_world), nullptr};
    }
    if (!true_pose) {
      return std::nullopt;
    }
    const Eigen::Vector3d ray = map.camera.Unproject({static_cast<double>(x), static_cast<double>(y)});
    return known_.MissOf(true_pose->translation, true_pose->rotation * ray, p_world);
  }

  const GroundTruth& truth_;
  const Sim3d& S_world_map_;
  const DenseEvaluationOptions& options_;
  const KnownSurfaces known_;
  std::optional<CloudDistance> cloud_;
  std::map<const GroundTruthObject*, Distances> distances_;  // by the object that a ray hits first
  std::size_t pixels_ = 0;                                   // pixels of one depth map
  std::size_t complete_ = 0, filled_ = 0;
};

}  // namespace

DenseEvaluation EvaluateDense(const fs::path& result, const fs::path& sequence,
                              const DenseEvaluationOptions& options) {
  constexpr double kMaxTimeDifference = 0.02;  // seconds
  const GroundTruth truth = ReadGroundTruth(sequence);
  FinishRescaling(result / "map.sqmap");
  const DepthRecording depths(result / "map.sqmap");
  const std::vector<std::int64_t> there = depths.Keyframes();
  ThrowIf<InputError>(there.empty(), "{}: holds no depth maps, expected those of sqslam densify",
                      (result / "map.sqmap").string());
  const auto aligned =
      ComputeTrajectoryError(ReadTrajectory(result / "trajectory.txt"), truth.trajectory, kMaxTimeDifference);
  ThrowIf<InputError>(!aligned, "{}: cannot be aligned, expected at least three true poses at its timestamps",
                      (result / "trajectory.txt").string());
  DepthTally tally(truth, sequence, aligned->S_world_map, options);
  DenseEvaluation evaluation;
  const MapSnapshotPtr map = RecordingReader(result / "map.sqmap").Last();
  for (const SnapshotKeyframe& keyframe : map->keyframes) {
    ++evaluation.keyframes;
    if (std::ranges::find(there, keyframe.id) != there.end()) {
      tally.Add(depths.Kept(keyframe.id), keyframe.timestamp);
    }
  }
  tally.Summarize(evaluation);
  if (fs::exists(result / "dense.ply")) {
    evaluation.top = Flatness(tally.Known().OnTable(
        ToVector(ReadPointCloud(result / "dense.ply").points,
                 [&](const Eigen::Vector3d& p_map) { return aligned->S_world_map * p_map; })));
  }
  return evaluation;
}

std::string FormatDense(const DenseEvaluation& e) {
  const auto distances = [](const DistanceSummary& s) {
    return s.count > 0 ? fmt::format("median {:.1f} mm, p90 {:.1f} mm", 1e3 * s.median, 1e3 * s.p90)
                       : std::string("no truth");
  };
  std::string text =
      fmt::format("dense: depth of {:.1f} % of the pixels of {} keyframes, {}, in {:.1f} % of the pixels\n",
                  100.0 * e.complete, e.keyframes, distances(e.measured), 100.0 * e.tested);
  if (e.filled > 0.0) {
    text += fmt::format("  filled by planes: {:.1f} %, {}\n", 100.0 * e.filled, distances(e.by_plane));
  }
  if (!e.hollow.empty()) {
    text += fmt::format("  left out as hollow, most of their points inside: {}, {}\n",
                        fmt::join(e.hollow, ", "), distances(e.in_hollow));
  }
  if (e.top) {
    text += fmt::format("  table top: flat to {:.1f} mm rms over 95 % of its points\n", 1e3 * *e.top);
  }
  return text;
}

void WriteDenseEvaluation(const fs::path& path, const DenseEvaluation& e) {
  const auto distances = [](const DistanceSummary& s) {
    return nlohmann::ordered_json{{"count", s.count}, {"median", s.median}, {"p90", s.p90}};
  };
  nlohmann::ordered_json document = {{"format", "sqslam-dense-eval"},
                                     {"version", 1},
                                     {"keyframes", e.keyframes},
                                     {"complete", e.complete},
                                     {"filled", e.filled},
                                     {"tested", e.tested},
                                     {"measured", distances(e.measured)},
                                     {"by_plane", distances(e.by_plane)},
                                     {"hollow", e.hollow},
                                     {"in_hollow", distances(e.in_hollow)}};
  if (e.top) {
    document["table_top_rms"] = *e.top;
  }
  WriteJsonFile(path, document);
}

}  // namespace sqslam
