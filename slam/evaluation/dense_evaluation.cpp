#include "slam/evaluation/dense_evaluation.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <nanoflann.hpp>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "slam/io/point_cloud.h"
#include "slam/io/trajectory.h"
#include "slam/snapshot/depth_recording.h"
#include "slam/snapshot/recording.h"
#include "slam/util/error.h"
#include "slam/util/json_file.h"
#include "slam/util/statistics.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

constexpr double kFar = std::numeric_limits<double>::infinity();

// A plane on which solids stand: `up` . p = height.
struct StandPlane {
  double height = 0.0;
  int solids = 0;
  std::vector<cv::Point2f> footprints;  // corners, along the plane's axes
  std::vector<cv::Point2f> hull;
};

// The known part of a scene: solids, and planes on which they stand.
class KnownSurfaces {
 public:
  KnownSurfaces(const std::vector<GroundTruthObject>& objects, const DenseEvaluationOptions& options)
      : objects_(objects), options_(options) {
    if (objects.empty()) {
      return;
    }
    up_ = objects.front().solid.T_map_object.rotation * Eigen::Vector3d::UnitZ();
    along_ = up_.unitOrthogonal();
    across_ = up_.cross(along_);
    for (const GroundTruthObject& object : objects) {
      AddFootprint(object.solid);
    }
    for (StandPlane& plane : planes_) {
      cv::convexHull(plane.footprints, plane.hull);
    }
  }

  // Distance of a point from the surface that a ray hits first; empty where it hits none, or one that is not
  // known well enough.
  std::optional<double> Distance(const Eigen::Vector3d& origin, const Eigen::Vector3d& ray,
                                 const Eigen::Vector3d& p_world) const {
    double nearest = kFar;
    const GroundTruthObject* hit = nullptr;
    for (const GroundTruthObject& object : objects_) {
      if (const double along = HitSolid(object.solid, origin, ray); along < nearest) {
        nearest = along;
        hit = &object;
      }
    }
    const StandPlane* on = nullptr;
    for (const StandPlane& plane : planes_) {
      const double along = (plane.height - up_.dot(origin)) / up_.dot(ray);
      if (along > 0.0 && along < nearest && Within(plane, origin + along * ray)) {
        nearest = along;
        on = &plane;
      }
    }
    if (on != nullptr) {
      return DistanceToPlanes(on->height, up_.dot(p_world));
    }
    const auto& hollow = options_.hollow_labels;
    if (hit == nullptr || hit->hull_fill < options_.min_hull_fill ||
        std::find(hollow.begin(), hollow.end(), hit->label) != hollow.end()) {
      return std::nullopt;
    }
    return DistanceTo(hit->solid, p_world);
  }

  // The points of a cloud (world frame) that lie on the table's top; empty without a table.
  std::vector<Eigen::Vector3d> OnTable(const std::vector<Eigen::Vector3d>& cloud) const {
    constexpr double kThick = 0.03;   // metres, above and below
    constexpr double kMargin = 0.02;  // about things on it, and along its border
    const std::optional<StandPlane> table = Table();
    std::vector<Eigen::Vector3d> points;
    for (const Eigen::Vector3d& p : cloud) {
      if (table && std::abs(up_.dot(p) - table->height) <= kThick && Within(*table, p, kMargin) &&
          std::none_of(objects_.begin(), objects_.end(), [&](const GroundTruthObject& object) {
            return StandsOver(object.solid, *table, p, kMargin);
          })) {
        points.push_back(p);
      }
    }
    return points;
  }

 private:
  cv::Point2f OnPlane(const Eigen::Vector3d& p) const {
    return {static_cast<float>(along_.dot(p)), static_cast<float>(across_.dot(p))};
  }
  bool Within(const StandPlane& plane, const Eigen::Vector3d& p, double margin = 0.0) const {
    return cv::pointPolygonTest(plane.hull, OnPlane(p), true) >= margin;
  }
  std::vector<cv::Point2f> Footprint(const Solid& solid) const {
    std::vector<cv::Point2f> corners;
    for (const double x : {-1.0, 1.0}) {
      for (const double y : {-1.0, 1.0}) {
        corners.push_back(OnPlane(solid.T_map_object *
                                  Eigen::Vector3d(x * solid.half_size.x(), y * solid.half_size.y(), 0.0)));
      }
    }
    return corners;
  }
  double Bottom(const Solid& solid) const {
    return up_.dot(solid.T_map_object.translation) - solid.half_size.z();
  }

  void AddFootprint(const Solid& solid) {
    constexpr double kSame = 0.003;  // metres
    const double bottom = Bottom(solid);
    auto plane = std::find_if(planes_.begin(), planes_.end(),
                              [&](const StandPlane& p) { return std::abs(p.height - bottom) < kSame; });
    if (plane == planes_.end()) {
      plane = planes_.insert(plane, {bottom, 0, {}, {}});
    }
    ++plane->solids;
    for (const cv::Point2f& corner : Footprint(solid)) {
      plane->footprints.push_back(corner);
    }
  }

  // A rug lies on the floor: of planes this near to each other any may be meant.
  double DistanceToPlanes(double hit, double height) const {
    constexpr double kNear = 0.02;  // metres
    double least = kFar;
    for (const StandPlane& plane : planes_) {
      if (std::abs(plane.height - hit) < kNear) {
        least = std::min(least, std::abs(plane.height - height));
      }
    }
    return least;
  }

  // Place on the ray (in lengths of it) where it enters the solid.
  static double HitSolid(const Solid& solid, const Eigen::Vector3d& origin, const Eigen::Vector3d& ray) {
    constexpr int kSteps = 64;
    const Rigid3d T_object_world = solid.T_map_object.Inverse();
    const Eigen::Vector3d start = T_object_world * origin;
    const Eigen::Vector3d way = T_object_world.rotation * ray;
    double enter = 0.0, leave = kFar;
    for (int i = 0; i < 3; ++i) {
      const double a = (-solid.half_size[i] - start[i]) / way[i];
      const double b = (solid.half_size[i] - start[i]) / way[i];
      enter = std::max(enter, std::min(a, b));
      leave = std::min(leave, std::max(a, b));
    }
    if (!(enter < leave)) {
      return kFar;
    }
    for (int step = 0; step <= kSteps; ++step) {
      const double along = enter + (leave - enter) * step / kSteps;
      if (solid.kind == SolidKind::kCuboid || solid.RadialScale(start + along * way) <= 1.0) {
        return along;
      }
    }
    return kFar;
  }

  static double DistanceTo(const Solid& solid, const Eigen::Vector3d& p_world) {
    const Eigen::Vector3d p = solid.T_map_object.Inverse() * p_world;
    if (solid.kind != SolidKind::kCuboid) {
      return p.norm() * std::abs(1.0 - 1.0 / solid.RadialScale(p));
    }
    const Eigen::Vector3d beyond = p.cwiseAbs() - solid.half_size;
    return beyond.maxCoeff() < 0.0 ? -beyond.maxCoeff() : beyond.cwiseMax(0.0).norm();
  }

  bool StandsOver(const Solid& solid, const StandPlane& plane, const Eigen::Vector3d& p,
                  double margin) const {
    constexpr double kOnIt = 0.03;  // metres between a thing's bottom and the table's top
    if (std::abs(Bottom(solid) - plane.height) > kOnIt) {
      return false;
    }
    std::vector<cv::Point2f> hull;
    cv::convexHull(Footprint(solid), hull);
    return cv::pointPolygonTest(hull, OnPlane(p), true) >= -margin;
  }

  std::optional<StandPlane> Table() const {
    const GroundTruthObject* widest = nullptr;
    const auto width = [](const GroundTruthObject& object) {
      return object.solid.half_size.x() * object.solid.half_size.y();
    };
    for (const GroundTruthObject& object : objects_) {
      if (object.label == "dining_table" && (widest == nullptr || width(object) > width(*widest))) {
        widest = &object;
      }
    }
    if (widest != nullptr) {
      const Solid& solid = widest->solid;
      StandPlane top{Bottom(solid) + 2.0 * solid.half_size.z(), 1, Footprint(solid), {}};
      cv::convexHull(top.footprints, top.hull);
      return top;
    }
    const auto most = std::max_element(planes_.begin(), planes_.end(),
                                       [](const auto& a, const auto& b) { return a.solids < b.solids; });
    return most != planes_.end() && most->solids > 2 ? std::optional(*most) : std::nullopt;
  }

  const std::vector<GroundTruthObject>& objects_;
  const DenseEvaluationOptions& options_;
  Eigen::Vector3d up_ = Eigen::Vector3d::UnitZ();
  Eigen::Vector3d along_ = Eigen::Vector3d::UnitX();
  Eigen::Vector3d across_ = Eigen::Vector3d::UnitY();
  std::vector<StandPlane> planes_;
};

// Nearest points of a cloud.
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

// Root mean square distance from their plane of the share of points that are nearest to it. The plane is
// fitted to them, again as they change.
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
    const Eigen::Vector3d normal =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter).eigenvectors().col(0);
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

// Timestamps and true poses of the keyframes.
std::optional<Rigid3d> TruePoseAt(const Trajectory& truth, double timestamp, double max_difference) {
  const auto pairs = AssociateByTime({{timestamp, {}}}, truth, max_difference);
  return pairs.empty() ? std::nullopt : std::optional(truth[pairs.front().second].T_map_camera);
}

std::vector<Eigen::Vector3d> InWorld(const std::vector<Eigen::Vector3d>& points, const Sim3d& S_world_map) {
  std::vector<Eigen::Vector3d> moved;
  for (const Eigen::Vector3d& p : points) {
    moved.push_back(S_world_map * p);
  }
  return moved;
}

}  // namespace

DenseEvaluation EvaluateDense(const fs::path& result, const fs::path& sequence,
                              const DenseEvaluationOptions& options) {
  constexpr double kMaxTimeDifference = 0.02;  // seconds
  const GroundTruth truth = ReadGroundTruth(sequence);
  const DepthRecording depths(result / "map.sqmap");
  if (depths.Keyframes().empty()) {
    throw InputError(fmt::format("{}: holds no depth maps, expected those of sqslam densify",
                                 (result / "map.sqmap").string()));
  }
  const auto aligned =
      ComputeTrajectoryError(ReadTrajectory(result / "trajectory.txt"), truth.trajectory, kMaxTimeDifference);
  if (!aligned) {
    throw InputError(fmt::format("{}: cannot be aligned, expected three or more true poses of its time",
                                 (result / "trajectory.txt").string()));
  }
  const Sim3d& S_world_map = aligned->S_world_map;
  const KnownSurfaces known(truth.objects, options);
  std::optional<CloudDistance> cloud;
  if (fs::exists(sequence / "dense.ply")) {
    cloud.emplace(ReadPointCloud(sequence / "dense.ply").points);
  }
  DenseEvaluation evaluation;
  std::vector<double> measured, by_plane;
  std::size_t pixels = 0, complete = 0, filled = 0;
  const MapSnapshotPtr map = RecordingReader(result / "map.sqmap").Last();
  const std::vector<std::int64_t> there = depths.Keyframes();
  for (const SnapshotKeyframe& keyframe : map->keyframes) {
    ++evaluation.keyframes;
    if (std::find(there.begin(), there.end(), keyframe.id) == there.end()) {
      continue;
    }
    const DepthMap depth = depths.Kept(keyframe.id);
    const std::optional<Rigid3d> true_pose =
        TruePoseAt(truth.trajectory, keyframe.timestamp, kMaxTimeDifference);
    pixels = depth.depth.total();
    for (int y = 0; y < depth.depth.rows; ++y) {
      for (int x = 0; x < depth.depth.cols; ++x) {
        if (!(depth.depth.at<float>(y, x) > 0.0F)) {
          continue;
        }
        const bool is_filled = depth.views.at<std::uint8_t>(y, x) == kFilledByPlane;
        ++(is_filled ? filled : complete);
        if (x % options.stride != 0 || y % options.stride != 0) {
          continue;
        }
        const Eigen::Vector3d p_world = S_world_map * depth.PointAt(x, y);
        std::optional<double> distance;
        if (cloud) {
          distance = cloud->To(p_world);
        } else if (true_pose) {
          const Eigen::Vector3d ray = true_pose->rotation * depth.camera.Unproject({double(x), double(y)});
          distance = known.Distance(true_pose->translation, ray, p_world);
        }
        if (distance) {
          (is_filled ? by_plane : measured).push_back(*distance);
        }
      }
    }
  }
  const double all = static_cast<double>(pixels) * evaluation.keyframes;
  evaluation.complete = static_cast<double>(complete) / all;
  evaluation.filled = static_cast<double>(filled) / all;
  evaluation.tested = static_cast<double>(measured.size()) * options.stride * options.stride / all;
  evaluation.measured = Summarized(measured);
  evaluation.by_plane = Summarized(by_plane);
  if (fs::exists(result / "dense.ply")) {
    evaluation.top =
        Flatness(known.OnTable(InWorld(ReadPointCloud(result / "dense.ply").points, S_world_map)));
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
                                     {"by_plane", distances(e.by_plane)}};
  if (e.top) {
    document["table_top_rms"] = *e.top;
  }
  WriteJsonFile(path, document);
}

}  // namespace sqslam
