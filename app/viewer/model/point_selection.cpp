#include "app/viewer/model/point_selection.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "slam/fitting/cloud_preparation.h"
#include "slam/io/point_cloud.h"

namespace sqslam::viewer {
namespace {

template <typename Predicate>
std::vector<int> Select(std::span<const Eigen::Vector3d> points, Predicate predicate) {
  std::vector<int> chosen;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (predicate(points[i])) {
      chosen.push_back(static_cast<int>(i));
    }
  }
  return chosen;
}

}  // namespace

Points PointsOf(const MapSnapshot& map) {
  Points points;
  for (const SnapshotPoint& point : map.points) {
    points.push_back(point.p_map.cast<double>());
  }
  return points;
}

Points ReadPoints(const std::filesystem::path& path, const Sim3d& S_annotation_file) {
  Points points = ReadPointCloud(path).points;
  for (Eigen::Vector3d& p : points) {
    p = S_annotation_file * p;
  }
  return points;
}

bool Inside(std::span<const Eigen::Vector2d> polygon, const Eigen::Vector2d& p) {
  bool inside = false;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector2d& a = polygon[i];
    const Eigen::Vector2d& b = polygon[(i + 1) % polygon.size()];
    if ((a.y() > p.y()) != (b.y() > p.y()) &&
        p.x() < a.x() + (p.y() - a.y()) / (b.y() - a.y()) * (b.x() - a.x())) {
      inside = !inside;
    }
  }
  return inside;
}

std::vector<int> SelectInBox(std::span<const Eigen::Vector3d> points, const SelectionBox& box) {
  const Rigid3d T_box_map = box.T_map_box.Inverse();
  return Select(points, [&](const Eigen::Vector3d& p) {
    return ((T_box_map * p).cwiseAbs().array() <= box.half_size.array()).all();
  });
}

std::vector<int> SelectInLasso(std::span<const Eigen::Vector3d> points,
                               std::span<const Eigen::Vector2d> polygon, const Camera& camera,
                               const Rigid3d& T_map_camera) {
  const Rigid3d T_camera_map = T_map_camera.Inverse();
  return Select(points, [&](const Eigen::Vector3d& p) {
    const Eigen::Vector3d p_camera = T_camera_map * p;
    return p_camera.z() > 0.0 && Inside(polygon, camera.ProjectDistorted(p_camera));
  });
}

std::vector<int> AboveGround(std::span<const Eigen::Vector3d> points, std::span<const int> chosen,
                             double ground, double margin) {
  std::vector<int> above;
  std::copy_if(chosen.begin(), chosen.end(), std::back_inserter(above),
               [&](int index) { return points[static_cast<std::size_t>(index)].z() > ground + margin; });
  return above;
}

std::vector<int> Combine(std::span<const int> old, std::span<const int> chosen, SelectMode mode) {
  std::vector<int> combined;
  if (mode == SelectMode::kAdd) {
    std::set_union(old.begin(), old.end(), chosen.begin(), chosen.end(), std::back_inserter(combined));
  } else if (mode == SelectMode::kRemove) {
    std::set_difference(old.begin(), old.end(), chosen.begin(), chosen.end(), std::back_inserter(combined));
  } else {
    combined.assign(chosen.begin(), chosen.end());
  }
  return combined;
}

std::optional<double> GroundHeight(const MapSnapshot& map) {
  return map.support_height ? map.support_height : GroundHeight(PointsOf(map));
}

std::optional<double> GroundHeight(std::span<const Eigen::Vector3d> points) {
  constexpr double kThickness = 0.01;  // of the plane's points, as a share of the cloud's spread
  if (points.empty()) {
    return std::nullopt;
  }
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) {
    mean += p / static_cast<double>(points.size());
  }
  double square = 0.0;
  for (const Eigen::Vector3d& p : points) {
    square += (p - mean).squaredNorm() / static_cast<double>(points.size());
  }
  const std::optional<Plane> plane =
      FindLargestPlane(std::vector(points.begin(), points.end()), kThickness * std::sqrt(square), true, 0);
  if (!plane) {
    return std::nullopt;
  }
  return (plane->offset - plane->normal.head<2>().dot(mean.head<2>())) / plane->normal.z();
}

Points PointsAt(std::span<const Eigen::Vector3d> points, std::span<const int> chosen) {
  Points at;
  for (const int index : chosen) {
    at.push_back(points[static_cast<std::size_t>(index)]);
  }
  return at;
}

}  // namespace sqslam::viewer
