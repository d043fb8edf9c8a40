#include <algorithm>
#include <cmath>
#include <map>

#include "slam/geometry/ray.h"
#include "slam/geometry/similarity_alignment.h"
#include "slam/run/scale_estimation.h"

namespace sqslam {
namespace {

// Returns the point nearest by angle to all rays, which have unit directions, or nothing if they are nearly
// parallel.
std::optional<Eigen::Vector3d> IntersectRays(const std::vector<Ray>& rays) {
  constexpr double kMinAngle = 0.02;  // rad between the outermost rays
  constexpr int kIterations = 3;      // the first assumes rays of equal length
  const bool apart = std::ranges::any_of(
      rays, [&](const Ray& ray) { return ray.direction.cross(rays.front().direction).norm() > kMinAngle; });
  if (rays.size() < 2 || !apart) {
    return std::nullopt;
  }
  Eigen::Vector3d place = Eigen::Vector3d::Zero();
  for (int round = 0; round < kIterations; ++round) {
    RaySum sum;
    for (const Ray& ray : rays) {
      sum.Add(ray, round == 0 ? 1.0 : 1.0 / (place - ray.origin).squaredNorm());
    }
    place = sum.Nearest();
  }
  return place.allFinite() ? std::optional(place) : std::nullopt;
}

struct Fit {
  Sim3d S_board_map;
  double rms = 0.0;
  int corners = 0;
};

// `excluded`: index of a sighting that is not used; beyond the last for none.
std::optional<Fit> FitCorners(const std::vector<BoardSighting>& sightings, std::size_t excluded,
                              const Camera& camera, const CalibrationBoard& board) {
  std::map<int, std::vector<Ray>> rays;  // by corner
  for (std::size_t i = 0; i < sightings.size(); ++i) {
    if (i == excluded) {
      continue;
    }
    const auto& [pose, view] = sightings[i];
    for (std::size_t k = 0; k < view.ids.size(); ++k) {
      const Eigen::Vector2d pixel(view.corners[k].x, view.corners[k].y);
      const Eigen::Vector3d ray = camera.Unproject(camera.Undistort(pixel));
      rays[view.ids[k]].push_back({pose.translation, (pose.rotation * ray).normalized()});
    }
  }
  const std::vector<cv::Point3f> corners = BoardCorners(board);
  std::vector<Eigen::Vector3d> in_map, on_board;
  for (const auto& [id, lines] : rays) {
    if (const auto place = IntersectRays(lines)) {
      const cv::Point3f& corner = corners[static_cast<std::size_t>(id)];
      in_map.push_back(*place);
      on_board.push_back(1e-3 * Eigen::Vector3d(corner.x, corner.y, corner.z));
    }
  }
  const std::optional<Sim3d> fitted = AlignSimilarity(in_map, on_board);
  if (!fitted) {
    return std::nullopt;
  }
  Fit fit{*fitted, 0.0, static_cast<int>(in_map.size())};
  for (std::size_t i = 0; i < in_map.size(); ++i) {
    fit.rms += (*fitted * in_map[i] - on_board[i]).squaredNorm();
  }
  fit.rms = std::sqrt(fit.rms / static_cast<double>(in_map.size()));
  return fit;
}

}  // namespace

std::optional<BoardScale> ScaleByBoard(const std::vector<BoardSighting>& sightings, const Camera& camera,
                                       const CalibrationBoard& board) {
  constexpr std::size_t kMinKeyframes = 4;
  const std::optional<Fit> all = FitCorners(sightings, sightings.size(), camera, board);
  if (!all || sightings.size() < kMinKeyframes) {
    return std::nullopt;
  }
  std::vector<double> logs;
  for (std::size_t i = 0; i < sightings.size(); ++i) {
    const std::optional<Fit> others = FitCorners(sightings, i, camera, board);
    if (!others) {
      return std::nullopt;  // depends on a single keyframe
    }
    logs.push_back(std::log(others->S_board_map.scale));
  }
  const auto count = static_cast<double>(logs.size());
  double mean = 0.0, squares = 0.0;
  for (const double log : logs) {
    mean += log / count;
  }
  for (const double log : logs) {
    squares += (log - mean) * (log - mean);
  }
  const double metres = all->S_board_map.scale;
  // So few samples underestimate their spread: scale to the variance of Student's t.
  const double student = (count - 1.0) / (count - 3.0);
  return BoardScale{metres, metres * std::sqrt(student * (count - 1.0) / count * squares), all->rms,
                    all->corners};
}

}  // namespace sqslam
