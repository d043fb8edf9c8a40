#include "slam/evaluation/dense_evaluation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nanoflann.hpp>
#include <nlohmann/json.hpp>
#include <utility>

#include "slam/io/point_cloud.h"
#include "slam/util/json_file.h"
#include "slam/util/statistics.h"
#include "slam/util/throw_if.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

// Adapts points to nanoflann.
struct CloudView {
  const std::vector<Eigen::Vector3d>& points;

  std::size_t kdtree_get_point_count() const { return points.size(); }
  double kdtree_get_pt(std::size_t i, std::size_t axis) const { return points[i][static_cast<int>(axis)]; }
  template <typename Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};

PointCloud ReadDensePoints(const fs::path& path, const char* expected) {
  ThrowIf<InputError>(!fs::exists(path), "{}: no such file; expected {}", path.string(), expected);
  PointCloud cloud = ReadPointCloud(path);
  ThrowIf<InputError>(cloud.points.empty(), "{}: holds no points, expected {}", path.string(), expected);
  return cloud;
}

std::string DistancesText(const CloudDistances& d) {
  std::string text = fmt::format("median {:.1f} mm, p90 {:.1f} mm", 1e3 * d.median, 1e3 * d.p90);
  for (std::size_t i = 0; i < d.within.size(); ++i) {
    text += fmt::format(", {:.1f} % within {:.0f} mm", 100.0 * d.within[i], 1e3 * kCloseDistances[i]);
  }
  return text;
}

nlohmann::ordered_json DistancesJson(const CloudDistances& d) {
  nlohmann::ordered_json document = {{"points", d.points}, {"median", d.median}, {"p90", d.p90}};
  for (std::size_t i = 0; i < d.within.size(); ++i) {
    document[fmt::format("within_{:.0f}_mm", 1e3 * kCloseDistances[i])] = d.within[i];
  }
  return document;
}

}  // namespace

CloudDistances DistancesTo(const SurfacePoints& surface, const std::vector<Eigen::Vector3d>& points) {
  const CloudView view{surface.points};
  using Metric = nanoflann::L2_Simple_Adaptor<double, CloudView>;
  const nanoflann::KDTreeSingleIndexAdaptor<Metric, CloudView, 3, std::size_t> tree(
      3, view, nanoflann::KDTreeSingleIndexAdaptorParams(10));
  const std::vector<double> distances = ToVector(points, [&](const Eigen::Vector3d& p) {
    std::size_t index = 0;
    double squared = 0.0;
    tree.knnSearch(p.data(), 1, &index, &squared);
    return surface.normals.empty() ? std::sqrt(squared)
                                   : std::abs(surface.normals[index].dot(p - surface.points[index]));
  });
  CloudDistances summary{static_cast<int>(points.size()), LinearQuantile(distances, 0.5),
                         LinearQuantile(distances, 0.9)};
  for (std::size_t i = 0; i < kCloseDistances.size(); ++i) {
    const auto close = std::ranges::count_if(distances, [&](double d) { return d <= kCloseDistances[i]; });
    summary.within[i] = static_cast<double>(close) / summary.points;
  }
  return summary;
}

DenseEvaluation EvaluateDense(const fs::path& result, const fs::path& sequence,
                              const EvaluationOptions& options) {
  PointCloud truth =
      ReadDensePoints(sequence / "dense.ply", "true surface points, in the frame of objects_gt.json");
  SurfacePoints estimate{
      ReadDensePoints(result / "dense.ply", "the cloud that sqslam densify writes").points};
  const fs::path trajectory = result / "trajectory.txt";
  const Sim3d S_world_map =
      AlignWithTruth(ReadTrajectory(trajectory), ReadGroundTruth(sequence), options, trajectory.string())
          .S_world_map;
  for (Eigen::Vector3d& p : estimate.points) {
    p = S_world_map * p;
  }
  const SurfacePoints surface{std::move(truth.points), std::move(truth.normals)};
  return {DistancesTo(surface, estimate.points), DistancesTo(estimate, surface.points)};
}

std::string FormatDense(const DenseEvaluation& evaluation) {
  return fmt::format("accuracy       {} estimated points to the true surface: {}\n",
                     evaluation.accuracy.points, DistancesText(evaluation.accuracy)) +
         fmt::format("completeness   {} true points to the estimate: {}\n", evaluation.completeness.points,
                     DistancesText(evaluation.completeness));
}

void WriteDenseEvaluation(const fs::path& path, const DenseEvaluation& evaluation) {
  WriteJsonFile(path, nlohmann::ordered_json{{"format", "sqslam-dense-eval"},
                                             {"version", 1},
                                             {"accuracy", DistancesJson(evaluation.accuracy)},
                                             {"completeness", DistancesJson(evaluation.completeness)}});
}

}  // namespace sqslam
