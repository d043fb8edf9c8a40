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

// `scale`: from the unit of the standard deviations to that of the errors.
double NormalisedRms(const std::vector<double>& errors, const std::vector<double>& sigmas, double scale) {
  double squares = 0.0;
  for (std::size_t i = 0; i < errors.size(); ++i) {
    squares += std::pow(errors[i] / (scale * sigmas[i]), 2);
  }
  return std::sqrt(squares / static_cast<double>(errors.size()));
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

std::vector<double> DistancesTo(const SurfacePoints& surface, const std::vector<Eigen::Vector3d>& points) {
  const CloudView view{surface.points};
  using Metric = nanoflann::L2_Simple_Adaptor<double, CloudView>;
  const nanoflann::KDTreeSingleIndexAdaptor<Metric, CloudView, 3, std::size_t> tree(
      3, view, nanoflann::KDTreeSingleIndexAdaptorParams(10));
  return ToVector(points, [&](const Eigen::Vector3d& p) {
    std::size_t index = 0;
    double squared = 0.0;
    tree.knnSearch(p.data(), 1, &index, &squared);
    const bool oriented = !surface.normals.empty() && surface.normals[index].squaredNorm() > 0.0;
    return oriented ? std::abs(surface.normals[index].dot(p - surface.points[index])) : std::sqrt(squared);
  });
}

CloudDistances SummaryOf(const std::vector<double>& distances) {
  CloudDistances summary{static_cast<int>(distances.size()), LinearQuantile(distances, 0.5),
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
  PointCloud cloud = ReadDensePoints(result / "dense.ply", "the cloud that sqslam densify writes");
  SurfacePoints estimate{std::move(cloud.points)};
  const fs::path trajectory = result / "trajectory.txt";
  const Sim3d S_world_map =
      AlignWithTruth(ReadTrajectory(trajectory), ReadGroundTruth(sequence), options, trajectory.string())
          .S_world_map;
  for (Eigen::Vector3d& p : estimate.points) {
    p = S_world_map * p;
  }
  const SurfacePoints surface{std::move(truth.points), std::move(truth.normals)};
  const std::vector<double> errors = DistancesTo(surface, estimate.points);
  DenseEvaluation evaluation{SummaryOf(errors), SummaryOf(DistancesTo(estimate, surface.points)), {}};
  if (!cloud.sigmas.empty() && std::ranges::min(cloud.sigmas) > 0.0) {
    evaluation.normalised_rms = NormalisedRms(errors, cloud.sigmas, S_world_map.scale);
  }
  return evaluation;
}

std::string FormatDense(const DenseEvaluation& evaluation) {
  return fmt::format("accuracy       {} estimated points to the true surface: {}\n",
                     evaluation.accuracy.points, DistancesText(evaluation.accuracy)) +
         (evaluation.normalised_rms
              ? fmt::format(
                    "prediction     RMS of the errors over their predicted standard deviations: {:.2f}\n",
                    *evaluation.normalised_rms)
              : "") +
         fmt::format("completeness   {} true points to the estimate: {}\n", evaluation.completeness.points,
                     DistancesText(evaluation.completeness));
}

void WriteDenseEvaluation(const fs::path& path, const DenseEvaluation& evaluation) {
  nlohmann::ordered_json document = {{"format", "sqslam-dense-eval"},
                                     {"version", 1},
                                     {"accuracy", DistancesJson(evaluation.accuracy)},
                                     {"completeness", DistancesJson(evaluation.completeness)}};
  if (evaluation.normalised_rms) {
    document["accuracy"]["normalised_rms"] = *evaluation.normalised_rms;
  }
  WriteJsonFile(path, document);
}

}  // namespace sqslam
